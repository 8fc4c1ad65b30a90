"""The study of slipping fingers: runs that react, the same runs that do not, and quiet ones; killed, it resumes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.geometry.arrays import Array
from turnscrew.study.events import write_events
from turnscrew.study.finger_slips.events import FingerAlarm, FingerSlipEvent
from turnscrew.study.finger_slips.run import ONLY_WATCHES, QUIET, REACTS, slide
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.task.scenario import load

SLIPS_FILE, ALARMS_FILE, RUNS_FILE = "finger_slips.parquet", "alarms.parquet", "runs.parquet"


@dataclass(frozen=True)
class FingerPart:
    """One run.

    Attributes:
        kind: `REACTS`, `ONLY_WATCHES` or `QUIET`.
        seed: Of the run.
        factor: What a slick finger's friction is multiplied by.
        overrides: Of the scenario, `key=value` each.
        file: Where the findings go; the signals around slips lie beside it.
    """

    kind: str
    seed: int
    factor: float
    overrides: tuple[str, ...]
    file: Path


@dataclass(frozen=True)
class FingerRunRow:
    """One run, as it stands in the table of runs.

    Attributes:
        kind: `REACTS`, `ONLY_WATCHES` or `QUIET`.
        seed: Of the run.
        outcome: How it ended.
        rounds: The screw was really turned by.
        time: It lasted [s].
        slid_mm: Farthest that a finger slid while it touched.
        tilt_deg: Largest tilt of the tool.
    """

    kind: str
    seed: int
    outcome: str
    rounds: int
    time: float
    slid_mm: float
    tilt_deg: float


def parts(n: int, quiet: int, factor: float, seed: int, overrides: Sequence[str], out: Path) -> list[FingerPart]:
    """All runs: n that react and the same n that do not, and so many quiet ones.

    Raises:
        ScenarioError: an override is wrong, or there is nothing to run.
    """
    if n + quiet == 0:
        raise ScenarioError("--n 0 --quiet 0: leaves no run; give at least one of them")
    wishes = tuple(overrides)
    load(None, wishes, seed)
    return [
        FingerPart(
            kind, number, factor, wishes,
            part_file(out, f"{kind.replace(' ', '-')}-{number}", "finger slips", kind, number, factor, wishes),
        )
        for kind, count in ((REACTS, n), (ONLY_WATCHES, n), (QUIET, quiet))
        for number in range(seed, seed + count)
    ]  # fmt: skip


def work(part: FingerPart) -> Done:
    """Makes one run, writes the signals around its slips and returns the events."""
    found = slide(load(None, part.overrides, part.seed), part.kind, part.factor)
    write_whole(part.file.with_suffix(".npy"), lambda path: _save(path, found.signals))
    row = FingerRunRow(part.kind, part.seed, found.outcome, found.rounds, found.time, found.slid_mm, found.tilt_deg)
    events = {"slips": [asdict(slip) for slip in found.slips], "alarms": [asdict(alarm) for alarm in found.alarms]}
    return {**asdict(row), **events}


def write_results(done: Sequence[Done], out: Path) -> list[Path]:
    """Every moment, every alarm of a quiet run and every run, one row each."""
    slips = [slip for entry in done for slip in entry["slips"]]
    alarms = [alarm for entry in done for alarm in entry["alarms"]]
    return [
        write_events(FingerSlipEvent, slips, out / SLIPS_FILE),
        write_events(FingerAlarm, alarms, out / ALARMS_FILE),
        write_events(FingerRunRow, done, out / RUNS_FILE),
    ]


def load_signals(part: FingerPart) -> Array:
    """(k, m) signals around the slips that count of a part that is done."""
    signals: Array = np.load(part.file.with_suffix(".npy"))
    return signals


def _save(path: Path, signals: Array) -> None:
    with path.open("wb") as file:
        np.save(file, signals)
