"""Before the tip searches: lift it, take the tool with four fingers, right it in the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from turnscrew.decide.placing import between
from turnscrew.decide.plan import FOLLOWERS, LEADERS, GaitPlan
from turnscrew.decide.reseat_pose import seen_from
from turnscrew.decide.reseat_state import FOUR, ReseatState
from turnscrew.geometry.arrays import Array
from turnscrew.robot.inverse_kinematics import place_fingertip, rotation_vector
from turnscrew.robot.joints import FINGERS, finger_joints
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate

ON_HANDLE = 0.085, 0.165
"""Heights above the tip between which fingers are put to the handle [m]: its ends, less a fingertip's half width."""

STANDOFF = 0.006
"""Distance from the handle at which a finger begins to feel [m]: twice what a tool seen for .5 s may err by."""


class Motion(NamedTuple):
    """What a step asks for: twists (6,) in W, linear first, of the palm, and of the tool in the hand, at its tip."""

    palm: Array
    tool: Array


STILL = Motion(np.zeros(6), np.zeros(6))


@dataclass(frozen=True)
class Gathering:
    """Taking the tool.

    Attributes:
        robot: Kinematics.
        plan: The gait's postures.
        height: How high over the head the tip is lifted [m]: over a tip that lies beside it, and a lean's way.
        lift: Speed of it [m/s]; a tenth for what the estimate leaves.
        rate: At which a lean is removed [1/s],
        turning: and at most how fast [rad/s]: the tip moves by 30 mm/s.
        placing: Largest speed at which a handle is brought back to its place in the hand [m/s].
    """

    robot: RobotModel
    plan: GaitPlan
    height: float = 0.012
    lift: float = 0.02
    rate: float = 2.0
    turning: float = 0.25
    placing: float = 0.01

    def lifting(self, state: ReseatState, estimate: Estimate, above: float) -> Motion:
        """The arm lifts the tool, and rights the hand; two fingers bring it to its place there, before others come.

        A search leaves the hand leaning by ten degrees and more, as the tool leant: there a tool that two fingers hold
        swings down out of the others' reach.

        Args:
            state: Who holds.
            estimate: Pose of the tool, contacts.
            above: Height of the tip over the head [m].
        """
        up = min(self.lift, 4.0 * max(self.height + 0.003 - above, 0.0) + 0.1 * self.lift)
        if above < self.height:
            return Motion(np.array([0.0, 0.0, up, 0.0, 0.0, 0.0]), np.zeros(6))
        turn = rotation_vector(self.back(estimate))
        turn *= min(self.rate, self.turning / max(float(np.linalg.norm(turn)), 1e-9))
        palm = seen_from(np.array([0.0, 0.0, up, *turn]), estimate.p_WT, self.robot.palm(estimate.q)[0])
        if state.gripping[FOUR].all():
            return Motion(palm, np.zeros(6))
        tool, off = self.righting(state, estimate).tool, self.off(state, estimate)
        tool[:3] += off * min(self.rate, self.placing / max(float(np.linalg.norm(off)), 1e-9))
        return Motion(palm, tool)

    def back(self, estimate: Estimate) -> Array:
        """(3, 3) rotation in W that would bring the palm back to how the gait holds it."""
        (_, R), (_, R_plan) = self.robot.palm(estimate.q), self.robot.palm(self.plan.rolling(0.0))
        return R_plan @ R.T

    def before_handle(self, state: ReseatState, estimate: Estimate) -> Array:
        """(28,) postures that bring those of the four that do not hold before the handle [rad].

        Each comes where the plan's hand-over has it, as the palm sees it, for that is clear of its neighbours, and from
        there straight to the handle, wherever that is now.
        """
        planned_q = self.plan.adding(1.0, rolled=0.0)
        (p_plan, R_plan), (p, R) = self.robot.palm(planned_q), self.robot.palm(estimate.q)
        planned, q, axis = self.robot.fingertips(planned_q), estimate.q.copy(), estimate.R_WT[:, 2]
        begin = planned_q.copy()
        begin[:6] = estimate.q[:6]
        for row in np.flatnonzero(FOUR & ~state.gripping):
            arm = p + R @ R_plan.T @ (planned.p_WF[row] - p_plan) - estimate.p_WT
            radial = arm - (arm @ axis) * axis
            away = (estimate.radius + self.robot.rho[row] + STANDOFF) / np.linalg.norm(radial)
            target = estimate.p_WT + np.clip(arm @ axis, *ON_HANDLE) * axis + away * radial
            found = place_fingertip(self.robot, FINGERS[row], target, begin, np.random.default_rng(0), 0.01, 3)
            joints = list(finger_joints(FINGERS[row]))
            q[joints] = found.q[joints]
        q[FOLLOWERS] = q[LEADERS]
        return q

    def lean(self, estimate: Estimate) -> Array:
        """(3,) rotation vector in W that would right the tool in the hand [rad]."""
        _, R_plan = self.robot.palm(self.plan.rolling(0.0))
        _, R = self.robot.palm(estimate.q)
        return rotation_vector(between(estimate.R_WT[:, 2], R @ R_plan.T @ self.plan.R_WT[:, 2]))

    def off(self, state: ReseatState, estimate: Estimate) -> Array:
        """(3,) way in W from the handle, where fingers hold it, to its place in the hand [m].

        A tool that has been knocked out may have slid up between the fingers by more than a centimetre: there it lies
        against the roots of those that are to come, and the walk's places are beyond their reach.
        """
        if not state.gripping.any():
            return np.zeros(3)
        (p_plan, R_plan), (p, R) = self.robot.palm(self.plan.rolling(0.0)), self.robot.palm(estimate.q)
        turn, axis = R @ R_plan.T, estimate.R_WT[:, 2]
        height = float((estimate.c_W[state.gripping].mean(axis=0) - estimate.p_WT) @ axis)
        lean = turn @ self.plan.R_WT[:, 2] - axis
        return np.asarray(p + turn @ (self.plan.p_WS - p_plan) - estimate.p_WT + height * lean)

    def righting(self, state: ReseatState, estimate: Estimate, turn_rate: float = 0.0) -> Motion:
        """The fingers right the tool about where they hold it.

        Args:
            state: Who holds.
            estimate: Pose of the tool, contacts.
            turn_rate: Yaw rate besides [rad/s].
        """
        lean = self.lean(estimate)
        omega = lean * min(self.rate, self.turning / max(float(np.linalg.norm(lean)), 1e-9))
        omega[2] += turn_rate
        held = estimate.c_W[state.gripping]
        middle = held.mean(axis=0) if len(held) else estimate.p_WT
        return Motion(np.zeros(6), np.concatenate([np.cross(omega, estimate.p_WT - middle), omega]))
