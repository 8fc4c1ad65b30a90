from __future__ import annotations

import numpy as np

from turnscrew.estimate.screw_angle import AngleState, ScrewAngle

DT = 0.01


def follow(angle: ScrewAngle, state: AngleState, turn: float, steps: int = 200) -> AngleState:
    """Turn the tool by `turn` in the fastening sense, seen by odometry and filter alike."""
    yaw = state.yaw
    for _ in range(steps):
        yaw = (yaw - turn / steps + np.pi) % (2 * np.pi) - np.pi
        state = angle.update(state, yaw, -turn / steps, DT)
    return state


def test_screw_follows_behind_half_the_play_over_several_turns() -> None:
    angle = ScrewAngle(play=0.1)
    state = follow(angle, angle.init(3.0), 15.0)
    # sums of 200 steps; rounding only
    np.testing.assert_allclose((state.turned, state.theta), (15.0, 14.95), atol=1e-9)


def test_screw_stays_while_the_tool_turns_back_within_the_play() -> None:
    angle = ScrewAngle(play=0.1)
    ahead = follow(angle, angle.init(0.0), 1.0)
    back = follow(angle, ahead, -0.09)
    np.testing.assert_allclose(back.theta, ahead.theta, atol=1e-9)
    further = follow(angle, back, -0.11)
    np.testing.assert_allclose(further.theta, 0.85, atol=1e-9)


def test_filter_settling_at_rest_is_no_turning() -> None:
    angle = ScrewAngle(settle=1.0)
    state = angle.init(0.05)
    for tick in range(100):
        state = angle.update(state, 0.05 * (1.0 - tick / 99), 0.0, DT)
    assert state.theta == 0.0
    assert state.turned == 0.0
    state = follow(angle, state, 0.5)
    np.testing.assert_allclose(state.turned, 0.5, atol=1e-9)
