"""A finger that slides is told from one that is read wrong, and from the one beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from turnscrew.estimate.finger_slip import FingerSlip, FingerSlipState
from turnscrew.estimate.tip_motion import astray
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.model import Fingertips

DT = 0.01
BLOCK = FingerSlip()
PINCH = np.array([4.0, 0.0, 4.0, 0.0, 0.0])
TH, MF = 0, 2
SHARP, SHAKY = 5e-5, 5e-4
"""How well the hand's place is known [m]: arms whose readings are smoothed for long, or hardly."""


def run(
    moves: np.ndarray, hand: float = SHARP, level: np.ndarray = PINCH, rolled: float = 0.0, block: FingerSlip = BLOCK
) -> list[FingerSlipState]:
    """States of a while, after a grip of .3 s at rest; moves (n, 5), and how far the handle rolls in a tick [m]."""
    state, states = block.init(), []
    for moved in (*np.zeros((30, 5)), *moves):
        state = block.update(state, moved, level, hand, rolled, DT)
        states.append(state)
    return states[30:]


def sliding(finger: int, way: float, ticks: int, rest: int = 0) -> np.ndarray:
    """One finger goes down by `way` in so many ticks, then rests."""
    moves = np.zeros((ticks + rest, 5))
    moves[:ticks, finger] = -way / ticks
    return moves


@pytest.mark.parametrize("hand", [SHARP, SHAKY])
@pytest.mark.parametrize("finger", [TH, MF])
def test_a_slide_is_found_at_the_finger_that_slides(finger: int, hand: float) -> None:
    slid = run(sliding(finger, 0.001, 5), hand)[-1].slid
    # 50 ms of memory's 150 are gone, which leaves .85 of a millimetre; a hand that may have moved takes its part of it
    assert 0.0007 < slid[finger] < 0.001
    assert np.delete(slid, finger).max() < BLOCK.threshold


def test_fingers_that_roll_around_an_axis_believed_askew_do_not_slide() -> None:
    wary, fast, askew = replace(BLOCK, askew=0.02), 0.018 * 4.5 * DT, np.zeros(5)
    # opposite fingers roll opposite ways around the handle: one seems to climb where the other seems to slide
    askew[[TH, MF]] = np.radians([-2.0, 2.0]) * fast
    moves = np.tile(askew, (20, 1))
    assert max(state.slid[TH] for state in run(moves, rolled=fast)) > BLOCK.threshold
    assert max(state.slid[TH] for state in run(moves, rolled=fast, block=wary)) < BLOCK.threshold
    # a millimetre that one slides is found all the same, and at rest nothing is forgiven
    slide = sliding(TH, 0.001, 3)
    assert run(slide, rolled=fast, block=wary)[-1].slid[TH] > BLOCK.threshold
    np.testing.assert_array_equal(run(slide, block=wary)[-1].slid, run(slide)[-1].slid)


@pytest.mark.parametrize("hand", [SHARP, SHAKY])
def test_encoder_noise_alone_raises_no_alarm(hand: float) -> None:
    rng = np.random.default_rng(3)
    # positions, not ways, are noisy: .04 mm, and half of what is read now is still there in the next tick
    noise = np.zeros((6000, 5))
    for i in range(1, 6000):
        noise[i] = 0.5 * noise[i - 1] + rng.normal(0.0, 0.87 * 4e-5, 5)
    states = run(np.diff(noise, axis=0), hand)
    assert max(state.slid.max() for state in states) < BLOCK.threshold


def test_a_hand_that_is_read_wrong_is_no_slide() -> None:
    sway = 6e-4 * np.sin(np.linspace(0.0, 20.0, 300))
    states = run(np.tile(np.diff(sway)[:, None], (1, 5)), SHAKY)
    # what the ridge leaves of .6 mm: (noise / hand)^2 = 1 %
    assert max(state.slid.max() for state in states) < 0.02 * 6e-4


def test_a_finger_that_creeps_or_goes_up_does_not_slide() -> None:
    creep = run(sliding(TH, 0.001, 100))
    # 1 mm/s for longer than the memory: .15 mm
    assert max(state.slid.max() for state in creep) < 1.05 * 0.001 * BLOCK.memory
    assert run(-sliding(TH, 0.001, 5))[-1].slid[TH] == 0.0


def test_a_finger_that_has_just_touched_or_lets_go_is_not_looked_at() -> None:
    state = BLOCK.init()
    for _ in range(5):
        state = BLOCK.update(state, sliding(TH, 0.005, 5)[0], PINCH, SHARP, 0.0, DT)
    assert state.slid.max() == 0.0
    assert run(sliding(TH, 0.005, 5), level=0.3 * PINCH)[-1].slid.max() == 0.0


def test_one_finger_alone_tells_nothing() -> None:
    assert run(sliding(TH, 0.005, 5), level=PINCH * [1, 0, 0, 0, 0])[-1].slid.max() == 0.0


def test_trust_falls_with_the_way_and_is_regained_slowly() -> None:
    short = run(sliding(TH, 0.0006, 5, rest=100))
    long = run(sliding(TH, 0.0012, 5, rest=100))
    assert short[5].grip[TH] == pytest.approx(BLOCK.lowered, rel=0.02)
    # two thresholds: twice
    assert long[5].grip[TH] == pytest.approx(BLOCK.lowered**2, rel=0.02)
    assert long[5].grip[MF] == 1.0
    # a second later a tenth of what was lost has come back
    gained = (short[-1].grip[TH] - short[5].grip[TH]) / (1.0 - BLOCK.lowered)
    assert gained == pytest.approx(1.0 - np.exp(-1.0 / BLOCK.regain), rel=0.05)
    assert run(sliding(TH, 0.02, 20))[-1].grip[TH] == BLOCK.least


