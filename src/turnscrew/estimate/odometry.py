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
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import skew

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


_EYE = np.eye(3)

_SKEW = np.array([skew(e).ravel() for e in _EYE])

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
        total = float(weight.sum())
        if total <= 0.0:
            return STILL
        turn = after.R_WF @ before.R_WF.transpose(0, 2, 1)
        moved = after.p_WF + (turn @ (c_W - before.p_WF)[:, :, None])[:, :, 0] - c_W
        lever = c_W - p_WT
        # The mean weight is one, so that the prior does not fade when the grip is strong.
        w = weight * (np.count_nonzero(weight) / total / self.slip_speed**2)
        pulled = lever * w[:, None]
        S, L = pulled.T @ moved, pulled.T @ lever
        tilt, yaw = self.tilt_rate**-2, self.yaw_rate**-2
        z = R_WT[:, 2]
        A = (L[0, 0] + L[1, 1] + L[2, 2] + tilt) * _EYE - L + (yaw - tilt) * (z[:, None] * z)
        inverse = np.linalg.inv(A)
        dtheta = inverse @ np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])
        held = np.flatnonzero(weight)
        if len(held) > 2:
            missed = moved[held] - lever[held] @ skew(dtheta).T
            strays = (missed * missed).sum(axis=1)
            if strays.max() > self.stray**2:
                others = weight.copy()
                others[held[strays.argmax()]] = 0.0
                return self.increment(before, after, c_W, others, p_WT, R_WT)
        carry = inverse @ _skews(pulled[held])
        arm, swung = c_W[held] - before.p_WF[held], moved[held] + c_W[held] - after.p_WF[held]
        then, now = _moves(before.J[held], arm), _moves(after.J[held], swung)
        per_offset = (carry @ (now - then - skew(dtheta) @ then)).sum(axis=0)
        return Rolled(dtheta, carry.sum(axis=0), per_offset)


def _skews(a: Array) -> Array:
    """Matrices (k, 3, 3) of the cross products with vectors a (k, 3)."""
    skews: Array = (a @ _SKEW).reshape(-1, 3, 3)
    return skews


def _moves(J: Array, arm: Array) -> Array:
    """Jacobians (k, 3, 17) of points at `arm` (k, 3) from the origins that J (k, 6, 28) is of, by the offset joints."""
    J = J.take(OFFSET_COLUMNS, axis=2)
    moves: Array = J[:, :3] - _skews(arm) @ J[:, 3:]
    return moves
