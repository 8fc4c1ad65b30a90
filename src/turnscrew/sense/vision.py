"""Tool pose as a marker camera would report it: noisy, 30 times a second, a frame late, sometimes not at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.sense.sensed import Sensed
from turnscrew.signals import Vision


@dataclass(frozen=True, slots=True)
class VisionState:
    """What the camera remembers between ticks.

    Attributes:
        rng: Source of noise and dropouts; `update` advances it.
        next_exposure: When the shutter opens next [s].
        queue: Frames on their way, oldest first.
    """

    rng: Generator
    next_exposure: float
    queue: tuple[Vision, ...]


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

    def init(self, rng: Generator) -> VisionState:
        """Start with the shutter at a random phase, for camera and control share no clock."""
        return VisionState(rng, float(rng.uniform(0.0, 1.0 / self.rate)), ())

    def update(self, state: VisionState, plant: Sensed) -> tuple[VisionState, Vision | None, str]:
        """Expose when due and hand out the newest frame that has arrived.

        Args:
            state: Of the last call.
            plant: Where the tool is.

        Returns:
            The new state; the frame that arrived since the last call, if any; and why there is no pose: never a reason.
        """
        time = plant.time
        p_WT, R_WT = plant.tool_pose()
        queue, due = state.queue, state.next_exposure
        if time >= due:
            # a stalled caller gets one frame, as a camera that overwrites its buffer would give
            due += (np.floor((time - due) * self.rate) + 1.0) / self.rate
            if state.rng.random() >= self.dropout:
                queue = (*queue, self._expose(state.rng, p_WT, R_WT, time))
        # half a microsecond keeps a frame from slipping by a tick through rounding of accumulated times
        arrived = [frame for frame in queue if frame.stamp + self.latency <= time + 5e-7]
        return VisionState(state.rng, float(due), queue[len(arrived) :]), arrived[-1] if arrived else None, ""

    def _expose(self, rng: Generator, p_WT: Array, R_WT: Array, time: float) -> Vision:
        p = p_WT + rng.normal(0.0, self.position_noise, 3)
        P = np.diag([self.position_noise**2] * 3 + [self.rotation_noise**2] * 3)
        return Vision(time, p, exp_so3(rng.normal(0.0, self.rotation_noise, 3)) @ R_WT, P)
