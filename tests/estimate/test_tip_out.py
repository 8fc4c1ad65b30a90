"""A tip that has left its drive: seen in a few frames, and never in frames that only err."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.estimate.filter_state import THETA, TIP, FilterState, Prior
from turnscrew.estimate.tip_out import OutState, TipOut
from turnscrew.estimate.trail import Pose, Seen
from turnscrew.geometry.rotations import exp_so3

OUT = TipOut()
SIGMA = np.array([0.004] * 3 + [np.radians(2.5)] * 3)
"""Of the trials' camera, in the middle of its range."""

P = np.diag(SIGMA**2)


FRAME = 1.0 / 30.0
"""Time between frames [s]."""


def believed() -> FilterState:
    """A leaning, turned tool, known to .3 mm and .3 deg as in a run."""
    state = Prior(rotation=np.radians(0.3), tip=0.0003).state(
        np.array([0.9, 0.0, 0.2]), exp_so3(np.array([0.02, -0.01, 1.3])), np.zeros(28)
    )
    assert state.P[TIP, TIP][0, 0] == pytest.approx(0.0003**2)
    assert state.P[THETA, THETA][0, 0] == pytest.approx(np.radians(0.3) ** 2)
    return state


F = believed()


def frame(error: np.ndarray) -> Seen:
    """A frame that is wrong by an error (6,) of tip [m] and orientation [rad]."""
    return Seen(Pose(F.p_WT + error[:3], exp_so3(error[3:]) @ F.R_WT), P)


def frames_until_found(
    away: np.ndarray, rng: np.random.Generator, *, unloaded: bool = False, slipped: bool = False
) -> int:
    """How many frames of a tool displaced by `away` (6,) it takes, after two thirds of a second in the drive."""
    state = OutState(age=4.0)
    for _ in range(OUT.frames):
        state = OUT.seen(state, F, frame(SIGMA * rng.standard_normal(6)), 0.0)
    if slipped:
        state = OUT.felt(state, 5.0, 1.5, FRAME)
    for count in range(1, 200):
        if unloaded:
            state = OUT.felt(state, -3.0, 0.0, FRAME)
        state = OUT.seen(state, F, frame(away + SIGMA * rng.standard_normal(6)), 0.0)
        if OUT.signal(state) >= 1.0:
            return count
    return 200


def test_frames_that_only_err_raise_no_alarm() -> None:
    rng = np.random.default_rng(1)
    state, largest = OUT.init(), 0.0
    # five minutes; an alarm in them has a probability of 5e-3
    for _ in range(9000):
        state = OUT.seen(state, F, frame(SIGMA * rng.standard_normal(6)), 0.0)
        largest = max(largest, OUT.signal(state))
    assert largest < 1.0
    # the sums do come near it: the test is not deaf
    assert largest > 0.4


@pytest.mark.parametrize(("unloaded", "most"), [(False, 22), (True, 8)])
def test_a_tip_beside_the_screw_is_found_in_some_frames(unloaded: bool, most: int) -> None:
    # 6 mm aside, and the lean of 2.75 deg that goes with it when the handle stays where it is: with r of .03, n frames
    # make (5 + n ((6 / 4)^2 + (2.75 / 2.5)^2)) / (1 + .03 n), so 40 takes some 15 of them and 18 some 5
    away = np.array([0.006, 0.0, 0.0, 0.0, np.radians(-2.75), 0.0])
    rng = np.random.default_rng(2)
    counts = [frames_until_found(away, rng, unloaded=unloaded) for _ in range(40)]
    assert np.median(counts) < most


def test_flipped_frames_do_not_count() -> None:
    flip = frame(np.array([0.02, 0.0, 0.01, 0.0, np.radians(30.0), 0.0]))
    known = OUT.init()
    assert OUT.seen(known, F, flip, 0.0) is known


def test_two_frames_that_are_far_off_are_not_enough() -> None:
    far = frame(np.array([0.04, 0.0, 0.01, 0.0, np.radians(-10.0), 0.0]))
    state = OUT.seen(OUT.seen(OUT.init(), F, far, 0.0), F, far, 0.0)
    assert OUT.signal(state) < 1.0
    assert OUT.signal(OUT.seen(state, F, far, 0.0)) >= 1.0


