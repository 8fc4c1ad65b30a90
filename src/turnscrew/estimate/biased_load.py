"""One component of the tool's load, told by fingertips whose readings point the wrong way.

A reading f turned by a small constant error d_i is wrong across f, so a sum of readings errs in proportion to the
squeezes.  Of a load s (a force along the tool's axis, or a torque about it) the fingertips tell

    y = s + sum h_i d_i + noise,        s = offset + slope * angle,

h_i the squeeze of finger i [N], times its lever where s is a torque.  Squeezes come and go with the fingers while
the load goes on, and there may be moments without load: this tells the d_i from s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import FINGERS

BIASES = slice(2, 2 + len(FINGERS))
SIZE = BIASES.stop
DIRECTION_SHARE = 0.32
"""Standard deviation of a reading's direction about one axis, over the bound of its error: `.6 / sqrt(5)` from a
constant part drawn in a ball of .6 of the bound, .18 from a part that wanders within the rest."""


@dataclass(frozen=True, slots=True)
class LoadState:
    """Mean and covariance of offset, slope and the five d_i.

    Attributes:
        x: (7,) offset [N or N.m], slope [the same per rad], d_i [rad].
        P: (7, 7) covariance of their errors.
    """

    x: Array
    P: Array


@dataclass(frozen=True, slots=True)
class BiasedLoad:
    """A Kalman filter of offset, slope and d_i.

    Attributes:
        offset: Standard deviation of the offset at the start.
        slope: Standard deviation of the slope at the start.
        drift: Random walk of the offset, a second.
        noise: White noise of a reading.
        direction_error: Bound of the readings' error in direction [rad].
        memory: Time in which a d_i forgets itself [s]: the part that wanders does so in 3 s, the other never.
        surprise: Squared innovation, over its variance, beyond which the offset is taken to have jumped, and its
            variance is opened until the innovation is no surprise: 2 sigma.
    """

    offset: float
    slope: float
    drift: float
    noise: float
    direction_error: float = np.deg2rad(30.0)
    memory: float = 10.0
    surprise: float = 4.0

    def init(self, offset: float = 0.0) -> LoadState:
        """Start at an offset, without slope and errors."""
        x = np.zeros(SIZE)
        x[0] = offset
        sigma = np.array([self.offset, self.slope, *[self.bias_sigma] * len(FINGERS)])
        return LoadState(x, np.diag(sigma**2))

    @property
    def bias_sigma(self) -> float:
        """Standard deviation of a d_i [rad]."""
        return DIRECTION_SHARE * self.direction_error

    def update(
        self, state: LoadState, y: float, h: Array, angle: float, dt: float, *, loaded: bool, learns: bool
    ) -> LoadState:
        """Take in one reading.

        Args:
            state: Of the last reading.
            y: Load as the fingertips tell it [N or N.m].
            h: (5,) squeezes [N], times levers [N.m].
            angle: Angle that the slope goes with [rad].
            dt: Time since the last reading [s].
            loaded: Whether there is a load at all; where there is none, s is known to be zero.
            learns: Whether the slope may be learned now.
        """
        keep = np.exp(-dt / self.memory)
        fade = np.ones(SIZE)
        fade[BIASES] = keep
        x, P = fade * state.x, state.P * (fade[:, None] * fade)
        noise = np.zeros(SIZE)
        noise[BIASES] = self.bias_sigma**2 * (1.0 - keep * keep)
        noise[0] = self.drift**2 * dt * loaded
        P.flat[:: SIZE + 1] += noise
        H = np.array([float(loaded), angle * loaded, *h])
        innovation = y - float(H @ x)
        PH = P @ H
        S = float(H @ PH) + self.noise**2
        if loaded and innovation**2 > self.surprise * S:
            more = innovation**2 / self.surprise - S
            P[0, 0] += more
            PH[0] += more
            S += more
        gain = PH / S
        if not learns:
            # a slope that is not learned keeps its mean and its variance, and its doubt still counts in S
            gain[1] = 0.0
        A = np.eye(SIZE) - gain[:, None] * H
        return LoadState(x + gain * innovation, A @ P @ A.T + self.noise**2 * (gain[:, None] * gain))
