"""Putting planned postures where the handle really is: the plan's contacts, carried along with the estimated tool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from turnscrew.decide.plan import SUPPORTING, GaitPlan
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import cross, exp_so3
from turnscrew.robot.inverse_kinematics import PALM_LENGTH, place_fingertip, rotation_vector
from turnscrew.robot.joints import FINGERS, finger_joints
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate

MOVING = 0.1
"""Speed from which a joint counts as moving [rad/s]: twice the noise of the encoders' speeds, an eighth of a roll's."""


@dataclass(frozen=True)
class Placing:
    """Corrects the plan by the estimate.

    Attributes:
        robot: Kinematics.
        plan: The gait's postures, made for a screw at `plan.p_WS` and an upright tool.
        arm_rate: Rate at which the arm removes a misplacement [1/s].
        arm_speed: Fastest motion of the palm, turns as `knuckle_way` counts them [m/s]: a gripped handle is dragged
            along, and at 6 mm/s the tilt servo keeps up; at 20 mm/s one start of sixteen tips the tool over (found by
            trial).
        opposing: Largest angle by which each of FF and RF is placed farther around the handle than planned, until they
            are opposite [rad].
    """

    robot: RobotModel
    plan: GaitPlan
    arm_rate: float = 2.0
    arm_speed: float = 0.006
    opposing: float = 0.0

    def before_handle(self, q_plan: Array, fingers: Sequence[str], estimate: Estimate, standoff: float) -> Array:
        """Postures with fingertips a little off the handle, at the plan's contacts as seen from the handle.

        A fingertip planned at `p` comes to `p_WT + A (p - p_WS)`, A the smallest rotation that takes the planned
        axis to the estimated one: the tool's yaw does not matter on a round handle.

        Args:
            q_plan: (28,) planned posture with the fingers in contact [rad].
            fingers: Which fingers.
            estimate: Where arm and tool are.
            standoff: Distance to keep from the handle [m].

        Returns:
            (28,) joint angles: the fingers' from inverse kinematics, all others as planned [rad].
        """
        planned = self.robot.fingertips(q_plan)
        A = between(self.plan.R_WT[:, 2], estimate.R_WT[:, 2])
        axis = estimate.R_WT[:, 2]
        q = q_plan.copy()
        q[:6] = estimate.q[:6]
        rng = np.random.default_rng(0)
        for finger, turn in zip(fingers, self._opposed(planned.p_WF, fingers), strict=True):
            row = FINGERS.index(finger)
            arm = A @ turn @ (planned.p_WF[row] - self.plan.p_WS)
            radial = arm - (arm @ axis) * axis
            out = radial / np.linalg.norm(radial)
            target = estimate.p_WT + arm + (standoff + estimate.radius - self.plan.radius) * out
            q = place_fingertip(self.robot, finger, target, q, rng, margin=0.01, starts=1).q
        q[:6] = q_plan[:6]
        return q

    def _opposed(self, p_WF: Array, fingers: Sequence[str]) -> list[Array]:
        """Turns (3, 3) of the fingers' places around the planned handle that bring a pair that holds opposite.

        Two fingers that are not opposite push the handle sideways with a share of their squeeze, and need friction for
        that.

        Args:
            p_WF: (5, 3) fingertips as planned, in W [m].
            fingers: Which of them are placed.
        """
        if tuple(fingers) != SUPPORTING:
            return [np.eye(3)] * len(fingers)
        axis = self.plan.R_WT[:, 2]
        one, other = (p_WF[FINGERS.index(finger)] - self.plan.p_WS for finger in fingers)
        one, beyond = one - (one @ axis) * axis, (other @ axis) * axis - other
        lack = float(np.arctan2(cross(one, beyond) @ axis, one @ beyond))
        turn = min(max(0.5 * lack, -self.opposing), self.opposing)
        return [exp_so3(turn * axis), exp_so3(-turn * axis)]

    def palm_error(self, estimate: Estimate) -> Array:
        """By how much the palm is off the plan's place over the screw, the tool upright there.

        The tool's lean is left out: control rights it, and a palm that followed it would follow the camera's noise.

        Args:
            estimate: Where arm and screw are.

        Returns:
            (6,) way to go in W [m], then rotation vector to turn by [rad].
        """
        p_WH, R_WH = self.robot.palm(estimate.q)
        from_screw, wanted = self._palm
        return np.concatenate([estimate.p_WS + from_screw - p_WH, rotation_vector(wanted @ R_WH.T)])

    @cached_property
    def _palm(self) -> tuple[Array, Array]:
        """Where the plan has the palm: its way (3,) from the screw in W [m], and its orientation (3, 3)."""
        p_WH, R_WH = self.robot.palm(self.plan.rolling(0.0))
        return p_WH - self.plan.p_WS, R_WH

    def palm_twist(self, estimate: Estimate) -> Array:
        """Twist (6,) in W, linear first, that brings the palm back over the screw as planned [m/s, rad/s].

        Args:
            estimate: Where arm and screw are.
        """
        V = self.arm_rate * self.palm_error(estimate)
        speed = knuckle_way(V)
        return V if speed <= self.arm_speed else V * (self.arm_speed / speed)

    def left(self, estimate: Estimate, q: Array, fingers: Sequence[str]) -> tuple[float, float]:
        """How far the fingers' joints are from where they are to go, and how fast they still move.

        Args:
            estimate: Where they are.
            q: (28,) where they go [rad].
            fingers: Which fingers.

        Returns:
            The largest of the angles that are left [rad], and the largest speed [rad/s].
        """
        joints = [joint for finger in fingers for joint in finger_joints(finger)]
        return float(np.abs(q - estimate.q)[joints].max()), float(np.abs(estimate.v[joints]).max())

    def meets_limit(self, q: Array, v: Array, fingers: Sequence[str], margin: float, time: float) -> bool:
        """Whether a driven joint of the fingers is on its way to a limit, and within a margin of it in a while.

        Args:
            q: (28,) joint angles [rad].
            v: (28,) joint speeds [rad/s].
            fingers: Which fingers.
            margin: [rad].
            time: How long that while is [s].
        """
        joints = [joint for finger in fingers for joint in finger_joints(finger)]
        low, high = self.robot.limits[joints].T
        angles, speeds = q[joints] + v[joints] * time, v[joints]
        down, up = (angles - low < margin) & (speeds < -MOVING), (high - angles < margin) & (speeds > MOVING)
        return bool((down | up).any())


def carried_palm(robot: RobotModel, plan: GaitPlan, p_WT: Array, axis: Array) -> tuple[Array, Array]:
    """The plan's palm carried along with a tool: as the handle sees it, the hand is where it was planned to be.

    The tool is carried by the smallest rotation of its axis: its yaw does not matter on a round handle.

    Args:
        robot: Kinematics.
        plan: With the planned palm.
        p_WT: (3,) where the tip is, in W [m].
        axis: (3,) the tool's axis in W, of length 1.

    Returns:
        p_WH (3,) [m] and R_WH (3, 3) of the palm.
    """
    p_WH, R_WH = robot.palm(plan.rolling(0.0))
    A = between(plan.R_WT[:, 2], axis)
    return p_WT + A @ (p_WH - plan.p_WS), A @ R_WH


def knuckle_way(error: Array) -> float:
    """Size of a palm's error or twist (6,), linear first, turns counted as what they move the knuckles [m or m/s]."""
    turn = PALM_LENGTH * error[3:]
    return float(np.sqrt(error[:3] @ error[:3] + turn @ turn))


def between(a: Array, b: Array) -> Array:
    """Smallest rotation (3, 3) that takes unit vector a to unit vector b, for less than half a turn."""
    axis = np.cross(a, b)
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray(np.eye(3) + K + K @ K / (1.0 + a @ b))
