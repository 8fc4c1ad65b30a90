"""How a run begins: the tool stands in the screw's drive, thumb and middle finger have it (the paper's assumptions).

Two things begin here that must not be mixed up.  *What is true*: somebody has put the tool into the hand and, arm and
hand yielding, led both to the screw, so the hand is around the tool as planned wherever that really stands.  Screw,
tool and joints are drawn together, for the plant alone.  *What the robot believes*: the screw is where it was told
(`GaitPlan.p_WS`), the tool upright, the handle as thick as it was told.  None of the true values reaches the loop but
through its sensors: the encoders read the joints as they are, with their errors, and the camera sees the tool.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.decide.placing import carried_palm
from turnscrew.decide.plan import ROLLING, Course, GaitPlan
from turnscrew.decide.plans import plan_for
from turnscrew.errors import PlanError
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.inverse_kinematics import place_fingertip, place_palm
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel
from turnscrew.task.scenario_keys import Scenario

TIP_LIFT = 1e-4
"""Height of the tip above the slot's floor [m]: a tilted blade's corner must not begin inside the floor."""

ARM_MARGIN = 0.01
"""Least distance of arm and wrist from their limits [rad]: twice what commands keep, so that they can hold there."""

NEAR_ENOUGH = 3e-4
"""How far a finger may be from where it should touch [m]: its servo bends by ten times that under its squeeze."""


@dataclass(frozen=True)
class Start:
    """True state of the cell at time 0.

    Attributes:
        q: (28,) joint angles [rad].
        p_WS: (3,) the drive's bottom centre in W [m].
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        believed_radius: Handle radius that the robot is told [m].
    """

    q: Array
    p_WS: Array
    p_WT: Array
    R_WT: Array
    believed_radius: float


def plan_of(scenario: Scenario, on_planning: Callable[[str], None] | None = None) -> GaitPlan:
    """The gait plan of a scenario's tool.

    Args:
        scenario: With the tool.
        on_planning: Told in a line what the planner is doing, if there is anything to plan.

    Raises:
        PlanError: no plan fits the handle.
    """
    tool = scenario.tool
    return plan_for(
        tool.handle.radius,
        length=tool.handle.length,
        middle=tool.contact_height,
        shaft_radius=tool.shaft_radius,
        course=Course.STROKE if scenario.goal.course == "stroke" else Course.ROUND,
        progress=on_planning,
    )


def draw_start(scenario: Scenario, plan: GaitPlan, robot: RobotModel, rng: Generator) -> Start:
    """Draws calibration error, start tilt and offset, and puts the hand around the tool where that really is.

    Arm and wrist carry the whole hand, so that the tool sees it as planned and the fingers keep the plan's postures,
    with all its margins and clearances.  Where arm or wrist meet a limit, TH and MF reach for what is left.

    Args:
        scenario: Sizes of the errors.
        plan: Whose roll begins.
        robot: Kinematics.
        rng: Draws the errors.

    Raises:
        PlanError: the drawn start is out of reach of arm and fingers.
    """
    p_WS = plan.p_WS + rng.normal(size=3) * np.array(scenario.sense.calibration_error)
    believed_radius = scenario.tool.handle.radius + rng.normal() * scenario.sense.radius_error
    slot = exp_so3(np.array([0.0, 0.0, scenario.screw.slot_yaw]))
    direction = rng.uniform(-np.pi, np.pi)
    tilt = scenario.start.tool_tilt * np.array([np.cos(direction), np.sin(direction), 0.0])
    R_WT = exp_so3(tilt) @ slot
    # a tilted edge's lower corner stands on the floor
    corner = abs(R_WT[2, 0]) * scenario.tool.blade_width / 2
    along = rng.choice([-1.0, 1.0]) * scenario.start.tool_offset * slot[:, 0]
    p_WT = p_WS + along + np.array([0.0, 0.0, corner + TIP_LIFT])
    q = plan.rolling(0.0)
    planned = robot.fingertips(q)
    # the plan's contacts, carried to where the tool really is: rigidly, but for its yaw, which no contact sees
    carry = R_WT @ slot.T
    p_WH, R_WH = carried_palm(robot, plan, p_WT, R_WT[:, 2])
    q = place_palm(robot, p_WH, R_WH, q, rng, margin=ARM_MARGIN, starts=1).q
    for finger in ROLLING:
        row = FINGERS.index(finger)
        target = p_WT + carry @ (planned.p_WF[row] - plan.p_WS)
        found = place_fingertip(robot, finger, target, q, rng, starts=1)
        if found.residual > NEAR_ENOUGH:
            raise PlanError(
                f"start: {finger} cannot reach the handle ({found.residual * 1e3:.1f} mm off); "
                "make start.* or sense.calibration_error smaller"
            )
        q = found.q
    return Start(q, p_WS, p_WT, R_WT, believed_radius)
