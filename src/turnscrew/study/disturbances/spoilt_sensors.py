"""Sensors whose measurements are spoilt on their way to the loop: the plant is read as ever, the noise is the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

from turnscrew.geometry.arrays import Array
from turnscrew.sense.sensed import Sensed
from turnscrew.sense.sensors import Sensors, SensorState
from turnscrew.signals import Measurement
from turnscrew.task.fasten import Run

Spoil: TypeAlias = Callable[[Measurement, Measurement | None], Measurement]
"""What arrives, of what was measured and of what arrived at the last tick (None at the first)."""


@dataclass(frozen=True, slots=True)
class SpoiltState(SensorState):
    """States of the sensors.

    Attributes:
        arrived: What the loop was given at the last tick.
    """

    arrived: Measurement


@dataclass(frozen=True)
class SpoiltSensors(Sensors):
    """Sensors whose measurements are spoilt.

    Attributes:
        spoil: How.
    """

    spoil: Spoil

    def update(self, state: SensorState, plant: Sensed) -> tuple[SensorState, Measurement]:
        """Reads all sensors, and spoils what they say."""
        last = state.arrived if isinstance(state, SpoiltState) else None
        following, measured = super().update(state, plant)
        arrives = self.spoil(measured, last)
        return SpoiltState(following.encoders, following.force, following.camera, arrives), arrives

    def joints(self, state: SensorState, plant: Sensed) -> tuple[SensorState, Array]:
        """Reads the encoders alone, between two ticks: what arrived at the last one is remembered."""
        following, q = super().joints(state, plant)
        if isinstance(state, SpoiltState):
            following = SpoiltState(following.encoders, following.force, following.camera, state.arrived)
        return following, q


def spoil_sensors(run: Run, spoil: Spoil) -> None:
    """Puts itself between the sensors and the loop of a run that has not begun."""
    blocks = run.loop.blocks
    sound = blocks.sensors
    sensors = SpoiltSensors(sound.encoders, sound.force, sound.camera, spoil)
    run.loop = replace(run.loop, blocks=replace(blocks, sensors=sensors))
