"""Sensors that fail: cameras that go dark or see a flipped marker, readings that are no numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.sense.sensed import Sensed
from turnscrew.sense.sensors import Camera
from turnscrew.signals import Measurement, Vision
from turnscrew.task.fasten import Run

COLLAR = np.array([0.0, 0.0, 0.185])
"""Where the markers are, in T [m]."""


@dataclass(frozen=True)
class Faulty:
    """A camera whose frames are spoilt."""

    inner: Camera
    spoil: Callable[[Vision], Vision | None]

    def init(self, rng: Generator) -> Any:
        return self.inner.init(rng)

    def update(self, state: Any, plant: Sensed) -> tuple[Any, Vision | None, str]:
        state, vision, blind = self.inner.update(state, plant)
        spoilt = None if vision is None else self.spoil(vision)
        return state, spoilt, "the lens is covered" if vision is not None and spoilt is None else blind


def dark(start: float, end: float) -> Callable[[Vision], Vision | None]:
    """No frame that was exposed in this time arrives."""
    return lambda vision: None if start <= vision.stamp < end else vision


def flipped(start: float, frames: int, rate: float = 30.0) -> Callable[[Vision], Vision | None]:
    """The markers are seen turned by 30 deg about a level axis through them, so many frames long."""
    return lambda vision: flip(vision) if start <= vision.stamp < start + frames / rate else vision


def flip(vision: Vision) -> Vision:
    turn = exp_so3(np.array([np.radians(30.0), 0.0, 0.0]))
    collar = vision.p_WT + vision.R_WT @ COLLAR
    R_WT = turn @ vision.R_WT
    return replace(vision, p_WT=collar - R_WT @ COLLAR, R_WT=R_WT)


def spoil_camera(run: Run, spoil: Callable[[Vision], Vision | None]) -> None:
    """Puts a faulty camera into a run that has not begun."""
    blocks = run.loop.blocks
    sensors = replace(blocks.sensors, camera=Faulty(blocks.sensors.camera, spoil))
    run.loop = replace(run.loop, blocks=replace(blocks, sensors=sensors))


def spoilt(measurement: Measurement, rng: Generator) -> Measurement:
    """One of many things that can be wrong with a measurement, at random."""
    kind = rng.integers(10)
    if kind == 0:
        return replace(measurement, q=_somewhere(measurement.q, np.nan, rng))
    if kind == 1:
        return replace(measurement, v=_somewhere(measurement.v, np.inf, rng))
    if kind == 2 and measurement.f_F is not None:
        return replace(measurement, f_F=_somewhere(measurement.f_F, np.nan, rng))
    if kind == 3 and measurement.f_F is not None:
        return replace(measurement, f_F=rng.normal(0.0, 20.0, (5, 3)))
    if kind == 4:
        return replace(measurement, q=measurement.q + rng.normal(0.0, 0.1, 28))
    if kind == 5 and measurement.f_F is not None:
        return replace(measurement, f_F=np.zeros((5, 3)))
    vision = measurement.vision
    if vision is None:
        return measurement
    if kind == 6:
        return replace(measurement, vision=replace(vision, p_WT=_somewhere(vision.p_WT, np.nan, rng)))
    if kind == 7:
        return replace(measurement, vision=flip(vision))
    if kind == 8:
        return replace(measurement, vision=replace(vision, p_WT=vision.p_WT + rng.normal(0.0, 0.5, 3)))
    return replace(measurement, vision=None)


def _somewhere(values: Array, wrong: float, rng: Generator) -> Array:
    out = values.copy()
    out.flat[rng.integers(out.size)] = wrong
    return out
