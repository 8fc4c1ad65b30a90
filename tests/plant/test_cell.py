"""The cell is honest physics: nothing holds the tool but contacts, and a held grasp does not creep."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from rigs.cells import PLAN, cell, pressing

from turnscrew.geometry.rotations import log_so3
from turnscrew.robot.joints import COUPLED, DRIVEN, INDEX, JOINTS
from turnscrew.robot.model import RobotModel

TOOL_GEOMS = ("handle", "shaft", "blade")


@pytest.fixture(scope="module")
def held() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Pose of the tool after 2 s of holding, and 20 s later."""
    plant = cell()
    plant.write(pressing(RobotModel(), PLAN.rolling(0.0), np.array([5.0, 2.5])))
    poses = []
    for duration in (2.0, 20.0):
        for _ in range(round(duration / plant.model.opt.timestep)):
            plant.prepare()
            plant.step()
        poses.extend(plant.tool_pose())
    return tuple(poses)


def test_a_held_grasp_creeps_less_than_a_tenth_of_a_millimetre_and_a_fifth_of_a_degree_in_20_s(held):
    p0, R0, p1, R1 = held
    grip = np.array([0.0, 0.0, 0.15])
    assert np.linalg.norm(p1 - p0) < 1e-4
    assert np.linalg.norm((p1 + R1 @ grip) - (p0 + R0 @ grip)) < 1e-4
    assert np.degrees(np.linalg.norm(log_so3(R1 @ R0.T))) < 0.2


def test_a_held_tool_stays_upright(held):
    _, _, _, R = held
    # the blade's play in the slot and unequal fingers let it lean by less than a degree
    assert np.degrees(np.arccos(R[2, 2])) < 2.0


def test_nothing_but_contact_acts_on_the_tool():
    model = cell().model
    tool = model.body("tool").id
    free = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    assert [model.joint(j).name for j in free] == ["tool"]
    assert model.nmocap == 0
    kinds = set(model.eq_type.tolist())
    assert kinds <= {int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON)}
    names = {model.equality(i).name for i in range(model.neq)}
    assert names == {f"{a}={b}" for a, b in COUPLED.items()} | {"helix"}
    driven = {model.joint(int(model.actuator_trnid[a, 0])).name for a in range(model.nu)}
    assert driven == {*DRIVEN, "screw"}
    assert model.body_gravcomp[tool] == 0
    assert not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY


def test_a_released_tool_falls():
    plant = cell()
    q = PLAN.rolling(0.0)
    q[[INDEX[name] for name in JOINTS if name[:2] in ("TH", "FF", "MF", "RF")]] = 0.0
    plant.write(pressing(RobotModel(), q, np.zeros(2)))
    for _ in range(2000):
        plant.prepare()
        plant.step()
    assert plant.tool_pose()[1][2, 2] < np.cos(np.radians(30))


def test_every_link_of_the_hand_collides_with_the_tool():
    model = cell().model
    links = [g for g in range(model.ngeom) if model.geom(g).name.startswith("C_")]
    assert len(links) >= 20
    for geom in TOOL_GEOMS:
        tool = model.geom(geom)
        for link in links:
            assert (model.geom_contype[link] & tool.conaffinity[0]) or (tool.contype[0] & model.geom_conaffinity[link])


def test_coupled_joints_stay_together_under_load():
    plant = cell()
    plant.write(pressing(RobotModel(), PLAN.rolling(0.0), np.array([8.0, 2.5])))
    for _ in range(1000):
        plant.prepare()
        plant.step()
    q = plant.q
    for follower, leader in COUPLED.items():
        # a tendon under .3 N.m stretches; the equality's compliance stays below a third of a degree
        assert abs(q[INDEX[follower]] - q[INDEX[leader]]) < np.radians(0.33)


def test_the_saved_text_compiles_to_the_same_model():
    plant = cell()
    again = mujoco.MjModel.from_xml_string(plant.xml)
    for name in ("body_mass", "body_inertia", "geom_size", "geom_pos", "dof_armature", "actuator_gainprm"):
        np.testing.assert_array_equal(getattr(again, name), getattr(plant.model, name))
