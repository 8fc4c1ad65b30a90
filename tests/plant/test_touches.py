"""Contacts and velocities read at once are what MuJoCo's own routines tell one by one."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from rigs.cells import PLAN, cell, pressing

from turnscrew.plant.cell import Cell
from turnscrew.plant.truth import SLOT_GEOMS
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel

TIPS = [f"{finger.lower()}distal" for finger in FINGERS]


@pytest.fixture(scope="module")
def plant() -> Cell:
    """A tool that is squeezed and pressed into the slot, all still on its way."""
    plant = cell()
    plant.write(pressing(RobotModel(), PLAN.rolling(0.0), np.array([5.0, 2.5])))
    for _ in range(150):
        plant.prepare()
        plant.step()
    return plant


def contacts(plant):
    """Names of the geoms of each contact, its point, and the force of the first on the second, in W."""
    force = np.empty(6)
    for index, contact in enumerate(plant.data.contact):
        mujoco.mj_contactForce(plant.model, plant.data, index, force)
        names = [plant.model.geom(geom).name for geom in contact.geom]
        yield names, contact.pos, force[:3] @ contact.frame.reshape(3, 3)


def test_the_fingertips_feel_the_contacts_forces(plant):
    expected = np.zeros((5, 3))
    for names, _, force in contacts(plant):
        for name, sign in zip(names, (1.0, -1.0), strict=True):
            if name.removeprefix("C_") in TIPS:
                expected[TIPS.index(name.removeprefix("C_"))] += sign * force
    expected = [plant.data.body(tip).xmat.reshape(3, 3).T @ f for tip, f in zip(TIPS, expected, strict=True)]
    assert np.abs(expected).max() > 3.0
    # the same sums in another order
    np.testing.assert_allclose(plant.fingertip_forces(), expected, atol=1e-12)


def test_the_truth_holds_what_acts_on_the_tool(plant):
    truth, f_W, F = plant.truth(), np.zeros((5, 3)), np.zeros(6)
    for (one, other), point, force in contacts(plant):
        toucher, f = (other, -force) if one in ("handle", "shaft", "blade") else (one, force)
        if toucher in SLOT_GEOMS:
            F += [*f, *np.cross(point - truth.p_WT, f)]
        elif toucher.removeprefix("C_") in TIPS:
            f_W[TIPS.index(toucher.removeprefix("C_"))] += f
    assert abs(F[2]) > 1.0
    np.testing.assert_allclose(truth.f_W, f_W, atol=1e-12)
    np.testing.assert_allclose(truth.F_s, [*(truth.R_WT.T @ F[:3]), *(truth.R_WT.T @ F[3:])], atol=1e-12)
    np.testing.assert_array_equal(truth.touching, np.linalg.norm(f_W, axis=1) > 0.05)


def test_the_truth_holds_the_velocities_of_tool_and_fingertips(plant):
    truth, V = plant.truth(), np.empty(6)
    for name, got in zip(["tool", *TIPS], [truth.V_WT, *truth.V_WF], strict=True):
        body = plant.model.body(name).id
        mujoco.mj_objectVelocity(plant.model, plant.data, mujoco.mjtObj.mjOBJ_XBODY, body, V, 0)
        np.testing.assert_allclose(got, [*V[3:], *V[:3]], atol=1e-14)
    assert np.abs(truth.V_WF).max() > 1e-6
