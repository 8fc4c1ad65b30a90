"""The study of slips: slips of each kind, and runs without any; killed, it resumes.  A part is one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.geometry.arrays import Array
from turnscrew.study.disturbances.tip_slips import OPEN_SLOT
from turnscrew.study.events import write_events
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.study.slips.events import AlarmEvent, SlipEvent
from turnscrew.study.slips.run import QUIET, SLIPS, slide
from turnscrew.task.scenario import load

SLIPS_FILE, ALARMS_FILE, RUNS_FILE = "slips.parquet", "false_alarms.parquet", "runs.parquet"


@dataclass(frozen=True)
class SlipPart:
    """One run.

    Attributes:
        kind: Of the slips, or `QUIET`.
        seed: Of the run.
        overrides: Of the scenario, `key=value` each.
        file: Where the findings go; the signals around slips lie beside it.
    """

    kind: str
    seed: int
    overrides: tuple[str, ...]
    file: Path


@dataclass(frozen=True)
class RunRow:
    """One run, as it stands in the table of runs.

    Attributes:
        kind: Of the slips, or `QUIET`.
        seed: Of the run.
        outcome: How it ended.
        rounds: The screw was really turned by.
        time: It lasted [s].
    """

    kind: str
    seed: int
    outcome: str
    rounds: int
    time: float


def parts(n: int, quiet: int, seed: int, overrides: Sequence[str], out: Path) -> list[SlipPart]:
    """All runs: n with slips of each kind, in an open slot, and so many without slips.

    Raises:
        ScenarioError: an override is wrong, or there is nothing to run.
    """
    if n + quiet == 0:
        raise ScenarioError("--n 0 --quiet 0: leaves no run; give at least one of them")
    found = []
    for kind, count in [*((name, n) for name in SLIPS), (QUIET, quiet)]:
        wishes = (*(() if kind == QUIET else OPEN_SLOT), *overrides)
        load(None, wishes, seed)
        for number in range(seed, seed + count):
            file = part_file(out, f"{kind}-{number}", "slips", kind, number, wishes)
            found.append(SlipPart(kind, number, wishes, file))
    return found


def work(part: SlipPart) -> Done:
    """Makes one run, writes the signals around its slips and returns the events."""
    found = slide(load(None, part.overrides, part.seed), part.kind)
    write_whole(part.file.with_suffix(".npy"), lambda path: _save(path, found.signals))
    row = RunRow(part.kind, part.seed, found.outcome, found.rounds, found.time)
    events = {"slips": [asdict(slip) for slip in found.slips], "alarms": [asdict(alarm) for alarm in found.alarms]}
    return {**asdict(row), **events}


def write_results(done: Sequence[Done], out: Path) -> list[Path]:
    """Every disturbance, every false alarm and every run, one row each."""
    slips = [slip for entry in done for slip in entry["slips"]]
    alarms = [alarm for entry in done for alarm in entry["alarms"]]
    return [
        write_events(SlipEvent, slips, out / SLIPS_FILE),
        write_events(AlarmEvent, alarms, out / ALARMS_FILE),
        write_events(RunRow, done, out / RUNS_FILE),
    ]


def load_signals(part: SlipPart) -> Array:
    """(k, m) signals around the slips that count of a part that is done."""
    signals: Array = np.load(part.file.with_suffix(".npy"))
    return signals


def _save(path: Path, signals: Array) -> None:
    with path.open("wb") as file:
        np.save(file, signals)
