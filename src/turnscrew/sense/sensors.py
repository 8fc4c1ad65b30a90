"""The room's block: all sensors read at one tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.sense.encoders import Encoders, EncoderState
from turnscrew.sense.sensed import Sensed
from turnscrew.signals import Measurement, Vision


class Camera(Protocol):
    """Something that tells the tool's pose from time to time."""

    def init(self, rng: Generator) -> Any:
        """State before the first tick."""

    def update(self, state: Any, plant: Sensed) -> tuple[Any, Vision | None, str]:
        """New state; the frame that arrived since the last tick; why the newest frame gave no pose, or nothing."""


class ForceSensor(Protocol):
    """Something that tells what fingertips press with: by sensors in the tips, or by the drives' torques."""

    def init(self, rng: Generator) -> Any:
        """Draws this robot's constant errors."""

    def update(self, state: Any, plant: Sensed) -> tuple[Any, Array | None, Array | None]:
        """New state; f_F (5, 3) [N] or None; tau (24,) [N.m] or None, as in `Measurement`."""


@dataclass(frozen=True, slots=True)
class SensorState:
    """States of the sensors."""

    encoders: EncoderState
    force: Any
    camera: Any


@dataclass(frozen=True)
class Sensors:
    """Encoders, a force sensor and a camera, in simulation."""

    encoders: Encoders
    force: ForceSensor
    camera: Camera

    def init(self, encoders: Generator, force: Generator, camera: Generator) -> SensorState:
        """Draws this robot's constant errors, each sensor from its own stream."""
        return SensorState(self.encoders.init(encoders), self.force.init(force), self.camera.init(camera))

    def joints(self, state: SensorState, plant: Sensed) -> tuple[SensorState, Array]:
        """Reads the encoders alone: the new state, and angles (28,) [rad]."""
        encoders, (angles, _) = self.encoders.update(state.encoders, plant.q, plant.time)
        return SensorState(encoders, state.force, state.camera), angles

    def update(self, state: SensorState, plant: Sensed) -> tuple[SensorState, Measurement]:
        """Reads all sensors.

        Args:
            state: Of the last tick.
            plant: What is measured.
        """
        encoders, (angles, speeds) = self.encoders.update(state.encoders, plant.q, plant.time)
        force, f_F, tau = self.force.update(state.force, plant)
        camera, frame, blind = self.camera.update(state.camera, plant)
        return SensorState(encoders, force, camera), Measurement(plant.time, angles, speeds, f_F, tau, frame, blind)
