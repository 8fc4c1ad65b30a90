"""The study of solvers: random frames and those of recorded runs, IPOPT and SQP on each, and the filter's correction.

A part is as many random frames as are asked for with one number of contacts, or a run with one rbar.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.estimate.reference import Reference
from turnscrew.study.parts import Done, part_file
from turnscrew.study.recording import read
from turnscrew.study.solvers.comparison import Row, compared, solver_figures
from turnscrew.study.solvers.correction_figures import correction_figures, drawn_rows, recorded_rows
from turnscrew.study.solvers.instances import random_frames, replayed
from turnscrew.task.record import SUMMARY
from turnscrew.task.signal_table import write_parquet

RESULTS = ("solvers.parquet", "corrections.parquet")

CONTACTS = (2, 3, 4)
"""Numbers of fingers that hold the tool in a round."""

RANDOM = "random"
RUNS = "recorded"
RECORDED = {Reference.FILTER: "recorded, rbar the filter's", Reference.CAMERA: "recorded, rbar the camera's"}


@dataclass(frozen=True)
class Part:
    """The unit of work.

    Attributes:
        source: `RANDOM` or one of `RECORDED`.
        file: Where its rows go.
        folder: Of the run; None for random frames.
        reference: What rbar is in a run's frames.
        k: Contacts of random frames.
        n: Their number.
        seed: They are drawn from.
    """

    source: str
    file: Path
    folder: Path | None = None
    reference: Reference = Reference.FILTER
    k: int = 0
    n: int = 0
    seed: int = 0


def parts(folders: Sequence[Path], n: int, seed: int, out: Path) -> list[Part]:
    """All units of work.

    Args:
        folders: Of the runs.
        n: Random frames for each number of contacts, and as many random corrections.
        seed: What is random is drawn from it.
        out: Folder of the study.

    Raises:
        ScenarioError: there is nothing to compare on.
    """
    if not folders and n < 1:
        raise ScenarioError("study solvers: no run was named and --random is 0, so there is nothing to compare on")
    found = []
    for k in CONTACTS if n > 0 else ():
        file = part_file(out, f"random-{k}", k, n, seed)
        found.append(Part(RANDOM, file, k=k, n=n, seed=seed))
    for folder in folders:
        stamp = (folder / SUMMARY).stat().st_mtime_ns if (folder / SUMMARY).is_file() else 0
        for reference, source in RECORDED.items():
            file = part_file(out, f"{folder.name}-{reference}", str(folder.resolve()), stamp, reference)
            found.append(Part(source, file, folder, reference))
    return found


def work(part: Part) -> Done:
    """Does one part: a row for each frame and solver, and one for each correction.

    Raises:
        RecordError: the run cannot be read.
    """
    if part.folder is None:
        rng = np.random.default_rng([part.seed, part.k])
        frames = list(random_frames(part.k, part.n, rng))
        corrections = list(drawn_rows(part.k, part.n, rng))
    else:
        recording = read(part.folder)
        replay = replayed(recording, part.reference)
        frames = replay.frames
        # the filter goes the same way whatever rbar is
        corrections = list(recorded_rows(recording, replay)) if part.reference is Reference.FILTER else []
    run = "" if part.folder is None else part.folder.name
    any_rbar = RANDOM if part.folder is None else RUNS
    return {
        "frames": [{"source": part.source, "run": run, **row} for row in compared(frames)],
        "corrections": [{"source": any_rbar, "run": run, **row} for row in corrections],
    }


def write_results(done: Sequence[Done], out: Path) -> list[Path]:
    """Two tables: a row for each frame with both solvers' answers, and a row for each correction."""
    written = []
    for key, name in zip(("frames", "corrections"), RESULTS, strict=True):
        rows = gathered(done, key)
        if rows:
            write_parquet(out / name, {column: np.array([row[column] for row in rows]) for column in rows[0]})
            written.append(out / name)
    return written


def gathered(done: Sequence[Done], key: str) -> list[Row]:
    """All parts' rows of one kind, in a lasting order."""
    return sorted((row for part in done for row in part[key]), key=lambda row: (row["source"], row["run"], row["k"]))


Figures = list[tuple[str, int, dict[str, Any]]]
"""Source, contacts and what was found there."""


def figures(done: Sequence[Done]) -> tuple[Figures, Figures]:
    """Of the solvers and of the corrections: each source with each number of contacts in it, all runs together."""
    return _grouped(gathered(done, "frames"), solver_figures), _grouped(
        gathered(done, "corrections"), correction_figures
    )


def _grouped(rows: Sequence[Row], judge: Callable[[Sequence[Row]], dict[str, Any]]) -> Figures:
    groups: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        if row["k"] in CONTACTS:
            groups.setdefault((row["source"], row["k"]), []).append(row)
    order = [RANDOM, RUNS, *RECORDED.values()]
    return [(*key, judge(groups[key])) for key in sorted(groups, key=lambda key: (order.index(key[0]), key[1]))]
