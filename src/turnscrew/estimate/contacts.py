"""Which fingertips touch, and with what force: low-passed readings and a hysteresis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
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
        f_W = (R_WF @ f_F[:, :, None])[:, :, 0]
        now = np.sqrt((f_F * f_F).sum(axis=1))
        level = state.level + gain * (now - state.level)
        touching = np.where(state.touching, level > self.off, level > self.on)
        return TouchState(level, state.f_W + gain * (f_W - state.f_W), touching, touching & (now > self.off))
