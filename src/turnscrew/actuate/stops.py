"""Soft stops: a finger's joint that comes near its limit is pushed back.

At its limit a joint takes no part in the grasp any more: it neither gives way nor presses as told, and where the
mechanical stop is, encoders tell to half a degree only.  So before it gets there a spring pushes it back.  It holds
what a finger presses with, or what presses on it, not a finger that runs off at full speed: no drive brakes that within
two degrees.

Paper: no counterpart.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.actuate.postures import CARRIERS
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.coupling import DRIVEN_INDEX


@dataclass(frozen=True)
class Stops:
    """Before the limits of the fingers' joints; arm and wrist, which plans keep off theirs, have none.

    Attributes:
        limits: (28, 2) joint ranges [rad].
        stiffness: Of the springs [N.m/rad].
        depth: Distance from the limit at which they begin [rad]: two sigmas of what encoders are off by, and where
            rolls end (`Gait.stop`).
        ahead: How far ahead of a joint on its way to its limit [s]: half of what rolls end by (`Gait.braking`).
    """

    limits: Array
    stiffness: float
    depth: float = 0.02
    ahead: float = 0.015
    _low: Array = field(init=False, repr=False, compare=False)
    _high: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        low, high = self.limits[DRIVEN_INDEX].T.copy()
        low[:CARRIERS], high[:CARRIERS] = -np.inf, np.inf
        object.__setattr__(self, "_low", low + self.depth)
        object.__setattr__(self, "_high", high - self.depth)

    def pushed_back(self, q: Array, v: Array) -> Array:
        """Torques (24,) that push joints at angles (28,) [rad] and speeds (28,) [rad/s] off their limits [N.m]."""
        return _pushed_back(q, v, self._low, self._high, self.stiffness, self.ahead)


@compiled
def _pushed_back(q: Array, v: Array, low: Array, high: Array, stiffness: float, ahead: float) -> Array:
    """`Stops.pushed_back` with the springs' ends `low` and `high` (24,) [rad]."""
    back = np.empty(len(low))
    for i in range(len(low)):
        angle, way = q[DRIVEN_INDEX[i]], ahead * v[DRIVEN_INDEX[i]]
        back[i] = stiffness * (max(low[i] - angle - min(way, 0.0), 0.0) - max(angle + max(way, 0.0) - high[i], 0.0))
    return back
