"""One component of the tool's load, told by fingertips whose readings point the wrong way.

A reading f turned by a small constant error d_i is wrong across f, so a sum of readings errs in proportion to the
squeezes.  Of a load s (a force along the tool's axis, or a torque about it) the fingertips tell

    y = s + sum h_i d_i + noise,        s = offset + slope * angle,

h_i the squeeze of finger i [N], times its lever where s is a torque.  Squeezes come and go with the fingers while
the load goes on, and there may be moments without load: this tells the d_i from s.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.joints import FINGERS

BIASES = slice(2, 2 + len(FINGERS))
SIZE = BIASES.stop
_BIASES = BIASES.start
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


@compiled
def _forgotten(P: Array, keep: float, drift: float, bias: float) -> Array:
    """Covariance a tick later: the offset walks by a variance `drift`, each d_i keeps a share and stays of `bias`."""
    after = P.copy()
    for i in range(SIZE):
        for j in range(SIZE):
            after[i, j] *= (keep if i >= _BIASES else 1.0) * (keep if j >= _BIASES else 1.0)
    after[0, 0] += drift
    for i in range(_BIASES, SIZE):
        after[i, i] += bias * (1.0 - keep * keep)
    return after


@compiled
def _joseph(P: Array, H: Array, gain: Array, noise: float) -> Array:
    """`(1 - g H) P (1 - g H)^T + noise g g^T`: right for any gain."""
    left = P.copy()
    for j in range(SIZE):
        told = 0.0
        for k in range(SIZE):
            told += H[k] * P[k, j]
        for i in range(SIZE):
            left[i, j] -= gain[i] * told
    after = left.copy()
    for i in range(SIZE):
        told = 0.0
        for k in range(SIZE):
            told += left[i, k] * H[k]
        for j in range(SIZE):
            after[i, j] += noise * gain[i] * gain[j] - told * gain[j]
    return after


@compiled
def _updated(
    x: Array, P: Array, y: float, h: Array, angle: float, keep: float, drift: float, bias: float,
    noise: float, surprise: float, loaded: bool, learns: bool,
) -> tuple[Array, Array]:  # fmt: skip
    """`BiasedLoad.update`, all but the first arguments variances: drift in a tick, of a d_i, of a reading."""
    x, H, PH, gain = x.copy(), np.zeros(SIZE), np.zeros(SIZE), np.zeros(SIZE)
    if loaded:
        H[0], H[1] = 1.0, angle
    P = _forgotten(P, keep, drift if loaded else 0.0, bias)
    innovation, S = y, noise
    for i in range(_BIASES, SIZE):
        x[i] *= keep
        H[i] = h[i - _BIASES]
    for i in range(SIZE):
        innovation -= H[i] * x[i]
        for k in range(SIZE):
            PH[i] += P[i, k] * H[k]
        S += H[i] * PH[i]
    if loaded and innovation * innovation > surprise * S:
        more = innovation * innovation / surprise - S
        P[0, 0] += more
        PH[0] += more
        S += more
    for i in range(SIZE):
        # a slope that is not learned keeps its mean and its variance, and its doubt still counts in S
        gain[i] = PH[i] / S if learns or i != 1 else 0.0
        x[i] += gain[i] * innovation
    return x, _joseph(P, H, gain, noise)


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
        x, P = _updated(
            state.x, state.P, y, h, angle, exp(-dt / self.memory), self.drift**2 * dt, self.bias_sigma**2,
            self.noise**2, self.surprise, loaded, learns,
        )  # fmt: skip
        return LoadState(x, P)
