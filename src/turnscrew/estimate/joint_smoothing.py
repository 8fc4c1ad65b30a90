"""Smooths the readings of the joints about the motion that they were told to make.

What arm and wrist read wrong moves all fingertips together, and rolling odometry would take it for a tilt of the tool:
.005 deg at the shoulder, .09 mm at the fingertips, for .04 deg; .05 deg at the wrist, .3 mm, for .14 deg.  What a joint
does is mostly what it was told; by how much it does otherwise changes with the error of the load that was counted on,
slowly in the arm and faster in fingers that touch.  So it is that difference which is smoothed, and a motion as wanted
comes through without lag.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import ARM, JOINTS, WRIST

PALM = len(ARM) + len(WRIST)
"""Arm and wrist are the first joints of the joint vector."""


@dataclass(frozen=True, slots=True)
class JointState:
    """Smoothed angles q (28,) [rad], and by how much arm and wrist move faster than wanted, lead (6,) [rad/s]."""

    q: Array
    lead: Array


@dataclass(frozen=True, slots=True)
class JointSmoother:
    """First-order low-pass of reading less wanted motion: of white noise it leaves the variance (1 - a) / (1 + a).

    With a = exp(-dt / time): q += motion, then q += (1 - a) (reading - q).  The times were found by trial on recorded
    runs, where the error of smoothed less true angle is least, noise and lag together.

    Attributes:
        arm: Time constant of the arm's joints [s]: noise of .005 deg at 100 Hz becomes .0003 deg.
        wrist: Of the wrist's [s], whose servos are softer and give way to loads: .005 deg, and as much lag again.
        finger: Of the fingers' [s]: a fingertip that meets the handle earlier than expected differs within some
            hundredths of a second.  Half of the noise is left.
    """

    arm: float = 1.5
    wrist: float = 0.5
    finger: float = 0.02

    def init(self, q: Array) -> JointState:
        """Start at the first reading q (28,), at rest."""
        return JointState(q, np.zeros(PALM))

    def update(
        self, state: JointState, q: Array, v: Array, motion: Array, dt: float
    ) -> tuple[JointState, Array, Array]:
        """Take a reading.

        Args:
            state: Of the last one.
            q: (28,) readings [rad].
            v: (28,) speeds [rad/s].
            motion: (28,) by how much the joints were told to move since the last reading [rad].
            dt: Time since then [s].

        Returns:
            The new state, and q and v smoothed; the fingers' speeds stay as read, for a finger follows a sudden command
            some 10 ms late, and what it has not done yet would be taken for a force.
        """
        take = _shares(self.arm, self.wrist, self.finger, dt)
        wanted = motion[:PALM] / dt
        ahead = state.q + motion
        lead = state.lead + take[:PALM] * (v[:PALM] - wanted - state.lead)
        state = JointState(ahead + take * (q - ahead), lead)
        return state, state.q, np.concatenate([wanted + lead, v[PALM:]])


@lru_cache(maxsize=16)
def _shares(arm: float, wrist: float, finger: float, dt: float) -> Array:
    """(28,) share 1 - a of a new reading."""
    times = np.full(len(JOINTS), finger)
    times[:PALM] = wrist
    times[: len(ARM)] = arm
    return -np.expm1(-dt / times)
