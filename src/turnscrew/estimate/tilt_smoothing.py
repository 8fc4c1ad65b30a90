"""Smooths what rolling odometry says of tilt, where it is mostly the encoders' noise.

The fingers' encoders (.05 deg) make .1 deg of tilt at every tick.  That noise does not add up, for each increment takes
back the one before, but it stands in every estimate.  A gripped tool turns about its axis by a radian in a second and
tilts by some tenths of a degree: so the axis may be smoothed where the yaw must not.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from turnscrew.geometry.arrays import Array


@dataclass(frozen=True, slots=True)
class TiltState:
    """Tilt not handed on yet (3,) [rad] and rate of tilting (3,) [rad/s], both in W."""

    withheld: Array
    rate: Array


@dataclass(frozen=True, slots=True)
class TiltSmoother:
    """Critically damped g-h filter of the odometry's tilt: no lag at a constant rate.

    Attributes:
        time: Time constant [s]: ten ticks leave a third of the noise, and a tool that begins to tilt at 9 deg/s2 is
            followed with an error of .09 deg.
    """

    time: float = 0.1

    def init(self) -> TiltState:
        """Nothing withheld, at rest."""
        return TiltState(np.zeros(3), np.zeros(3))

    def update(self, state: TiltState, dtheta: Array, R_WT: Array, dt: float) -> tuple[TiltState, Array]:
        """Takes an increment.

        Args:
            state: Of the last tick.
            dtheta: (3,) rotation vector of this tick, in W [rad].
            R_WT: (3, 3) orientation of the tool.
            dt: [s].

        Returns:
            The new state, and the rotation vector to go by.
        """
        keep = exp(-dt / self.time)
        z = R_WT[:, 2]
        about_axis = (z @ dtheta) * z
        error = state.withheld + dtheta - about_axis - dt * state.rate
        withheld = keep * keep * error
        lean = dt * state.rate + error - withheld
        return TiltState(withheld, state.rate + (1.0 - keep) ** 2 / dt * error), about_axis + lean
