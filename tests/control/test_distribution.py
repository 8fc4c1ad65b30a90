"""Sharing the wrench: (15), (16), and the squeeze."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.messages import estimate_of, goal_of

from turnscrew.contact.friction import cone_margin, in_cone
from turnscrew.contact.grasp import grasp_matrix
from turnscrew.control.distribution import Distribution
from turnscrew.signals import Role

TH_MF = np.array([True, False, True, False, False])
FOUR = np.array([True, True, True, True, False])
DT = 0.005


def gripping(who, share=None, squeeze=4.0):
    share = who.astype(float) if share is None else share
    return goal_of(roles=np.where(who, Role.GRIP, Role.FREE), share=share, squeeze=share * squeeze)


def shared(goal, F_hd, estimate=None, ticks=1, block=None):
    block, estimate = block or Distribution(), estimate or estimate_of()
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
    # friction is counted with .6; the last digits are rounding
    assert in_cone(f_W[TH_MF], estimate.n_W[TH_MF], 0.6 + 1e-9).all()
    wrench = grasp_matrix(estimate.c_W, np.zeros(3)) @ f_W.ravel()
    assert wrench[2] == pytest.approx(thrust, abs=0.05)
    assert wrench[5] == pytest.approx(torque, abs=0.005)


@pytest.mark.parametrize("first", [0, 1, 2, 3])
def test_a_finger_that_has_just_touched_does_not_loosen_the_others(first):
    """Alone, without its partner, no squeeze brings it into its cone."""
    F_hd, normals = np.array([0, 0, -4.0, 0, 0, -0.1]), estimate_of().n_W
    pair = np.isin(np.arange(5), (1, 3) if first in (0, 2) else (0, 2))
    before, after = (
        -(run(gripping(share > 0, share), F_hd) * normals).sum(axis=1)[pair]
        for share in (pair.astype(float), pair + 0.1 * (np.arange(5) == first))
    )
    # it takes a tenth of the load, which the squeeze follows; counted like the others it would leave half of it
    assert (after > 0.8 * before).all()


def test_fixed_squeeze_does_not_follow_the_load():
    loads = [np.array([0, 0, -4.0, 0, 0, torque]) for torque in (0.0, -0.1)]
    estimate = estimate_of()
    for fixed in (5.0, 9.0):
        found = [shared(gripping(TH_MF), F_hd, block=Distribution(rate=0.0, fixed=fixed)).f_W for F_hd in loads]
        pressed = -(np.array(found) * estimate.n_W).sum(axis=2)[:, TH_MF].mean(axis=1)
        # contacts 10 deg off the line that joins them lose 1 - cos(10 deg)^2 = 3 % of a squeeze
        assert pressed == pytest.approx([fixed, fixed], rel=0.03)


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


def test_a_pair_presses_as_its_less_trusted_finger_needs():
    F_hd = np.array([0.0, 0.0, -2.0, 0.0, 0.0, -0.01])
    doubted = estimate_of(grip=np.array([1.0, 0.1, 0.8, 1.0, 1.0]))

    def squeezes(estimate):
        return -(run(gripping(TH_MF), F_hd, estimate) * estimate.n_W).sum(axis=1)[TH_MF]

    # MF's trust counts, FF's does not: it does not hold
    inside = squeezes(doubted) - squeezes(estimate_of())
    np.testing.assert_allclose(inside, (1.0 / 0.8 - 1.0) * 4.0, rtol=0.05)


@pytest.mark.parametrize("thrust", [-4.0, -5.0])
def test_fingers_that_are_not_opposed_press_until_they_are_in_their_cones(thrust):
    # 15 deg from opposition: pressing pushes the handle aside, and friction has to hold that, too
    aside = np.radians(15.0)
    n_W = estimate_of().n_W.copy()
    n_W[2] = [np.cos(aside), np.sin(aside), 0.0]
    bent = estimate_of(n_W=n_W, c_W=0.018 * n_W + [0, 0, 0.15])
    f_W = run(gripping(TH_MF), np.array([0, 0, thrust, 0, 0, -0.04]), bent)
    # one step of a nearly linear rule: a twentieth of a newton remains
    assert (cone_margin(f_W, n_W, Distribution().friction)[TH_MF] > -0.05).all()


def test_squeeze_rises_with_the_load_at_once_and_falls_slowly():
    block, goal, estimate = Distribution(rate=0.0), gripping(TH_MF), estimate_of()
    light, heavy = (np.array([0, 0, -4.0, 0, 0, torque]) for torque in (0.0, -0.06))
    state, pressing, factors = block.init(), [], []
    for F_hd in [light, heavy, *[light] * round(block.ease / DT)]:
        state, wanted = block.update(state, goal, estimate, F_hd, DT)
        pressing.append(-float(wanted.f_W[0] @ estimate.n_W[0]))
        factors.append(state.factor)
    assert factors[0] == 1.0
    assert pressing[1] > 1.2 * pressing[0]
    # what was added is 1/e of itself after the time constant
    assert factors[-1] - 1.0 == pytest.approx((factors[1] - 1.0) * np.exp(-1.0), rel=1e-9)
    assert (np.diff(pressing[2:]) < 0.0).all()
    assert pressing[-1] > pressing[0]
