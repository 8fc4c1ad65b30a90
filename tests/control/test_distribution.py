"""Sharing the wrench: (15), (16), and the squeeze."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.messages import estimate_of, goal_of

from turnscrew.contact.friction import in_cone
from turnscrew.contact.grasp import grasp_matrix
from turnscrew.control.distribution import Distribution
from turnscrew.signals import Role

TH_MF = np.array([True, False, True, False, False])
FOUR = np.array([True, True, True, True, False])
DT = 0.005


def gripping(who, share=None, squeeze=4.0):
    share = who.astype(float) if share is None else share
    return goal_of(roles=np.where(who, Role.GRIP, Role.FREE), share=share, squeeze=share * squeeze)


def shared(goal, F_hd, estimate=None, ticks=1):
    block, estimate = Distribution(), estimate or estimate_of()
    state = block.init()
    for _ in range(ticks):
        state, wanted = block.update(state, goal, estimate, F_hd, DT)
    return wanted


def run(goal, F_hd, estimate=None, ticks=1):
    return shared(goal, F_hd, estimate, ticks).f_W


def test_what_two_fingers_cannot_give_is_told():
    F_hd = np.array([0.3, -0.2, -4.0, 0.02, -0.03, -0.03])
    wanted, estimate = shared(gripping(TH_MF), F_hd), estimate_of()
    given = grasp_matrix(estimate.c_W, np.zeros(3)) @ wanted.f_W.ravel()
    # no torque about the line that joins them; the rest adds up but for rounding
    assert np.linalg.norm(wanted.lost) > 1e-3
    np.testing.assert_allclose(given + wanted.lost, F_hd, atol=1e-9)


def test_without_a_finger_all_is_lost():
    F_hd = np.array([0.0, 0.0, -4.0, 0.0, 0.0, -0.03])
    np.testing.assert_array_equal(shared(gripping(np.zeros(5, dtype=bool)), F_hd).lost, F_hd)


def test_four_fingers_give_the_wanted_wrench():
    F_hd = np.array([0.3, -0.2, -4.0, 0.02, -0.03, -0.08])
    f_W = run(gripping(FOUR), F_hd)
    np.testing.assert_allclose(grasp_matrix(estimate_of().c_W, np.zeros(3)) @ f_W.ravel(), F_hd, atol=1e-9)


@pytest.mark.parametrize("torque", [0.0, -0.03, -0.06])
@pytest.mark.parametrize("thrust", [0.0, -4.0])
def test_two_fingers_carry_thrust_and_torque_inside_their_cones(torque, thrust):
    estimate = estimate_of()
    f_W = run(gripping(TH_MF), np.array([0, 0, thrust, 0, 0, torque]))
    assert f_W[~TH_MF] == pytest.approx(0.0)
    # friction is counted with .6; contacts 170 deg apart lose some of it, .8 is well inside what the skin holds
    assert in_cone(f_W[TH_MF], estimate.n_W[TH_MF], 0.8).all()
    wrench = grasp_matrix(estimate.c_W, np.zeros(3)) @ f_W.ravel()
    assert wrench[2] == pytest.approx(thrust, abs=0.05)
    assert wrench[5] == pytest.approx(torque, abs=0.005)


def test_a_share_that_goes_to_zero_hands_over_without_a_jump():
    F_hd = np.array([0, 0, -4.0, 0, 0, -0.02])
    steps = np.linspace(1.0, 0.0, 41)
    forces = [run(gripping(FOUR, np.where(TH_MF, s, FOUR.astype(float))), F_hd) for s in steps]
    jumps = np.abs(np.diff(forces, axis=0)).max()
    # 4 N of squeeze and 2 N of thrust leave in 40 steps; ten times an even step would be a jump
    assert jumps < 10 * 6.0 / 40
    assert np.abs(forces[-1][TH_MF]).max() == pytest.approx(0.0, abs=1e-9)


def test_a_pair_that_presses_too_little_is_made_to_press_more_evenly():
    estimate = estimate_of()
    weak = -2.0 * estimate.n_W * TH_MF[:, None]
    before = run(gripping(TH_MF), np.zeros(6))
    after = run(gripping(TH_MF), np.zeros(6), estimate_of(f_W=weak), ticks=40)
    growth = -((after - before) * estimate.n_W).sum(axis=1)
    assert growth[0] == pytest.approx(growth[2], rel=0.05)
    assert growth[0] > 2.0


def test_readings_that_disagree_do_not_push_the_tool_aside():
    estimate = estimate_of()
    skewed = -estimate.n_W * (TH_MF * np.array([5.0, 0, 3.0, 0, 0]))[:, None]
    f_W = run(gripping(TH_MF), np.zeros(6), estimate_of(f_W=skewed), ticks=400)
    assert np.linalg.norm(f_W.sum(axis=0)) < 1e-9


def test_without_a_grip_nothing_is_asked():
    assert not run(goal_of(), np.ones(6)).any()
