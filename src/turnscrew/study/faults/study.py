"""The study of sensor faults: each kind over many runs; killed, it resumes.  A part is one run with one fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.geometry.arrays import Array
from turnscrew.study.disturbances.table import SENSOR_FAULTS
from turnscrew.study.events import write_events
from turnscrew.study.faults.events import FaultEvent
from turnscrew.study.faults.run import disturb
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.task.scenario import load

RESULTS = "faults.parquet"

TWO_ROUNDS = "goal.rounds=2"
"""What is run unless told otherwise: fault and recovery lie within two rounds."""


@dataclass(frozen=True)
class FaultPart:
    """One run with one fault.

    Attributes:
        kind: Name of the fault.
        seed: Of the run.
        overrides: Of the scenario, `key=value` each.
        file: Where the finding goes; the errors over time lie beside it.
    """

    kind: str
    seed: int
    overrides: tuple[str, ...]
    file: Path


def parts(kinds: Sequence[str], n: int, seed: int, overrides: Sequence[str], out: Path) -> list[FaultPart]:
    """All runs, kind by kind.

    Raises:
        ScenarioError: an override is wrong.
    """
    wishes = (TWO_ROUNDS, *overrides)
    load(None, wishes, seed)
    return [
        FaultPart(kind, number, wishes, part_file(out, f"{kind}-{number}", "faults", kind, number, wishes))
        for kind in kinds
        for number in range(seed, seed + n)
    ]


def chosen(names: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the faults asked for, all without.

    Raises:
        ScenarioError: there is none of that name.
    """
    for name in names or ():
        if name not in SENSOR_FAULTS:
            raise ScenarioError(f"--fault {name}: unknown; there are {', '.join(SENSOR_FAULTS)}")
    return tuple(name for name in SENSOR_FAULTS if not names or name in names)


def work(part: FaultPart) -> Done:
    """Makes one run, writes its errors over time and returns the event."""
    event, time, error = disturb(load(None, part.overrides, part.seed), part.kind)
    write_whole(part.file.with_suffix(".npz"), lambda path: _save(path, time, error))
    return asdict(event)


def write_results(done: Sequence[Done], out: Path) -> Path:
    """Every injected fault, one row each."""
    return write_events(FaultEvent, done, out / RESULTS)


def load_trace(part: FaultPart) -> dict[str, Array]:
    """Errors of a part that is done: `time` (m,) from the fault's begin [s], `error` (m, 3) [mm, deg, deg]."""
    with np.load(part.file.with_suffix(".npz")) as arrays:
        return {name: arrays[name] for name in arrays.files}


def _save(path: Path, time: Array, error: Array) -> None:
    with path.open("wb") as file:
        np.savez(file, time=time, error=error)
