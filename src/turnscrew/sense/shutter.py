"""When a camera exposes and when its frames arrive: at a rate, a latency later, some never."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from turnscrew.signals import Vision


class Frame(NamedTuple):
    """What came of an exposure: its time [s], the tool's pose or None, and why there is none."""

    stamp: float
    vision: Vision | None
    blind: str


@dataclass(frozen=True, slots=True)
class ShutterState:
    """What the shutter remembers between ticks.

    Attributes:
        rng: Source of dropouts; `opens` advances it.
        next_exposure: When the shutter opens next [s].
        queue: Frames on their way, oldest first.
        blind: Why the newest frame that arrived gave no pose.
    """

    rng: Generator
    next_exposure: float
    queue: tuple[Frame, ...] = ()
    blind: str = ""


@dataclass(frozen=True, slots=True)
class Shutter:
    """A camera's clock.

    Attributes:
        rate: Frames per second [Hz]; the paper's Azure Kinect gives 30.
        latency: From exposure to arrival [s]; one frame by default.
        dropout: Probability that a frame is lost.
    """

    rate: float = 30.0
    latency: float = 1.0 / 30.0
    dropout: float = 0.0

    def init(self, rng: Generator) -> ShutterState:
        """Start at a random phase, for camera and control share no clock."""
        return ShutterState(rng, float(rng.uniform(0.0, 1.0 / self.rate)))

    def opens(self, state: ShutterState, time: float) -> tuple[ShutterState, bool]:
        """New state, and whether a frame is exposed now that will not be lost.

        Args:
            state: Of the last call.
            time: Now [s].
        """
        due = state.next_exposure
        if time < due:
            return state, False
        # a stalled caller gets one frame, as a camera that overwrites its buffer would give
        due += (np.floor((time - due) * self.rate) + 1.0) / self.rate
        return replace(state, next_exposure=float(due)), bool(state.rng.random() >= self.dropout)

    def send(self, state: ShutterState, frame: Frame) -> ShutterState:
        """Puts an exposed frame on its way."""
        return replace(state, queue=(*state.queue, frame))

    def arrived(self, state: ShutterState, time: float) -> tuple[ShutterState, Vision | None, str]:
        """New state; the newest frame that arrived since the last call, if it has a pose; why it has none.

        Args:
            state: Of the last call.
            time: Now [s].
        """
        # half a microsecond keeps a frame from slipping by a tick through rounding of accumulated times
        count = sum(frame.stamp + self.latency <= time + 5e-7 for frame in state.queue)
        if not count:
            return state, None, state.blind
        newest = state.queue[count - 1]
        return replace(state, queue=state.queue[count:], blind=newest.blind), newest.vision, newest.blind
