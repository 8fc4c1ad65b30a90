"""Rolling odometry: how the fingertips that grip the handle have turned it, between two ticks.

A finger that rolls carries the handle's material with its own at the contact.  So, with the tip pinned at p, each
touching fingertip i that moved its contact by d_i says dtheta x (c_i - p) = d_i, and the rotation follows by least
squares, weighted with the contact forces (a finger that presses more slips less) and with a prior on the rates:

    min  sum w_i |dtheta x (c_i - p) - d_i|^2 / s_d^2  +  |dtheta_xy|^2 / s_t^2  +  dtheta_z^2 / s_y^2.

For contacts on a cylinder of radius R by round fingertips of radius r this is, about the axis,
dyaw = ((R + r) dphi - r dpsi) / R: phi the angle of the fingertip's centre about the handle's axis, psi the
fingertip's own rotation about it.  The least squares also tell tilt from yaw, which unequal weights would mix.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.geometry.arrays import Array

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


@dataclass(frozen=True, slots=True)
class RollingOdometry:
    """Weights of the least squares, as speeds, so that the answer does not depend on the tick.

    Attributes:
        slip_speed: s_d [m/s]: what a contact's speed may differ from rolling by.  Two opposed fingers then outweigh the
            prior by 300 in tilt and 6000 in yaw.
        tilt_rate: s_t [rad/s]: 6 deg/s, a push of 5 N tilts by 3-4 deg in half a second.  It decides only where one
            finger alone touches, whose tangential motion is then read as yaw.
        yaw_rate: s_y [rad/s]: weak, far above any stroke.
    """

    slip_speed: float = 0.001
    tilt_rate: float = 0.1
    yaw_rate: float = 3.0

    def increment(
        self, before: Fingertips, after: Fingertips, c_W: Array, weight: Array, p_WT: Array, R_WT: Array
    ) -> Array:
        """Rotation of the tool between two ticks.

        Args:
            before: Fingertips at the last tick.
            after: Fingertips now, with the same encoder offsets removed.
            c_W: (5, 3) contact points at the last tick, in W [m].
            weight: (5,) contact forces [N], 0 for fingers that do not touch.
            p_WT: (3,) tip position in W [m].
            R_WT: (3, 3) orientation of the tool.

        Returns:
            (3,) rotation vector in W [rad]; zero when no finger touches.
        """
        total = float(weight.sum())
        if total <= 0.0:
            return np.zeros(3)
        turn = after.R_WF @ before.R_WF.transpose(0, 2, 1)
        moved = after.p_WF + (turn @ (c_W - before.p_WF)[:, :, None])[:, :, 0] - c_W
        lever = c_W - p_WT
        # The mean weight is one, so that the prior does not fade when the grip is strong.
        w = weight * (np.count_nonzero(weight) / total / self.slip_speed**2)
        pulled = lever * w[:, None]
        S, L = pulled.T @ moved, pulled.T @ lever
        tilt, yaw = self.tilt_rate**-2, self.yaw_rate**-2
        z = R_WT[:, 2]
        A = (L[0, 0] + L[1, 1] + L[2, 2] + tilt) * np.eye(3) - L + (yaw - tilt) * (z[:, None] * z)
        return np.linalg.solve(A, np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]]))
