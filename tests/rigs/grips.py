"""The plan's tool as the estimate of a loop at rest, with contacts at the closest points of all five fingertips."""

from __future__ import annotations

import numpy as np
from rigs.messages import estimate_of

from turnscrew.decide.plans import plan_for
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import closest_points
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate

PLAN = plan_for(0.018)


def planned(q: Array, **changes: object) -> Estimate:
    """The estimate with the robot at joint angles q (28,)."""
    robot = RobotModel()
    tips, handle = robot.fingertips(q), Cylinder(0.018, 0.075, 0.175)
    points = [
        closest_points(handle, Capsule(tips.rho[i], tips.length[i]), PLAN.p_WS, np.eye(3), tips.p_WF[i], tips.R_WF[i])
        for i in range(5)
    ]
    c_W, n_W = np.array([p.c_W for p in points]), np.array([p.n_W for p in points])
    return estimate_of(**{"q": q, "p_WT": PLAN.p_WS, "c_W": c_W, "n_W": n_W, **changes})


PINCHED = planned(PLAN.rolling(0.3))
"""Thumb and middle finger on the handle, three tenths of the stroke done."""

FOUR_HELD = planned(PLAN.adding(1.0))
"""The stroke is done, and first and ring finger have joined."""