def test_a_finger_that_is_not_to_be_trusted_less_keeps_all() -> None:
    state, deaf = BLOCK.init(), replace(BLOCK, lowered=1.0)
    for moved in (*np.zeros((30, 5)), *sliding(TH, 0.002, 5)):
        state = deaf.update(state, moved, PINCH, SHARP, 0.0, DT)
    assert state.slid[TH] > BLOCK.threshold
    assert (state.grip == 1.0).all()


@pytest.mark.parametrize("ticks", [1, 3])
def test_a_handle_that_turns_back_is_seen_and_all_its_fingers_are_doubted(ticks: int) -> None:
    state = run(np.zeros((1, 5)))[-1]
    for _ in range(ticks):
        assert state.slid.max() == 0.0
        # a camera of 2 deg: five of its deviations at once, or three of them three times
        state = BLOCK.seen(state, np.radians({1: 12.0, 3: 7.3}[ticks]), np.radians(2.0) ** 2, 0.018)
    assert state.slid[TH] == state.slid[MF] > 0.002
    assert state.slid[1] == 0.0
    state = BLOCK.update(state, np.zeros(5), PINCH, SHARP, 0.0, DT)
    assert state.grip[TH] == state.grip[MF] == BLOCK.least
    for _ in range(100):
        state = BLOCK.update(state, np.zeros(5), PINCH, SHARP, 0.0, DT)
    # what was seen is forgotten like any other way
    assert state.slid.max() < 1e-5


def test_a_camera_that_errs_or_a_handle_that_creeps_raises_no_alarm() -> None:
    rng, state = np.random.default_rng(5), run(np.zeros((1, 5)))[-1]
    for error in rng.normal(0.0, np.radians(2.0), 18000):
        # ten minutes of frames
        state = BLOCK.seen(state, error, np.radians(2.0) ** 2, 0.018)
        assert state.around == 0.0
    for _ in range(300):
        # a sharp camera that sees .3 mm at the handle's surface
        state = BLOCK.seen(state, 0.0003 / 0.018, np.radians(0.1) ** 2, 0.018)
    assert state.around == 0.0


def tips(p: np.ndarray, R: np.ndarray) -> Fingertips:
    return Fingertips(p, np.tile(R, (5, 1, 1)), np.zeros((5, 6, 28)), np.full(5, 0.007), np.zeros(5))


def test_fingertips_that_go_with_the_tool_do_not_stray() -> None:
    rng = np.random.default_rng(0)
    axis = exp_so3(np.array([0.02, -0.01, 0.0])) @ [0.0, 0.0, 1.0]
    p_WT, c_W = np.array([0.5, 0.1, 0.2]), np.array([0.5, 0.1, 0.33]) + rng.normal(0.0, 0.015, (5, 3))
    p_WF = c_W + rng.normal(0.0, 0.007, (5, 3))
    dtheta, dp = np.array([1e-3, -2e-3, -8e-3]), 1e-4 * axis
    turn = exp_so3(dtheta)
    carried = p_WT + dp + (p_WF - p_WT) @ turn.T
    moved = astray(tips(p_WF, np.eye(3)), tips(carried, turn), c_W, p_WT, dtheta, dp)
    # to first order in the rotation: its square times the lever is .01 mm
    assert np.abs(moved).max() < 2e-5
    lower = astray(tips(p_WF, np.eye(3)), tips(carried - 1e-3 * axis, turn), c_W, p_WT, dtheta, dp)
    np.testing.assert_allclose(lower - moved, np.tile(-1e-3 * axis, (5, 1)), atol=1e-12)


def test_a_finger_that_comes_to_the_handle_is_trusted_no_more_than_those_that_hold_it() -> None:
    moves = sliding(MF, 0.0005, 5, rest=20)
    state = run(moves)[-1]
    assert state.grip[MF] < 0.65
    # thumb has held and not slid; the others have not been asked
    assert state.grip[TH] == 1.0
    np.testing.assert_array_equal(state.grip[[1, 3, 4]], state.grip[MF])
    pressing = np.array([4.0, 4.0, 4.0, 4.0, 0.0])
    landed = BLOCK.update(state, np.zeros(5), pressing, SHARP, 0.0, DT)
    # what was learned goes on being forgotten at the same pace
    np.testing.assert_allclose(landed.grip[[1, 3]], landed.grip[MF], rtol=1e-12)


def test_friction_that_gave_way_is_not_trusted_again() -> None:
    learning = replace(BLOCK, again=0.8)
    state, slid_at = learning.init(), np.nan
    for moved in (*np.zeros((30, 5)), *sliding(TH, 0.0006, 5), *np.zeros((6000, 5))):
        before, state = state.grip, learning.update(state, moved, PINCH, SHARP, 0.0, DT)
        if state.grip[TH] < before[TH] - 0.1:
            slid_at = before[TH]
    # a minute, six times what regaining takes: .3 % are missing
    assert state.grip == pytest.approx(np.full(5, 0.8 * slid_at), rel=0.01)
