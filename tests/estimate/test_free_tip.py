"""What is believed of a tool whose tip is out of its drive."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.decide.plans import plan_for
from turnscrew.estimate.filter_state import OFFSETS, THETA, TIP, Prior
from turnscrew.estimate.free_tip import FreeTip, seated_angle
from turnscrew.estimate.screw_angle import AngleState
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.robot.model import RobotModel

PLAN, ROBOT = plan_for(0.018), RobotModel()
FREE_TIP = FreeTip(ROBOT.palm)
KNOWN = Prior().state(PLAN.p_WS, PLAN.R_WT, PLAN.rolling(0.0))
NO_REACH = np.zeros((3, 6))
STILL = np.zeros(3), np.zeros(3)


def test_a_lost_tool_is_doubted_and_what_else_is_known_stays() -> None:
    freed = FREE_TIP.freed(KNOWN)
    np.testing.assert_allclose(np.sqrt(np.diag(freed.P)[TIP]), FREE_TIP.tip)
    np.testing.assert_allclose(np.sqrt(np.diag(freed.P)[THETA]), FREE_TIP.lean)
    np.testing.assert_array_equal(freed.P[OFFSETS, OFFSETS], KNOWN.P[OFFSETS, OFFSETS])
    assert not freed.P[TIP, OFFSETS].any()
    np.testing.assert_array_equal(freed.p_WT, KNOWN.p_WT)


def test_a_carried_tool_goes_with_the_hand() -> None:
    way, turn = np.array([0.001, 0.002, -0.001]), np.array([0.0, 0.0, 0.02])
    moved = FREE_TIP.predict(ToolFilter(), KNOWN, (way, turn), NO_REACH, True, False, 0.01)
    np.testing.assert_allclose(moved.p_WT, KNOWN.p_WT + way)
    np.testing.assert_allclose(moved.R_WT @ KNOWN.R_WT.T, [[np.cos(0.02), -np.sin(0.02), 0], [np.sin(0.02), np.cos(0.02), 0], [0, 0, 1]], atol=1e-12)  # fmt: skip  # noqa: E501


def test_a_pushed_tool_is_doubted_more() -> None:
    held, pushed = (
        FREE_TIP.predict(ToolFilter(), KNOWN, STILL, NO_REACH, True, moves, 0.01) for moves in (False, True)
    )
    more = np.diag(pushed.P - held.P)
    np.testing.assert_allclose(more[TIP], (FREE_TIP.moved**2 - 1.0) * FREE_TIP.creep**2 * 0.01, rtol=1e-6)
    np.testing.assert_allclose(more[THETA], (FREE_TIP.moved**2 - 1.0) * FREE_TIP.sway**2 * 0.01, rtol=1e-6)


@pytest.mark.parametrize("half_turns", [-1, 0, 1, 2])
def test_the_blade_tells_the_angle_but_for_half_turns(half_turns: int) -> None:
    # the slot began at .4 rad; the screw is taken to stand at 2 rad, and stands at 2.1
    yaw = 0.4 - 2.1 + half_turns * np.pi
    angle = seated_angle(AngleState(1.0, 0.3, 2.0, 2.0), yaw, 0.4)
    assert angle.theta == pytest.approx(2.1)
