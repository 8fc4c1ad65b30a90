"""The hybrid servo: (8)-(11)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.messages import estimate_of, goal_of

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.control.servo import HybridServo, torque_servo
from turnscrew.geometry.euler import euler_from_matrix, matrix_from_euler
from turnscrew.geometry.rotations import exp_so3

TOOL = ToolInertia(0.08, np.array([0.0, 0.0, 0.11]), np.diag([2e-4, 2e-4, 1.3e-5]))
SERVO = HybridServo(TOOL, pitch=0.0007)
DT = 0.005


def test_at_rest_and_upright_the_hand_carries_the_weight_and_presses_the_tip():
    estimate = estimate_of(F_s=np.array([0.0, 0, 5.0, 0, 0, 0.03]))
    _, nu_d, F_hd = SERVO.update(SERVO.init(estimate), goal_of(tip_force=5.0), estimate, DT)
    np.testing.assert_allclose(nu_d, 0.0, atol=1e-15)
    np.testing.assert_allclose(F_hd, [0, 0, 0.08 * 9.81 - 5.0, 0, 0, -0.03], atol=1e-12)


def test_a_weak_tip_force_is_made_up_for_within_the_limit():
    weak = estimate_of(F_s=np.array([0.0, 0, 3.0, 0, 0, 0]))
    state = SERVO.init(weak)
    pressing = []
    for _ in range(2000):
        state, _, F_hd = SERVO.update(state, goal_of(tip_force=5.0), weak, DT)
        pressing.append(-F_hd[2])
    assert np.all(np.diff(pressing) >= -1e-12)
    assert pressing[-1] - pressing[0] == pytest.approx(SERVO.force_limit, rel=0.01)


def follow(start: np.ndarray, turn_rate: float, seconds: float) -> np.ndarray:
    """A tool that follows the reference exactly: Euler angles over time."""
    estimate = estimate_of(R_WT=matrix_from_euler(start))
    state, track = SERVO.init(estimate), []
    for _ in range(round(seconds / DT)):
        state, nu_d, _ = SERVO.update(state, goal_of(turn_rate=turn_rate), estimate, DT)
        estimate = estimate_of(R_WT=estimate.R_WT @ exp_so3(nu_d[3:] * DT))
        track.append(euler_from_matrix(estimate.R_WT))
    return np.array(track)


def test_a_leaning_tool_is_raised_without_overshoot():
    track = follow(np.radians([2.0, -1.5, 20.0]), 0.0, 2.0)
    assert np.abs(track[-1, :2]).max() < np.radians(0.01)
    # kv = 2 sqrt(kp): critical, so nothing beyond what the 5 ms step adds
    assert track[:, 0].min() > np.radians(-0.05)


def test_the_tool_turns_at_the_goals_rate():
    track = follow(np.zeros(3), -1.0, 1.2)
    rate = (track[-1, 2] - track[-41, 2]) / (40 * DT)
    assert rate == pytest.approx(-1.0, abs=0.01)


def test_the_reference_follows_the_thread():
    estimate = estimate_of()
    state = SERVO.init(estimate)
    for _ in range(100):
        state, nu_d, _ = SERVO.update(state, goal_of(turn_rate=-1.0), estimate, DT)
    assert nu_d[2] == pytest.approx(0.0007 / (2 * np.pi) * nu_d[5], rel=1e-9)
    assert nu_d[0] == nu_d[1] == 0.0


def test_the_yaw_target_waits_for_a_tool_that_is_held_back():
    estimate = estimate_of()
    state = SERVO.init(estimate)
    for _ in range(1000):
        state, _, _ = SERVO.update(state, goal_of(turn_rate=-1.0), estimate, DT)
    assert state.yaw_d == pytest.approx(-SERVO.yaw_limit)


@pytest.mark.parametrize("start", [3.0, -3.0])
def test_the_yaw_error_is_taken_the_short_way_round(start):
    track = follow(np.array([0.0, 0.0, start]), -1.0 if start < 0 else 1.0, 1.5)
    steps = np.diff(np.unwrap(track[:, 2]))
    assert np.abs(steps).max() < 1.5 * DT


TORQUE = torque_servo(TOOL, pitch=0.0007)


def settled(estimate):
    """The state of a servo whose gains have grown."""
    return replace(TORQUE.init(estimate), age=TORQUE.ease)


def test_torques_brake_the_tools_own_rate():
    still, leaning = estimate_of(), estimate_of(nu=np.array([0.0, 0, 0, 0.1, 0, 0]))
    state, nu_d, _ = TORQUE.update(settled(still), goal_of(turn_rate=-1.0), leaning, DT)
    np.testing.assert_allclose(state.alpha[3], -TORQUE.kv * 0.1, rtol=1e-6)
    # what is wanted is the goal's rate, whatever the tool does
    np.testing.assert_allclose(nu_d[3:], [0, 0, -1.0], atol=1e-12)


def test_torque_gains_are_those_of_a_damped_spring():
    servo = torque_servo(TOOL, 0.0007, frequency=20.0, damping=0.7)
    poles = np.roots([1.0, servo.kv, servo.kp])
    np.testing.assert_allclose(np.abs(poles), 20.0)
    np.testing.assert_allclose(-poles.real / 20.0, 0.7)


def test_the_gains_grow_while_the_estimate_settles():
    leaning = estimate_of(R_WT=exp_so3(np.array([0.03, 0.0, 0.0])))
    state, sizes = TORQUE.init(leaning), []
    for _ in range(100):
        state, _, _ = TORQUE.update(state, goal_of(), leaning, DT)
        sizes.append(np.linalg.norm(state.alpha))
    assert sizes[0] < 0.05 * sizes[-1]
    assert sizes[-1] > 0.9 * TORQUE.kp * 0.03


def test_biased_readings_move_the_wanted_force_by_half_a_newton_at_most():
    biased = estimate_of(F_s=np.array([0.0, 0, 1.0, 0, 0.02, 0.03]))
    state = settled(biased)
    for _ in range(3000):
        state, _, F_hd = TORQUE.update(state, goal_of(tip_force=5.0), biased, DT)
    assert -F_hd[2] + 0.08 * 9.81 == pytest.approx(5.0 + TORQUE.force_limit)
    assert -F_hd[4] == pytest.approx(TORQUE.side_limit)
