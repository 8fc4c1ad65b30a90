"""The study of actuation: the same seeds by torques and by positions, condition by condition.  A part is one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.drive_work import read_drives
from turnscrew.study.actuation.conditions import Arm, Condition
from turnscrew.study.actuation.figures import RunFigures, figures_of
from turnscrew.study.actuation.run import make
from turnscrew.study.actuation.trace import Trace
from turnscrew.study.disturbed import GOAL
from turnscrew.study.events import write_events
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import read_signals

RESULTS, PUSHES = "actuation.parquet", "pushes.parquet"


@dataclass(frozen=True)
class ActuationPart:
    """One run.

    Attributes:
        arm: Robot and control.
        condition: What is otherwise than believed.
        seed: Of the run.
        overrides: Of the scenario, for arm and condition too, `key=value` each.
        file: Where the figures go; what is plotted over time lies beside it.
    """

    arm: Arm
    condition: Condition
    seed: int
    overrides: tuple[str, ...]
    file: Path


@dataclass(frozen=True)
class RunRow(RunFigures):
    """One run, as it stands in the table of runs.

    Attributes:
        condition: Its name.
        arm: Its name.
        seed: Of the run.
        outcome: How it ended.
        holds: Whether it has reached its goal.
        rounds: The screw was really turned by.
    """

    condition: str
    arm: str
    seed: int
    outcome: str
    holds: bool
    rounds: int


@dataclass(frozen=True)
class PushRow:
    """One push, as it stands in the table of pushes.

    Attributes:
        condition: Name of the run's.
        arm: Name of the run's.
        seed: Of the run.
        start: When it began [s].
        heading: Its direction, from W's x axis [rad].
        height: Where it acted, along the tool's axis from the tip [m].
    """

    condition: str
    arm: str
    seed: int
    start: float
    heading: float
    height: float


def parts(
    conditions: Sequence[Condition], arms: Sequence[Arm], n: int, seed: int, overrides: Sequence[str], out: Path
) -> list[ActuationPart]:
    """All runs, seed by seed, so that a study that is cut short compares what it has.

    Raises:
        ScenarioError: an override is wrong.
    """
    plain = load(None, overrides, seed)
    found = []
    for number in range(seed, seed + n):
        for condition in conditions:
            for arm in arms:
                wishes = (*overrides, *arm.overrides, *condition.overrides(plain))
                load(None, wishes, number)
                name = f"{condition.name}-{arm.name.replace(' ', '-')}-{number}"
                file = part_file(out, name, "actuation", asdict(condition), number, wishes)
                found.append(ActuationPart(arm, condition, number, wishes, file))
    return found


def work(part: ActuationPart) -> Done:
    """Makes one run, writes what is plotted over time and returns its figures."""
    with TemporaryDirectory() as aside:
        folder = Path(aside)
        made = make(load(None, part.overrides, part.seed), folder, pushed=part.condition.pushed)
        trace = Trace.of(read_signals(folder))
        figures = figures_of(trace, read_drives(folder))
    write_whole(part.file.with_suffix(".npz"), lambda path: _save(path, trace))
    label: Done = {"condition": part.condition.name, "arm": part.arm.name, "seed": part.seed}
    row = {"outcome": made.outcome, "holds": made.outcome == GOAL, "rounds": made.rounds}
    pushes = [label | asdict(push) for push in made.pushes]
    return label | row | asdict(figures) | {"named": made.named, "pushes": pushes}


def write_results(done: Sequence[Done], out: Path) -> list[Path]:
    """Every run and every push, one row each."""
    pushes = [push for entry in done for push in entry["pushes"]]
    return [write_events(RunRow, done, out / RESULTS), write_events(PushRow, pushes, out / PUSHES)]


def load_trace(part: ActuationPart) -> dict[str, Array]:
    """Of a part that is done: `time` (n,) [s], `tilt` (n,) [rad], `tip_error` (n,) [N], `pressed` (n, 5) [N]."""
    with np.load(part.file.with_suffix(".npz")) as arrays:
        return {name: arrays[name].astype(float) for name in arrays.files}


def _save(path: Path, trace: Trace) -> None:
    kept = {name: getattr(trace, name).astype(np.float32) for name in ("time", "tilt", "tip_error", "pressed")}
    with path.open("wb") as file:
        np.savez(file, **kept)
