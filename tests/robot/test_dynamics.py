"""Kinematics and dynamics in one pass, and the Jacobians of points at which fingertips touch."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.decide.plans import plan_for
from turnscrew.robot.contact_jacobian import contact_bias, contact_jacobian
from turnscrew.robot.coupling import DRIVEN_INDEX, SELECTION
from turnscrew.robot.joints import COUPLED, INDEX
from turnscrew.robot.model import RobotModel, driven_jacobian

ROBOT = RobotModel()
Q = plan_for(0.018).rolling(0.4)
V_D = np.random.default_rng(5).normal(size=24) * 0.3
V = SELECTION @ V_D
ROWS = np.array([0, 2, 3])
STEP = 1e-6


def points(tips):
    """Points on the fingertips' skin, off their axes."""
    return tips.p_WF[ROWS] + 0.006 * tips.R_WF[ROWS][:, :, 0]


def test_one_pass_is_what_the_single_answers_are():
    dynamics = ROBOT.dynamics(Q, V)
    np.testing.assert_allclose(dynamics.M, SELECTION.T @ ROBOT.mass_matrix(Q) @ SELECTION, atol=1e-12)
    np.testing.assert_allclose(dynamics.bias, SELECTION.T @ ROBOT.bias(Q, V), atol=1e-12)
    np.testing.assert_allclose(dynamics.J_palm, ROBOT.palm_jacobian(Q), atol=1e-12)
    np.testing.assert_allclose(dynamics.tips.J, ROBOT.fingertips(Q).J, atol=1e-12)


def test_the_same_arrays_cost_no_second_pass_and_others_do():
    first = ROBOT.dynamics(Q, V)
    assert ROBOT.dynamics(Q, V) is first
    assert ROBOT.dynamics(Q.copy(), V) is not first


def test_what_fingertips_accelerate_by_is_the_change_of_their_velocity():
    ahead, behind = (ROBOT.fingertips(Q + h * V).J @ V for h in (STEP, -STEP))
    # rounding of 1e-16 over the step, and its square
    np.testing.assert_allclose(ROBOT.dynamics(Q, V).Jdot_v, (ahead - behind) / (2 * STEP), atol=1e-7)


def test_coupled_joints_follow():
    for follower, leader in COUPLED.items():
        assert V[INDEX[follower]] == V[INDEX[leader]]
    np.testing.assert_allclose(V[DRIVEN_INDEX], V_D)
    J = ROBOT.fingertips(Q).J
    np.testing.assert_allclose(J @ SELECTION, driven_jacobian(J)[..., DRIVEN_INDEX], atol=1e-15)


def test_contact_jacobian_moves_the_fingertips_material_points():
    dynamics = ROBOT.dynamics(Q, V)
    c_W = points(dynamics.tips)
    J = contact_jacobian(dynamics.tips, ROWS, c_W)
    moved = [points(ROBOT.fingertips(Q + h * V)) for h in (STEP, -STEP)]
    np.testing.assert_allclose((J @ V_D).reshape(-1, 3), (moved[0] - moved[1]) / (2 * STEP), atol=1e-8)


@pytest.mark.parametrize("rolls", [False, True], ids=["fixed", "rolling"])
def test_contact_bias_is_the_change_of_the_contact_velocities(rolls):
    dynamics = ROBOT.dynamics(Q, V)
    c_W = points(dynamics.tips)
    cdot = np.random.default_rng(1).normal(size=(3, 3)) * 0.05
    if not rolls:
        cdot = (contact_jacobian(dynamics.tips, ROWS, c_W) @ V_D).reshape(-1, 3)

    def velocities(h):
        return contact_jacobian(ROBOT.fingertips(Q + h * V), ROWS, c_W + h * cdot) @ V_D

    differences = (velocities(STEP) - velocities(-STEP)) / (2 * STEP)
    tips = dynamics.tips
    bias = contact_bias(tips.J[ROWS], dynamics.Jdot_v[ROWS], tips.p_WF[ROWS], V, c_W, cdot)
    np.testing.assert_allclose(bias, differences, atol=1e-7)
