"""Where fingers are put beside the handle."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.messages import estimate_of

from turnscrew.decide.placing import Placing
from turnscrew.decide.plan import ROLLING, SUPPORTING
from turnscrew.decide.plans import plan_for
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel

ROBOT = RobotModel()
PLAN = plan_for(0.018)
STANDOFF = 0.004


def around(q: Array, pair: tuple[str, ...]) -> float:
    """Angle between two fingertips as seen from the upright handle's axis [deg]."""
    tips = ROBOT.fingertips(q)
    one, other = ((tips.p_WF[FINGERS.index(finger)] - PLAN.p_WS)[:2] for finger in pair)
    return float(np.degrees(np.arccos(one @ other / np.linalg.norm(one) / np.linalg.norm(other))))


def placed(q: Array, pair: tuple[str, ...], opposing: float) -> Array:
    upright = estimate_of(q=q, p_WT=PLAN.p_WS, p_WS=PLAN.p_WS, radius=PLAN.radius)
    return Placing(ROBOT, PLAN, opposing=opposing).before_handle(q, pair, upright, STANDOFF)


def test_first_and_ring_finger_are_put_opposite() -> None:
    q = PLAN.adding(1.0)
    lacking = 180.0 - around(q, SUPPORTING)
    assert lacking > 5.0
    # inverse kinematics stops within .1 mm, which is .3 deg at 25 mm
    assert around(placed(q, SUPPORTING, np.radians(5.0)), SUPPORTING) == pytest.approx(180.0, abs=0.5)
    # no farther than allowed
    nearer = around(placed(q, SUPPORTING, np.radians(1.0)), SUPPORTING)
    assert nearer == pytest.approx(180.0 - lacking + 2.0, abs=0.5)


@pytest.mark.parametrize("opposing", [0.0, np.radians(5.0)])
def test_thumb_and_middle_finger_are_put_where_they_are_planned(opposing: float) -> None:
    q = PLAN.returning(1.0)
    assert around(placed(q, ROLLING, opposing), ROLLING) == pytest.approx(around(q, ROLLING), abs=0.5)


def test_without_leave_the_plan_stands() -> None:
    q = PLAN.adding(1.0)
    assert around(placed(q, SUPPORTING, 0.0), SUPPORTING) == pytest.approx(around(q, SUPPORTING), abs=0.5)
