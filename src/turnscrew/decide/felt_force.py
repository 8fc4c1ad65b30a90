"""What pushes a tool's tip, as the fingers that hold it tell: by how much their servos give way.

Fingertip readings err by a quarter and by 30 deg.  A finger that is told to keep its posture is better: its servos
push with their stiffness times the angle by which it has been bent away, which encoders read to a thousandth of a
radian, .1 N.  All fingers together push the tool with what the tip is pushed with, turned round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.contact.carried import PalmPose, carried
from turnscrew.decide.reseat_state import Felt
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import ARM, FINGERS, WRIST, finger_joints
from turnscrew.robot.model import RobotModel, driven_jacobian
from turnscrew.robot.servos import STIFFNESSES
from turnscrew.signals import Estimate
from turnscrew.values import changed

PALM = len(ARM) + len(WRIST)
"""Joints that move the palm: the first of the joint vector."""

SMALLEST = 1e-3
"""Singular values of a finger's Jacobian below this share of the largest are left out: no finger is so stretched."""


@dataclass(frozen=True)
class FeltForce:
    """Force and give of fingers that are locked.

    Attributes:
        robot: Kinematics.
        time: Time constant of what is felt [s]: three ticks, which leave 60 mN of the encoders' noise,
        slow: and that of the mean that tells the zero [s].
        way: Time constant of how the tool gives way [s]: encoders leave .2 mm of a tip's height in three ticks, and a
            corner that has dropped in stays there.
    """

    robot: RobotModel
    time: float = 0.03
    slow: float = 0.3
    way: float = 0.1

    def init(self, q: Array, estimate: Estimate) -> Felt:
        """Nothing pushes.

        Args:
            q: (28,) encoder angles while nothing does, averaged [rad].
            estimate: The tool's pose, and the hand's.
        """
        p, R = self.robot.palm(estimate.q)
        none = np.zeros(3)
        return Felt(q, R.T @ (estimate.p_WT - p), R.T @ estimate.R_WT, none, none, none, np.zeros(6))

    def unpushed(self, felt: Felt, estimate: Estimate) -> tuple[Array, Array]:
        """Where the tool would be if nothing pushed it: its tip (3,) in W [m] and orientation (3, 3)."""
        p, R = self.robot.palm(estimate.q)
        return p + R @ felt.p_HT, R @ felt.R_HT

    def update(self, felt: Felt, estimate: Estimate, gripping: Flags, dt: float) -> Felt:
        """One tick.

        Args:
            felt: Of the last tick.
            estimate: Joint angles and contacts.
            gripping: (5,) locked fingers that hold the tool.
            dt: Time since then [s].
        """
        at_rest = felt.q - estimate.offset
        at_rest[:PALM] = estimate.q[:PALM]
        palm = PalmPose(*self.robot.palm(estimate.q))
        tips = self.robot.fingertips(at_rest), self.robot.fingertips(estimate.q)
        tip, _ = self.unpushed(felt, estimate)
        moved = np.concatenate(carried((palm, palm), tips, estimate.c_W, gripping.astype(float), tip))
        share = dt / (self.time + dt)
        pushed = self._force(felt, estimate, gripping) - felt.zero
        return changed(
            felt,
            force=felt.force + share * (pushed - felt.force),
            slow=felt.slow + dt / (self.slow + dt) * (pushed - felt.slow),
            give=felt.give + dt / (self.way + dt) * (moved - felt.give),
        )

    def _force(self, felt: Felt, estimate: Estimate, gripping: Flags) -> Array:
        """(3,) of the fingers' pushes, turned round, in W [N]: `J^T f = K dq` of each."""
        tips = self.robot.fingertips(estimate.q)
        J, total = driven_jacobian(tips.J), np.zeros(3)
        bent = STIFF * (estimate.q + estimate.offset - felt.q)
        for row in np.flatnonzero(gripping):
            joints = list(finger_joints(FINGERS[row]))
            x, y, z = estimate.c_W[row] - tips.p_WF[row]
            arm = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
            J_c = (J[row, :3] + arm @ J[row, 3:])[:, joints]
            total += np.linalg.lstsq(J_c.T, bent[joints], rcond=SMALLEST)[0]
        return total


def _by_joint() -> Array:
    stiff = np.zeros(28)
    stiff[DRIVEN_INDEX] = STIFFNESSES
    return stiff


STIFF = _by_joint()
"""(28,) gains of the position servos, zero for joints that follow others [N.m/rad]."""
