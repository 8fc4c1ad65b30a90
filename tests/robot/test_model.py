"""The robot's model of itself: laws of mechanics, central differences, and a pendulum in closed form."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from turnscrew.robot.arm import LINKS, link_transform
from turnscrew.robot.joints import ARM, COUPLED, FINGERS, INDEX, JOINTS
from turnscrew.robot.model import BASE_HEIGHT, RobotModel, driven_jacobian

ROBOT = RobotModel()
N = len(JOINTS)
H = 1e-6
"""Step of central differences: their error is H^2 times third derivatives of order 1, plus rounding of 1e-16 / H."""


def states(count: int = 5) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(1)
    low, high = ROBOT.limits.T
    return [(rng.uniform(low, high), rng.normal(size=N)) for _ in range(count)]


@pytest.mark.parametrize(("q", "v"), states())
def test_the_mass_matrix_is_symmetric_and_positive(q, v):
    M = ROBOT.mass_matrix(q)
    np.testing.assert_allclose(M, M.T, rtol=0, atol=1e-12)
    # every drive has reflected inertia, the fingers' .001 kg.m2
    assert np.linalg.eigvalsh(M)[0] > 1e-4


@pytest.mark.parametrize(("q", "v"), states())
def test_coriolis_forces_do_the_work_of_the_changing_mass_matrix(q, v):
    Mdot = (ROBOT.mass_matrix(q + H * v) - ROBOT.mass_matrix(q - H * v)) / (2 * H)
    # d/dt(v M v / 2) at constant v: v Mdot v / 2 = v C v, since Mdot - 2 C is skew
    assert v @ ROBOT.coriolis(q, v) == pytest.approx(0.5 * v @ Mdot @ v, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize(("q", "v"), states())
def test_coriolis_forces_are_quadratic_in_speed(q, v):
    np.testing.assert_allclose(ROBOT.coriolis(q, 2 * v), 4 * ROBOT.coriolis(q, v), rtol=0, atol=1e-9)


@pytest.mark.parametrize(("q", "v"), states())
def test_gravity_does_no_work_around_a_closed_path(q, v):
    rng = np.random.default_rng(2)
    a, b = 1e-3 * rng.normal(size=N), 1e-3 * rng.normal(size=N)
    corners = [q, q + a, q + a + b, q + b, q]
    work = sum(float(ROBOT.gravity((s + e) / 2) @ (e - s)) for s, e in pairwise(corners))
    # the midpoint rule's error on steps of 1e-3 rad and torques of 50 N.m with curvature of the same size
    assert abs(work) < 1e-6


def test_the_first_joints_gravity_torque_is_zero_about_the_vertical():
    for q, _ in states():
        assert ROBOT.gravity(q)[INDEX["WAMJ1"]] == pytest.approx(0.0, abs=1e-9)


def test_the_arms_gravity_torque_is_that_of_masses_on_levers():
    """WAMJ4's torque, arm upright and elbow bent by 90 deg: weights of link 4 and hand on horizontal levers."""
    q = np.zeros(N)
    q[INDEX["WAMJ4"]] = np.pi / 2
    model, data = ROBOT._model, ROBOT._data
    torque = ROBOT.gravity(q)[INDEX["WAMJ4"]]
    elbow = model.body("WAM_link4").id
    beyond = range(elbow, model.nbody)
    moment = sum(model.body_mass[b] * 9.81 * (data.xipos[b] - data.xpos[elbow]) for b in beyond)
    axis = data.xmat[elbow].reshape(3, 3)[:, 2]
    assert torque == pytest.approx(float(-np.cross(moment, [0, 0, -1.0]) @ axis), rel=1e-9)


def test_the_arm_stands_where_its_denavit_hartenberg_parameters_put_it():
    rng = np.random.default_rng(3)
    q = np.zeros(N)
    q[: len(ARM)] = rng.uniform(-0.8, 0.8, len(ARM))
    place, R = np.array([0.0, 0.0, BASE_HEIGHT]), np.eye(3)
    for angle, link in zip(q, LINKS, strict=False):
        c, s = np.cos(angle), np.sin(angle)
        R = R @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        offset, (w, x, _, _) = link_transform(link)
        place = place + R @ offset
        c, s = w**2 - x**2, 2 * w * x
        R = R @ np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])
    ROBOT.gravity(q)
    plate = ROBOT._data.body("plate")
    np.testing.assert_allclose(plate.xpos, place + 0.06 * R[:, 2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(plate.xmat.reshape(3, 3), R, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("q", "v"), states())
def test_fingertip_jacobians_are_their_central_differences(q, v):
    tips, plus, minus = ROBOT.fingertips(q), ROBOT.fingertips(q + H * v), ROBOT.fingertips(q - H * v)
    np.testing.assert_allclose(tips.J[:, :3] @ v, (plus.p_WF - minus.p_WF) / (2 * H), rtol=0, atol=1e-8)
    for row in range(len(FINGERS)):
        W = (plus.R_WF[row] - minus.R_WF[row]) / (2 * H) @ tips.R_WF[row].T
        np.testing.assert_allclose(tips.J[row, 3:] @ v, [W[2, 1], W[0, 2], W[1, 0]], rtol=0, atol=1e-8)


@pytest.mark.parametrize("finger", FINGERS)
def test_a_points_jacobian_rate_is_its_central_difference(finger):
    q, v = states(1)[0]
    row = FINGERS.index(finger)

    def jacobian(s: float) -> np.ndarray:
        tips = ROBOT.fingertips(q + s * v)
        arm = tips.R_WF[row] @ in_tip
        return tips.J[row, :3] + np.cross(tips.J[row, 3:].T, arm).T

    in_tip = np.array([0.003, -0.004, 0.005])
    tips = ROBOT.fingertips(q)
    point = tips.p_WF[row] + tips.R_WF[row] @ in_tip
    Jdot = ROBOT.point_jacobian_rate(q, v, finger, point)
    np.testing.assert_allclose(Jdot, (jacobian(H) - jacobian(-H)) / (2 * H), rtol=0, atol=1e-8)


def test_the_palms_jacobian_is_its_central_difference():
    q, v = states(1)[0]
    before, after = ROBOT.palm(q - H * v)[0], ROBOT.palm(q + H * v)[0]
    np.testing.assert_allclose(ROBOT.palm_jacobian(q)[:3] @ v, (after - before) / (2 * H), rtol=0, atol=1e-8)


def test_coupled_joints_move_as_one_in_the_driven_jacobian():
    q, v = states(1)[0]
    for follower, leader in COUPLED.items():
        v[INDEX[follower]] = v[INDEX[leader]]
    J = ROBOT.fingertips(q).J
    driven = driven_jacobian(J)
    np.testing.assert_allclose(driven @ v, J @ v, rtol=0, atol=1e-12)
    assert not driven[..., [INDEX[follower] for follower in COUPLED]].any()
