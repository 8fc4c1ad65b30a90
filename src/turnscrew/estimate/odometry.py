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
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from turnscrew.estimate.filter_state import OFFSET_COLUMNS
from turnscrew.estimate.least_turn import least_turn
from turnscrew.geometry.arrays import Array

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


class Rolled(NamedTuple):
    """What the fingers did to the tool between two ticks.

    Attributes:
        dtheta: (3,) rotation vector in W [rad]; zero when no finger touches.
        per_shift: (3, 3) by how much it would change [rad] for each metre by which all fingertips together are read to
            have moved, but have not.
        per_offset: (3, 17) by how much it is too large [rad] for each radian by which an offset of `OFFSET_JOINTS` is
            estimated too small: fingers then seem to move otherwise, and from another place.
    """

    dtheta: Array
    per_shift: Array
    per_offset: Array

    def slowed(self, share: float, axis: Array) -> Rolled:
        """The same with a share of the rotation about an axis (3,) lost."""
        return self._replace(dtheta=self.dtheta - share * float(axis @ self.dtheta) * axis)


STILL = Rolled(np.zeros(3), np.zeros((3, 3)), np.zeros((3, len(OFFSET_COLUMNS))))


@dataclass(frozen=True, slots=True)
class RollingOdometry:
    """Weights of the least squares, as speeds, so that the answer does not depend on the tick.

    Attributes:
        slip_speed: s_d [m/s]: what a contact's speed may differ from rolling by.  Two opposed fingers then outweigh the
            prior by 300 in tilt and 6000 in yaw.
        tilt_rate: s_t [rad/s]: 6 deg/s, a push of 5 N tilts by 3-4 deg in half a second.  It decides only where one
            finger alone touches, whose tangential motion is then read as yaw.
        yaw_rate: s_y [rad/s]: weak, far above any stroke.
        stray: Where three fingers or more are said to touch: one that moves by more in a tick than the others say does
            not hold the handle [m].  Five times the .06 mm that the encoders' noise moves a fingertip by; a finger
            that goes back makes 1 to 2 mm.
    """

    slip_speed: float = 0.001
    tilt_rate: float = 0.1
    yaw_rate: float = 3.0
    stray: float = 0.0003

    def increment(
        self, before: Fingertips, after: Fingertips, c_W: Array, weight: Array, p_WT: Array, R_WT: Array
    ) -> Rolled:
        """Rotation of the tool between two ticks.

        Args:
            before: Fingertips at the last tick.
            after: Fingertips now, with the same encoder offsets removed.
            c_W: (5, 3) contact points at the last tick, in W [m].
            weight: (5,) contact forces [N], 0 for fingers that do not touch.
            p_WT: (3,) tip position in W [m].
            R_WT: (3, 3) orientation of the tool.

        Returns:
            The rotation, and what errors of the fingertips make of it.
        """
        dtheta, per_shift, per_offset = least_turn(
            before.p_WF, before.R_WF, before.J, after.p_WF, after.R_WF, after.J, c_W, weight, p_WT, R_WT,
            self.slip_speed, self.tilt_rate, self.yaw_rate, self.stray,
        )  # fmt: skip
        return Rolled(dtheta, per_shift, per_offset)
