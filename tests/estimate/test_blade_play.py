"""The blade's play: which jerks it explains."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.estimate.blade_play import BladePlay, PlayState
from turnscrew.estimate.second_look import SecondLook
from turnscrew.estimate.slip_steps import axial_torque

DT, RADIUS = 0.01, 0.018
ANGLES = np.radians([180.0, 90.0, 0.0, -90.0, 45.0])
N_W = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(5)])
AROUND = np.column_stack([-np.sin(ANGLES), np.cos(ANGLES), np.zeros(5)])
ARM, AXIS = RADIUS * N_W + [0.0, 0.0, 0.125], np.array([0.0, 0.0, 1.0])
BLOCK = BladePlay()


def after(*parts: tuple[int, float, float, float]) -> PlayState:
    """State after stretches of (ticks, torque [N.m], squeeze of thumb and middle finger [N], turn a tick [rad])."""
    state, held = BLOCK.init(), np.array([1.0, 0.0, 1.0, 0.0, 0.0])
    for ticks, torque, squeeze, turned in parts:
        f_W = held[:, None] * (torque / (2.0 * RADIUS) * AROUND - squeeze * N_W)
        for _ in range(ticks):
            state = BLOCK.update(state, f_W, ARM, AXIS, turned, DT)
    return state


def test_torque_about_a_leaning_axis() -> None:
    rng = np.random.default_rng(3)
    f_W, arm = rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    axis = np.array([0.6, 0.0, 0.8])
    torque, moment = axial_torque(f_W, arm, axis)
    assert torque == pytest.approx(float(np.cross(arm, f_W).sum(axis=0) @ axis))
    across = np.linalg.norm(arm - np.outer(arm @ axis, axis), axis=1)
    np.testing.assert_allclose(moment, f_W * across[:, None])


def test_another_torque_than_before_is_a_wall() -> None:
    assert BLOCK.crossed(after((30, -0.002, 5.0, 0.0), (5, -0.03, 5.0, 0.0)), DT)
    # as much as a slip changes it by
    assert not BLOCK.crossed(after((30, -0.030, 5.0, 0.0), (5, -0.035, 5.0, 0.0)), DT)


def test_what_one_tick_reads_is_no_torque() -> None:
    assert not BLOCK.crossed(after((30, -0.03, 5.0, 0.0), (2, 0.0, 5.0, 0.0), (3, -0.03, 5.0, 0.0)), DT)


def test_squeezes_that_change_excuse_a_torque_that_does() -> None:
    # 5 N more on two fingers, read wrong across by a sixth: two standard deviations are 40 mN.m
    assert not BLOCK.crossed(after((30, -0.03, 5.0, 0.0), (5, -0.06, 10.0, 0.0)), DT)


def test_a_tool_that_springs_back_crosses_its_play_unless_the_torque_goes_with_it() -> None:
    turn = 0.05 * BLOCK.play
    # the torque has eased longer ago than it is compared with now
    assert BLOCK.crossed(after((15, -0.03, 5.0, 0.0), (25, -0.015, 5.0, turn)), DT)
    assert not BLOCK.crossed(after((15, -0.03, 5.0, 0.0), (25, -0.015, 5.0, -turn)), DT)
    # a thread like a spring turns back with it
    assert not BLOCK.crossed(after((15, -0.03, 5.0, 0.0), (25, -0.029, 5.0, turn)), DT)


def look(ticks: int, *, crossed: bool) -> list[float]:
    """What counts of a jerk worth 20 in the first of these ticks, less by a tenth in each further."""
    block = SecondLook(BLOCK)
    state = block.init()
    state = type(state)(after((30, -0.002, 5.0, 0.0), (5, -0.03 if crossed else -0.002, 5.0, 0.0)))
    found = []
    for tick in range(ticks):
        state, evidence = block.judged(state, 20.0 * 0.9**tick, 0.0, 0.0, 10.0, DT)
        found.append(evidence)
    return found


def test_a_jerk_is_in_doubt_and_then_counts_with_its_peak() -> None:
    found = look(8, crossed=False)
    assert found[:5] == [0.0] * 5
    # then as it is, while it is enough
    assert found[5:] == pytest.approx([20.0, 20.0 * 0.9**6, 20.0 * 0.9**7])
    assert max(look(8, crossed=True)) == 0.0


def test_camera_and_motion_need_no_second_look() -> None:
    block = SecondLook(BLOCK)
    _, evidence = block.judged(block.init(), 0.0, 6.0, 5.0, 10.0, DT)
    assert evidence == 11.0
    # beside a jerk in doubt they count alone
    _, evidence = block.judged(block.init(), 20.0, 6.0, 5.0, 10.0, DT)
    assert evidence == 11.0
