"""All that a study can let go wrong in a run, by name.

One more is one more line: a function that prepares a run for it, by `spoil_sensors` where sensors fail, by the hook
that it returns where something happens to the plant.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from turnscrew.signals import FaultKind
from turnscrew.study.disturbances.camera_faults import dark, flipped
from turnscrew.study.disturbances.disturbance import Disturbance, Hook, Span, idle
from turnscrew.study.disturbances.reading_faults import frozen, no_number, silent
from turnscrew.study.disturbances.spoilt_sensors import Spoil, spoil_sensors
from turnscrew.task.fasten import Run
from turnscrew.task.scenario_keys import Scenario

FRAMES = 5
"""How many frames in a row show a flipped marker."""

FORCE_FAULT = 0.5
"""How long a finger's force sensor fails [s]: a pair takes up its load, or a quarter of a roll."""


def _nothing(run: Run, span: Span, rng: Generator) -> Hook:
    return idle


def spoiling(make: Callable[[Span, Generator], Spoil]) -> Callable[[Run, Span, Generator], Hook]:
    """A disturbance's `put` that spoils measurements in a way drawn for each run."""

    def put(run: Run, span: Span, rng: Generator) -> Hook:
        spoil_sensors(run, make(span, rng))
        return idle

    return put


def seconds(length: float) -> Callable[[Scenario], float]:
    """A disturbance's length, the same in all scenarios."""
    return lambda scenario: length


_dark = spoiling(lambda span, rng: dark(span))

SENSOR_FAULTS = {
    "nothing": Disturbance("no fault: what the estimate errs by anyhow", seconds(2.0), _nothing),
    "dark": Disturbance("the camera is dark for 2 s", seconds(2.0), _dark, FaultKind.VISION_LOST),
    "flipped": Disturbance(
        f"the marker's pose is flipped, {FRAMES} frames long",
        lambda scenario: FRAMES / scenario.vision.rate,
        spoiling(lambda span, rng: flipped(span, rng.uniform(0.0, 2.0 * np.pi))),
        FaultKind.POSE_SUSPECT,
        refusable=True,
    ),
    "dark-short": Disturbance("the camera is dark for .3 s", seconds(0.3), _dark),
    "nan": Disturbance(
        "one reading is no number for a tick",
        lambda scenario: 1.0 / scenario.rate.control,
        spoiling(no_number),
        FaultKind.POSE_SUSPECT,
    ),
    "frozen": Disturbance(f"one finger's force hangs for {FORCE_FAULT:g} s", seconds(FORCE_FAULT), spoiling(frozen)),
    "silent": Disturbance(f"one finger's force is 0 for {FORCE_FAULT:g} s", seconds(FORCE_FAULT), spoiling(silent)),
}
"""Sensor faults; "nothing" is what the others are compared with."""
