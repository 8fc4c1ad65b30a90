"""Arm and fingers reach what is within reach, keep to their joint ranges, and say so when they cannot."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.robot.inverse_kinematics import TOLERANCE, Reach, place_fingertip, place_palm, rotation_vector
from turnscrew.robot.joints import COUPLED, FINGERS, INDEX, JOINTS, finger_joints
from turnscrew.robot.model import RobotModel


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return RobotModel()


def posture(robot: RobotModel, rng: np.random.Generator, margin: float = 0.05) -> np.ndarray:
    q = rng.uniform(robot.limits[:, 0] + margin, robot.limits[:, 1] - margin)
    for follower, leader in COUPLED.items():
        q[INDEX[follower]] = q[INDEX[leader]]
    return q


@pytest.mark.parametrize("seed", range(10))
def test_palm_reaches_poses_that_the_arm_can_take(robot: RobotModel, seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, R = robot.palm(posture(robot, rng))
    found = place_palm(robot, p, R, np.zeros(len(JOINTS)), rng, margin=0.04)
    assert found.status is Reach.SOLVED
    p_found, R_found = robot.palm(found.q)
    # the solver's own tolerance: a micron, and the turn that it weighs the same
    np.testing.assert_allclose(p_found, p, atol=TOLERANCE)
    np.testing.assert_allclose(R_found, R, atol=TOLERANCE / 0.1)
    moved = found.q[:6]
    assert (moved >= robot.limits[:6, 0] + 0.04).all()
    assert (moved <= robot.limits[:6, 1] - 0.04).all()
    assert not found.q[6:].any()


@pytest.mark.parametrize("finger", FINGERS)
@pytest.mark.parametrize("seed", range(3))
def test_fingertip_reaches_points_that_the_finger_can_touch(robot: RobotModel, finger: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    goal = posture(robot, rng)
    start = posture(robot, rng)
    start[:6] = goal[:6]
    row = FINGERS.index(finger)
    target = robot.fingertips(goal).p_WF[row]
    found = place_fingertip(robot, finger, target, start, rng, margin=0.04, starts=10)
    assert found.status is Reach.SOLVED
    # the solver's own tolerance
    np.testing.assert_allclose(robot.fingertips(found.q).p_WF[row], target, atol=TOLERANCE)
    joints = list(finger_joints(finger))
    assert (found.q[joints] >= robot.limits[joints, 0] + 0.04).all()
    assert (found.q[joints] <= robot.limits[joints, 1] - 0.04).all()
    assert all(found.q[INDEX[follower]] == found.q[INDEX[leader]] for follower, leader in COUPLED.items())
    others = [INDEX[name] for name in JOINTS if name[:2] != finger]
    np.testing.assert_array_equal(found.q[others], start[others])


def test_point_out_of_reach_says_so_and_how_far_it_misses(robot: RobotModel) -> None:
    rng = np.random.default_rng(0)
    q = np.zeros(len(JOINTS))
    row = FINGERS.index("MF")
    tips = robot.fingertips(q)
    away = 0.05 * tips.R_WF[row][:, 2]
    found = place_fingertip(robot, "MF", tips.p_WF[row] + away, q, rng)
    assert found.status is not Reach.SOLVED
    # the finger is straight and the point 50 mm straight ahead: nothing nearer than the present tip
    assert found.residual == pytest.approx(0.05, rel=1e-3)


def test_limits_in_the_way_are_told_from_other_failures(robot: RobotModel) -> None:
    rng = np.random.default_rng(0)
    q = np.zeros(len(JOINTS))
    q[INDEX["MFJ3"]] = 0.8
    beyond = q.copy()
    # half a radian past the sideways joint's range
    beyond[INDEX["MFJ4"]] = robot.limits[INDEX["MFJ4"], 1] + 0.5
    target = robot.fingertips(beyond).p_WF[FINGERS.index("MF")]
    found = place_fingertip(robot, "MF", target, q, rng)
    assert found.status is Reach.AT_LIMITS
    assert found.q[INDEX["MFJ4"]] == robot.limits[INDEX["MFJ4"], 1]


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 3.0, np.pi])
def test_rotation_vector_is_axis_times_angle(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    found = rotation_vector(R)
    # half a turn has two axes; rounding of the cosine near pi costs half the digits
    assert min(np.abs(found - angle * axis).max(), np.abs(found + angle * axis).max()) < 1e-7