def test_a_camera_without_noise_raises_no_alarm() -> None:
    # .3 mm beside a filter that is sure to .3 mm, in all frames
    state, sharp = OUT.init(), Seen(Pose(F.p_WT + np.array([3e-4, 0.0, 0.0]), F.R_WT), np.zeros((6, 6)))
    for _ in range(OUT.frames):
        state = OUT.seen(state, F, sharp, 0.0)
    assert OUT.signal(state) < 0.1


def test_an_error_that_neighbours_share_is_no_loss() -> None:
    # two sigmas, the same in all frames: .9 of the variance is told to be shared
    state, steady = OUT.init(), frame(2.0 * SIGMA * np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(OUT.frames):
        state = OUT.seen(state, F, steady, 0.9)
    assert OUT.signal(state) < 0.2
    apart = OUT.init()
    for _ in range(OUT.frames):
        apart = OUT.seen(apart, F, steady, 0.0)
    assert OUT.signal(apart) > 1.0


def test_the_force_alone_is_no_alarm_and_is_not_asked_before_the_grip_is_built_up() -> None:
    state = OUT.felt(OutState(age=5.0), -10.0, 0.0, 0.01)
    assert state.unloaded == 0.0
    assert OUT.signal(state) == 0.0
    # at the start, and when the tip is back
    early, dt = OUT.init(), 0.01
    while early.unloaded == np.inf:
        early = OUT.felt(early, -10.0, 0.0, dt)
    assert early.age == pytest.approx(OUT.begun, abs=1.5 * dt)
    later = OUT.felt(OutState(unloaded=0.0), 5.0, 0.0, 0.5)
    assert later.unloaded == 0.5


def test_a_tip_that_slipped_onto_the_head_is_found_by_all_frames_since() -> None:
    # 4 mm aside and 1.3 mm up: n ((4 / 4)^2 + (1.3 / 4)^2) / (1 + .03 n) comes to 36 at most, and to 18 after some 30
    away = np.array([0.004, 0.0, 0.0013, 0.0, 0.0, 0.0])
    rng = np.random.default_rng(3)
    assert np.median([frames_until_found(away, rng) for _ in range(20)]) > 100
    assert np.median([frames_until_found(away, rng, slipped=True) for _ in range(20)]) < 45


def test_a_slip_that_was_none_seldom_looks_like_a_loss() -> None:
    rng, found = np.random.default_rng(4), 0
    for _ in range(100):
        state = OUT.felt(OutState(age=4.0), 5.0, 1.0, FRAME)
        while state.slipped < OUT.remembered:
            state = OUT.felt(OUT.seen(state, F, frame(SIGMA * rng.standard_normal(6)), 0.0), 5.0, 0.0, FRAME)
            if OUT.signal(state) >= 1.0:
                found += 1
                break
    # one look exceeds it in 3e-3, and sums of up to 150 frames are as good as ln 150 = 5 independent looks
    assert found <= 100 * 5 * 3e-3 + 2 * np.sqrt(100 * 5 * 3e-3)


def test_a_slip_under_way_is_not_begun_anew_and_is_forgotten_in_time() -> None:
    slipped = OUT.felt(OutState(age=4.0), 5.0, 1.0, FRAME)
    later = OUT.felt(OUT.seen(slipped, F, frame(SIGMA), 0.0), 5.0, 1.0, FRAME)
    assert (later.count, later.slipped) == (1, FRAME)
    anew = OUT.felt(OUT.seen(slipped, F, frame(SIGMA), 0.0), 5.0, 1.0, OUT.remembered)
    assert (anew.count, anew.slipped) == (0, 0.0)


@pytest.mark.parametrize(
    ("state", "sure"),
    [
        (OutState(load=5.0), True),
        # in undisturbed runs the load stays above half of what is asked
        (OutState(load=0.5), False),
        (OutState(load=5.0, slipped=1.0), False),
        (OutState(load=5.0, slipped=OUT.remembered), True),
        (OutState(load=5.0, largest=0.2 * OUT.threshold), True),
        (OutState(load=5.0, largest=0.4 * OUT.threshold), False),
    ],
)
def test_who_is_sure_of_a_tip_in_its_drive(state: OutState, sure: bool) -> None:
    assert OUT.sure(state) == sure
