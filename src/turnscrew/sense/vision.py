"""Tool pose as a marker camera would report it: noisy, 30 times a second, a frame late, sometimes not at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.sense.sensed import Sensed
from turnscrew.sense.shutter import Frame, Shutter, ShutterState
from turnscrew.signals import Vision


@dataclass(frozen=True, slots=True)
class NoisyTruthVision:
    """Truth plus white noise: p = p_WT + n_p, R = exp([n_r]x) R_WT, both noises isotropic.

    Attributes:
        rate: Frames per second [Hz]; the paper's Azure Kinect gives 30.
        position_noise: Standard deviation per axis [m].
        rotation_noise: Standard deviation per axis [rad].
        latency: From exposure to arrival [s]; one frame by default.
        dropout: Probability that a frame is lost.

    Paper: V-A adds "some random noise ... to mimic realistic visual feedback" without figures; 3 mm and 2 deg are a
    pessimistic reading of ArUco markers of 10 mm on a handle at .65 m.
    """

    rate: float = 30.0
    position_noise: float = 0.003
    rotation_noise: float = np.deg2rad(2.0)
    latency: float = 1.0 / 30.0
    dropout: float = 0.0

    def init(self, rng: Generator) -> ShutterState:
        """Start with the shutter at a random phase."""
        return self._shutter.init(rng)

    def update(self, state: ShutterState, plant: Sensed) -> tuple[ShutterState, Vision | None, str]:
        """Expose when due and hand out the newest frame that has arrived.

        Args:
            state: Of the last call.
            plant: Where the tool is.

        Returns:
            The new state; the frame that arrived since the last call, if any; and why there is no pose: never a reason.
        """
        state, open_ = self._shutter.opens(state, plant.time)
        if open_:
            seen = self._expose(state.rng, *plant.tool_pose(), plant.time)
            state = self._shutter.send(state, Frame(plant.time, seen, ""))
        return self._shutter.arrived(state, plant.time)

    @property
    def _shutter(self) -> Shutter:
        return Shutter(self.rate, self.latency, self.dropout)

    def _expose(self, rng: Generator, p_WT: Array, R_WT: Array, time: float) -> Vision:
        p = p_WT + rng.normal(0.0, self.position_noise, 3)
        P = np.diag([self.position_noise**2] * 3 + [self.rotation_noise**2] * 3)
        return Vision(time, p, exp_so3(rng.normal(0.0, self.rotation_noise, 3)) @ R_WT, P)
