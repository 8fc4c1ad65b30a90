"""One run with slips of the tip, or with none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias
from zlib import crc32

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.study.disturbances.disturbance import idle
from turnscrew.study.disturbances.tip_slips import Slip, Slips
from turnscrew.study.disturbed import turn
from turnscrew.study.slips.events import COUNTED, AlarmEvent, SlipEvent, SlipWatch, around, false_alarms, slip_event
from turnscrew.task.fasten import Run
from turnscrew.task.scenario_keys import Scenario

QUIET = "quiet"
"""The kind of a run without slips."""

Make: TypeAlias = Callable[[Run, Generator], Slips]

SLIPS: dict[str, Make] = {
    "knock": lambda run, rng: Slips(run.cell, rng, "knock"),
    "slick": lambda run, rng: Slips(run.cell, rng, "slick"),
}
"""What makes the tip slip again and again, by name; what has been made stands in `made`."""


@dataclass(frozen=True)
class SlipRun:
    """A run that is over.

    Attributes:
        outcome: How it ended.
        rounds: The screw was really turned by.
        time: It lasted [s].
        slips: Disturbances of the tip.
        alarms: False ones; looked for where nothing was disturbed.
        signals: (k, m) signal around each slip that counts, against its millimetre, at the ticks of `WINDOW`.
    """

    outcome: str
    rounds: int
    time: float
    slips: tuple[SlipEvent, ...]
    alarms: tuple[AlarmEvent, ...]
    signals: Array


def slide(scenario: Scenario, kind: str) -> SlipRun:
    """Runs a scenario with slips of a kind of `SLIPS`, or with none (`QUIET`).

    A run with slips ends when the tip has left its slot.

    Raises:
        PlanError: no plan fits the handle.
        CameraError: the camera's calibration or its markers cannot be used.
        RenderError: pictures are wanted, and this machine cannot draw.
    """
    run, watch, seed = Run.begin(scenario), SlipWatch(), scenario.seed
    made: list[Slip] = []
    with run.cell:
        if kind == QUIET:
            outcome = turn(run, idle, watch.see)
        else:
            slips = SLIPS[kind](run, np.random.default_rng([seed, crc32(kind.encode())]))
            made = slips.made
            outcome = turn(run, slips.step, watch.see, enough=watch.left)
    events = tuple(slip_event(slip, kind, seed, watch) for slip in made)
    counted = [slip for slip, event in zip(made, events, strict=True) if event.verdict in COUNTED]
    return SlipRun(
        outcome=outcome,
        rounds=run.judge.rounds,
        time=watch.time[-1],
        slips=events,
        alarms=tuple(false_alarms(seed, watch)) if kind == QUIET else (),
        signals=np.array([around(slip, watch, 1.0 / scenario.rate.control) for slip in counted]),
    )
