"""One run of the study: recorded, disturbed, read back, and its record thrown away."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import numpy as np

from turnscrew.plant.truth import Truth
from turnscrew.study.disturbances.disturbance import idle
from turnscrew.study.disturbances.pushes import Push, Pushes
from turnscrew.study.disturbed import turn
from turnscrew.task.fasten import Run, signals
from turnscrew.task.loop import Tick
from turnscrew.task.record import Recorder
from turnscrew.task.scenario_keys import Scenario


@dataclass(frozen=True)
class Made:
    """How a run went.

    Attributes:
        outcome: As `turnscrew.study.disturbed.turn` tells it.
        rounds: The screw was really turned by.
        pushes: The handle was given.
        named: Trouble that was named, and how often.
    """

    outcome: str
    rounds: int
    pushes: tuple[Push, ...]
    named: dict[str, int]


def make(scenario: Scenario, folder: Path, *, pushed: bool) -> Made:
    """Makes a run and leaves in a folder its log, its signals and its model.

    No summary is left: a run that was pushed is no record that could be replayed.  The pushes depend on the seed alone.

    Args:
        scenario: What is run.
        folder: Where to.
        pushed: Whether the handle is pushed.

    Raises:
        PlanError: no plan fits the handle.
        CameraError: the camera's calibration or its markers cannot be used.
        RenderError: pictures are wanted, and this machine cannot draw.
    """
    named: Counter[str] = Counter()
    with Recorder(folder, scenario) as recorder:
        run = Run.begin(scenario)
        recorder.model(run.cell.xml)
        pushes = Pushes(run.cell, np.random.default_rng([scenario.seed, crc32(b"pushes")]))
        push = pushes.step if pushed else idle

        def before() -> None:
            push()
            recorder.step(run.cell.data)

        def see(tick: Tick, truth: Truth) -> None:
            recorder.tick(run.cell.time, **signals(tick, truth))
            named.update(str(fault.kind) for fault in tick.faults)

        with run.cell:
            outcome = turn(run, before, see)
            recorder.step(run.cell.data)
    return Made(outcome, run.judge.rounds, tuple(pushes.made), dict(named))
