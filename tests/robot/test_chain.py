"""The chain's forward kinematics is MuJoCo's own."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.robot.chain import robot_chain, rotation
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel

# a dozen products of rotations with arms of a metre: rounding alone
ROUNDING = 1e-12


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return RobotModel()


@pytest.mark.parametrize("seed", range(10))
def test_places_palm_and_fingertips_as_the_robot_model_does(robot: RobotModel, seed: int) -> None:
    chain = robot_chain()
    q = np.random.default_rng(seed).uniform(robot.limits[:, 0], robot.limits[:, 1])
    p, R = chain.place(q)
    p_WH, R_WH = robot.palm(q)
    np.testing.assert_allclose(p[chain.palm], p_WH, atol=ROUNDING)
    np.testing.assert_allclose(R[chain.palm], R_WH, atol=ROUNDING)
    tips = robot.fingertips(q)
    for row, finger in enumerate(FINGERS):
        tip = chain.tips[finger]
        np.testing.assert_allclose(p[tip.body] + R[tip.body] @ tip.p, tips.p_WF[row], atol=ROUNDING)
        np.testing.assert_allclose(R[tip.body], tips.R_WF[row], atol=ROUNDING)
        assert tip.rho == pytest.approx(tips.rho[row], abs=ROUNDING)
        assert tip.length == pytest.approx(tips.length[row], abs=ROUNDING)


def test_knows_the_joint_ranges(robot: RobotModel) -> None:
    np.testing.assert_array_equal(robot_chain().limits, robot.limits)


def test_neighbours_do_not_collide_and_fingers_do() -> None:
    chain = robot_chain()
    index = chain.names.index
    assert (index("mfproximal"), index("mfmiddle")) in chain.apart
    assert (index("palm"), index("mfproximal")) in chain.apart
    assert (index("ffproximal"), index("mfproximal")) not in chain.apart


def test_every_finger_link_has_a_shape() -> None:
    names = {shape.name for shape in robot_chain().shapes}
    wanted = {f"C_{finger.lower()}{link}" for finger in FINGERS for link in ("proximal", "middle", "distal")}
    assert wanted <= names


def test_rotation_turns_about_its_axis() -> None:
    quarter = rotation(np.array([0.0, 0.0, 1.0]), np.pi / 2)
    # rounding of cos(pi/2)
    np.testing.assert_allclose(quarter @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)
