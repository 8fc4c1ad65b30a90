"""Which fingertips touch, and with what force: low-passed readings and a hysteresis."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.joints import FINGERS


@dataclass(frozen=True, slots=True)
class TouchState:
    """What the detector remembers between readings.

    Attributes:
        level: (5,) low-passed magnitude of each fingertip's force [N].
        f_W: (5, 3) low-passed force of each fingertip on what it touches, in W [N].
        touching: (5,) the flags.
        pressing: (5,) which of them also press in this very reading: a finger that leaves is still flagged for some
            50 ms, a millimetre of its way.
    """

    level: Array
    f_W: Array
    touching: Flags
    pressing: Flags


@compiled
def _touched(
    level: Array, f_W: Array, touching: Flags, f_F: Array, R_WF: Array, gain: float, on: float, off: float
) -> tuple[Array, Array, Flags, Flags]:
    """`TouchDetector.update`: level, f_W, touching and pressing after a reading, `gain` the low-passes' share of it."""
    level, f_W, touching, pressing = level.copy(), f_W.copy(), touching.copy(), touching.copy()
    for i in range(len(level)):
        x, y, z = f_F[i, 0], f_F[i, 1], f_F[i, 2]
        now = sqrt(x * x + y * y + z * z)
        level[i] += gain * (now - level[i])
        for j in range(3):
            f_W[i, j] += gain * (R_WF[i, j, 0] * x + R_WF[i, j, 1] * y + R_WF[i, j, 2] * z - f_W[i, j])
        touching[i] = level[i] > (off if touching[i] else on)
        pressing[i] = touching[i] and now > off
    return level, f_W, touching, pressing


@dataclass(frozen=True, slots=True)
class TouchDetector:
    """A finger touches when its low-passed |F| exceeds `on`, until it falls below `off`.

    Attributes:
        on: Threshold to begin a touch [N].  A guarded approach stops at .4 N true; a quarter of reading error and the
            push of the next ticks bring a real touch above .55 N.
        off: Threshold to end it [N]; above the .08 N that white noise of .05 N an axis leaves in the magnitude.
        time: Time constant of both low-passes [s]: 20-25 ms, three control periods of 8 ms, found by trial.
    """

    on: float = 0.55
    off: float = 0.30
    time: float = 0.022

    def init(self) -> TouchState:
        """No force, no touch."""
        k = len(FINGERS)
        return TouchState(np.zeros(k), np.zeros((k, 3)), np.zeros(k, dtype=bool), np.zeros(k, dtype=bool))

    def update(self, state: TouchState, f_F: Array, R_WF: Array, dt: float) -> TouchState:
        """Take one reading.

        Args:
            state: Of the last reading.
            f_F: (5, 3) forces of the fingertips on what they touch, each in its frame F [N].
            R_WF: (5, 3, 3) orientations of the fingertips.
            dt: Time since the last reading [s].
        """
        gain = dt / (self.time + dt)
        return TouchState(*_touched(state.level, state.f_W, state.touching, f_F, R_WF, gain, self.on, self.off))
