"""A carried tool goes with palm and fingertips: closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from turnscrew.contact.carried import LEVER, PalmPose, carried
from turnscrew.decide.plans import plan_for
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.robot.model import Fingertips, RobotModel

PLAN = plan_for(0.018)
ROBOT = RobotModel()
TIPS = ROBOT.fingertips(PLAN.rolling(0.0))
PALM = PalmPose(np.array([0.1, -0.2, 0.4]), exp_so3(np.array([0.3, -0.2, 0.9])))
TIP = np.array([0.0, 0.0, 0.1])
TWO = np.array([1.0, 0.0, 1.0, 0.0, 0.0])
R, STRAIGHT = 0.018, np.eye(3)
c_W = np.tile(TIP + np.array([0.0, 0.0, 0.125]), (5, 1))
c_W[0] += [R, 0.0, 0.0]
c_W[2] -= [R, 0.0, 0.0]


def along(tips: Fingertips, way: np.ndarray, turn: np.ndarray = STRAIGHT) -> Fingertips:
    """Fingertips that have gone along with a body: turned about the palm's origin, then shifted."""
    p = PALM.p_WH + (tips.p_WF - PALM.p_WH) @ turn.T + way
    return replace(tips, p_WF=p, R_WF=turn @ tips.R_WF)


def test_without_fingers_a_tool_goes_with_the_palm() -> None:
    turn, way = exp_so3(np.array([0.01, -0.02, 0.03])), np.array([0.002, 0.001, -0.003])
    now = PalmPose(PALM.p_WH + way, turn @ PALM.R_WH)
    dp, dtheta = carried((PALM, now), (TIPS, TIPS), c_W, np.zeros(5), TIP)
    np.testing.assert_allclose(dp, PALM.p_WH + way + turn @ (TIP - PALM.p_WH) - TIP, atol=1e-15)
    np.testing.assert_allclose(exp_so3(dtheta), turn, atol=1e-12)


def test_a_rigid_hand_carries_rigidly() -> None:
    turn, way = exp_so3(np.array([0.01, -0.02, 0.03])), np.array([0.002, 0.001, -0.003])
    now = PalmPose(PALM.p_WH + way, turn @ PALM.R_WH)
    dp, dtheta = carried((PALM, now), (TIPS, along(TIPS, way, turn)), c_W, TWO, TIP)
    np.testing.assert_allclose(dp, PALM.p_WH + way + turn @ (TIP - PALM.p_WH) - TIP, atol=1e-12)
    np.testing.assert_allclose(dtheta, log_so3(turn), atol=1e-10)


def test_fingers_that_move_alike_shift_the_tool() -> None:
    way = np.array([0.0003, -0.0002, 0.0001])
    dp, dtheta = carried((PALM, PALM), (TIPS, along(TIPS, way)), c_W, TWO, TIP)
    np.testing.assert_allclose(dp, way, atol=1e-15)
    np.testing.assert_allclose(dtheta, 0.0, atol=1e-12)


def test_fingers_that_move_oppositely_turn_the_tool() -> None:
    p = TIPS.p_WF.copy()
    p[0] += [0.0, 1e-4, 0.0]
    p[2] -= [0.0, 1e-4, 0.0]
    dp, dtheta = carried((PALM, PALM), (TIPS, replace(TIPS, p_WF=p)), c_W, TWO, TIP)
    # the doubt takes its share off what two contacts at a distance of R from their middle see
    assert dtheta[2] == pytest.approx(1e-4 / R * R**2 / (R**2 + LEVER**2), rel=1e-6)
    np.testing.assert_allclose(dtheta[:2], 0.0, atol=1e-12)
    np.testing.assert_allclose(dp, 0.0, atol=1e-9)


def test_what_no_finger_sees_turn_turns_with_the_palm() -> None:
    turn = exp_so3(np.array([0.02, 0.0, 0.0]))
    # the palm turns about the line that joins the contacts, and the fingers stay where they are
    middle = c_W[[0, 2]].mean(axis=0)
    now = PalmPose(middle + turn @ (PALM.p_WH - middle), turn @ PALM.R_WH)
    _, dtheta = carried((PALM, now), (TIPS, TIPS), c_W, TWO, TIP)
    np.testing.assert_allclose(dtheta, [0.02, 0.0, 0.0], atol=1e-10)
