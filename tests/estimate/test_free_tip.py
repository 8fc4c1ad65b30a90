"""What is believed of a tool whose tip is out of its drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.estimation import DT, blur, gait
from rigs.estimation import ROBOT as MEASURED

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.decide.plans import plan_for
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.filter_state import OFFSETS, THETA, TIP, Prior
from turnscrew.estimate.free_tip import HELD, Free, FreeTip, seated_angle
from turnscrew.estimate.screw_angle import AngleState
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.robot.joints import FINGERS, finger_joints
from turnscrew.robot.model import RobotModel

PLAN, ROBOT = plan_for(0.018), RobotModel()
FREE_TIP = FreeTip(ROBOT.palm)
KNOWN = Prior().state(PLAN.p_WS, PLAN.R_WT, PLAN.rolling(0.0))
NO_REACH = np.zeros((3, 6))
STILL = np.zeros(3), np.zeros(3)


def test_a_lost_tool_is_doubted_and_what_else_was_known_stays() -> None:
    # frames of a tool that is elsewhere have been taken to tell of the screw
    misled = replace(KNOWN, b_W=KNOWN.b_W + 0.002, radius_error=0.001, p_WT=KNOWN.p_WT + 0.01)
    freed = FREE_TIP.freed(misled, KNOWN)
    np.testing.assert_allclose(np.sqrt(np.diag(freed.P)[TIP]), FREE_TIP.tip)
    np.testing.assert_allclose(np.sqrt(np.diag(freed.P)[THETA]), FREE_TIP.lean)
    np.testing.assert_array_equal(freed.P[OFFSETS, OFFSETS], KNOWN.P[OFFSETS, OFFSETS])
    assert not freed.P[TIP, OFFSETS].any()
    np.testing.assert_array_equal(freed.b_W, KNOWN.b_W)
    assert freed.radius_error == KNOWN.radius_error
    np.testing.assert_array_equal(freed.p_WT, misled.p_WT)


def test_a_tool_that_is_back_may_be_elsewhere_than_the_camera_had_it() -> None:
    more = np.diag(FREE_TIP.seated(KNOWN).P - KNOWN.P)
    np.testing.assert_allclose(more[TIP], FREE_TIP.back**2, rtol=1e-9)
    np.testing.assert_allclose(more[THETA], FREE_TIP.upright**2, rtol=1e-9)


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


def test_a_finger_that_leaves_does_not_carry_the_tool_away() -> None:
    blurred = blur(gait(1), 0)
    tool = ToolInertia(0.08, np.array([0.0, 0.0, 0.13]), np.diag([1e-4, 1e-4, 1.3e-5]))
    wrench = TipWrench(tool, 0.0005)
    block = ToolEstimator(
        MEASURED.fingertips,
        blurred.handle,
        blurred.p_WS,
        wrench,
        free_tip=FreeTip(MEASURED.palm),
        correction_period=1.0,
    )
    state, still = block.init(blurred.measurements[0], blurred.p_WS, np.eye(3)), np.zeros(28)
    for measurement in blurred.measurements[1:60]:
        state, before = block.update(state, replace(measurement, vision=None), still, DT)
    assert before.touching[0]
    q = measurement.q.copy()
    q[list(finger_joints("TH"))] += 0.02
    last = replace(measurement, q=q, vision=None)
    gone = []
    for holds in (np.ones(5, dtype=bool), np.array([finger != "TH" for finger in FINGERS])):
        away, _ = block.update(state, replace(measurement, vision=None), still, DT, Free(True))
        _, after = block.update(away, last, still, DT, HELD._replace(tip=True, holds=holds))
        gone.append(float(np.linalg.norm(after.p_WT - before.p_WT)))
    assert gone[0] > 1e-3
    assert gone[1] < 0.3 * gone[0]
