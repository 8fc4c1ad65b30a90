"""What is known anew between two ticks of the estimator."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.grips import PLAN, planned

from turnscrew.actuate.joint_motion import consistent_inverse, joint_speeds
from turnscrew.contact.grasp import grasp_matrix
from turnscrew.estimate.between_ticks import BetweenTicks, JointTrack
from turnscrew.geometry.rotations import log_so3
from turnscrew.robot.contact_jacobian import contact_jacobian
from turnscrew.robot.coupling import DRIVEN_INDEX, SELECTION
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel

ROBOT = RobotModel()
PITCH = 0.0007
BETWEEN = BetweenTicks(ROBOT, PITCH)
DT = 0.002
Q = PLAN.rolling(0.3)
TH_MF = np.array([finger in ("TH", "MF") for finger in FINGERS])
ROWS = np.flatnonzero(TH_MF)


def test_a_steady_motion_is_followed_without_lag():
    v = np.linspace(-1.0, 1.0, 28)
    state = BETWEEN.init(Q)
    for i in range(400):
        state = BETWEEN.read(state, Q + v * DT * i, DT)
    # .8 s are 26 time constants of the arm's filter
    np.testing.assert_allclose(state.q, Q + v * DT * 399, atol=1e-8)
    np.testing.assert_allclose(state.v, v, atol=1e-6)


def test_noise_of_the_encoders_is_halved():
    rng = np.random.default_rng(0)
    state, q = BETWEEN.init(Q), []
    for _ in range(2000):
        state = BETWEEN.read(state, Q + rng.normal(size=28), DT)
        q.append(state.q - Q)
    sigma = np.std(q[200:], axis=0)
    assert (sigma < 0.55).all()
    assert (sigma[:4] < 0.35).all()


@pytest.mark.parametrize("tip_free", [False, True])
def test_torques_are_told_for_the_same_time_as_the_speeds(tip_free):
    rng = np.random.default_rng(1)
    joints, track, q = BETWEEN.init(Q), BETWEEN.sent(None, np.zeros(24), DT), Q.copy()
    for _ in range(50):
        speed = rng.normal(size=28)
        track = BETWEEN.sent(track, speed[DRIVEN_INDEX], DT, tip_free)
        q = q + speed * DT
        joints = BETWEEN.read(joints, q, DT, tip_free)
    # what the speeds' filter makes of a speed, the torques' makes of a torque that is the same number
    np.testing.assert_allclose(track.tau, joints.v[DRIVEN_INDEX], atol=1e-10)


@pytest.mark.parametrize(("tip_free", "late"), [(False, 0.06), (True, 0.01)])
def test_the_arms_speed_is_told_sooner_while_the_tip_is_free(tip_free, late):
    state, told = BETWEEN.init(Q), 0.0
    for i in range(1000):
        state = BETWEEN.read(state, Q + 0.5 * (DT * i) ** 2, DT, tip_free)
        told = state.v[0]
    # a speed that grows evenly is told two time constants late, and the step in which it is read
    assert 999 * DT - told == pytest.approx(late, abs=DT)


def rolling(omega):
    """Joint speeds with which thumb and middle finger turn the tool about its tip."""
    estimate = planned(Q, touching=TH_MF)
    J = contact_jacobian(ROBOT.fingertips(Q), ROWS, estimate.c_W[ROWS])
    inverse = consistent_inverse(SELECTION.T @ ROBOT.mass_matrix(Q) @ SELECTION, J)
    V = grasp_matrix(estimate.c_W[ROWS], PLAN.p_WS).T @ np.array([0, 0, 0, *omega])
    return estimate, SELECTION @ joint_speeds(inverse, J, V, np.zeros(24))


@pytest.mark.parametrize("omega", [(0.0, 0.0, -1.0), (0.1, -0.05, 0.0), (0.05, 0.02, -1.0)])
def test_the_tools_rate_is_read_from_the_fingers_that_roll_on_it(omega):
    estimate, v = rolling(omega)
    fresh = BETWEEN.refresh(JointTrack(Q, v), estimate, DT)
    # the prior takes (2 mm)^2 of levers of (18 mm)^2, twice
    np.testing.assert_allclose(fresh.nu[3:], omega, rtol=0.01, atol=2e-3)
    assert fresh.nu[2] == pytest.approx(PITCH / (2 * np.pi) * fresh.nu[5])
    np.testing.assert_allclose(log_so3(fresh.R_WT), DT * fresh.nu[3:], atol=1e-9)


def test_nothing_turns_what_one_finger_touches():
    estimate, v = rolling((0.0, 0.0, -1.0))
    alone = planned(Q, touching=TH_MF & [True, False, False, False, False])
    assert not BETWEEN.refresh(JointTrack(Q, v), alone, DT).nu.any()
    assert estimate.touching.sum() == 2


def test_offsets_that_were_learned_are_taken_off():
    estimate = planned(Q, offset=np.full(28, 0.01))
    fresh = BETWEEN.refresh(JointTrack(Q, np.zeros(28)), estimate, 0.0)
    np.testing.assert_allclose(fresh.q, Q - 0.01)
