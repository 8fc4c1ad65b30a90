"""The study of estimation: many recorded runs, many ways to measure and to estimate them; killed, it resumes.

A part is a run under one way of measuring.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.study.estimation.figures_of_merit import pose_figures, wrench_figures
from turnscrew.study.estimation.replay import Trace, WrenchTrace, run
from turnscrew.study.estimation.variants import VARIANTS
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.study.recording import read
from turnscrew.task.record import SUMMARY
from turnscrew.task.signal_table import write_parquet

RESULTS = "estimation.parquet"
AS_RECORDED = "as recorded"

NOISE = ((0.001, 0.5), (0.002, 1.0), (0.003, 2.0), (0.005, 3.0), (0.008, 5.0))
"""Levels of synthetic camera noise per axis [m, deg]: from a good marker board to a poor single marker."""

DISTANCE = (0.4, 0.65, 1.0, 1.4)
"""Distances of the rendered camera [m]: from where the collar fills a tracked window to where a marker is 20 px."""


@dataclass(frozen=True)
class Case:
    """One way to measure a run.

    Attributes:
        label: As it stands in tables and plots.
        overrides: Of the scenario, `key=value` each.
        sweep: Which sweep it belongs to: "", "noise" or "distance".
        level: Where on that sweep's axis [mm of noise, m of distance].
    """

    label: str
    overrides: tuple[str, ...]
    sweep: str = ""
    level: float | None = None


@dataclass(frozen=True)
class Part:
    """One run under one case: the unit of work.

    Attributes:
        folder: Of the run.
        case: How it is measured.
        variants: Names of what estimates it.
        file: Where its figures go; its traces lie beside them.
    """

    folder: Path
    case: Case
    variants: tuple[str, ...]
    file: Path


def cases(overrides: Sequence[str], *, noise: bool, distance: bool) -> list[Case]:
    """The ways of measuring: as recorded (or as overridden), and the sweeps that are asked for."""
    own = tuple(overrides)
    found = [Case(", ".join(own) or AS_RECORDED, own)]
    for position, rotation in NOISE if noise else ():
        levels = (f"vision.position_noise={position}", f"vision.rotation_noise={radians(rotation):.6f}")
        label = f"{1e3 * position:g} mm, {rotation:g} deg"
        found.append(Case(label, (*own, "vision.source=noisy-truth", *levels), "noise", 1e3 * position))
    for metres in DISTANCE if distance else ():
        at = ("vision.source=rendered", f"vision.camera.distance={metres}")
        found.append(Case(f"camera at {metres:g} m", (*own, *at), "distance", metres))
    return found


def parts(folders: Sequence[Path], wanted: Sequence[Case], variants: tuple[str, ...], out: Path) -> list[Part]:
    """All units of work; a part's file is named by everything that its figures depend on."""
    found = []
    for folder in folders:
        stamp = (folder / SUMMARY).stat().st_mtime_ns if (folder / SUMMARY).is_file() else 0
        for case in wanted:
            file = part_file(out, folder.name, str(folder.resolve()), stamp, case.overrides, variants)
            found.append(Part(folder, case, variants, file))
    return found


def work(part: Part) -> Done:
    """Estimates one part, writes its traces and returns its figures.

    Raises:
        RecordError: the run cannot be read.
        ScenarioError: an override is wrong.
    """
    traces, wrench = run(read(part.folder, part.case.overrides), part.variants)
    done: Done = {
        "run": part.folder.name,
        "case": part.case.label,
        "sweep": part.case.sweep,
        "level": part.case.level,
        "pose": {trace.name: pose_figures(trace) for trace in traces},
        "wrench": wrench_figures(wrench),
    }
    if not part.case.sweep:
        write_whole(part.file.with_suffix(".npz"), lambda path: _save_traces(path, traces, wrench))
    return done


def write_results(done: Sequence[Done], out: Path) -> Path:
    """All figures in one table of long form: run, case, variant, quantity, statistic, value."""
    rows = [
        (entry["run"], entry["case"], variant, *figure)
        for entry in done
        for variant, figures in [*entry["pose"].items(), ("tip wrench", entry["wrench"])]
        for figure in _leaves(figures)
    ]
    names = ("run", "case", "variant", "quantity", "statistic")
    columns = {name: np.array([row[i] for row in rows], dtype=np.str_) for i, name in enumerate(names)}
    path = out / RESULTS
    write_parquet(path, {**columns, "value": np.array([row[-1] for row in rows], dtype=float)})
    return path


def load_traces(part: Part) -> dict[str, np.ndarray]:
    """Errors over time of a part that is not of a sweep: `MAP.error`, `MAP.time`, `wrench.F_s`, ..."""
    with np.load(part.file.with_suffix(".npz")) as arrays:
        return {name: arrays[name] for name in arrays.files}


def chosen(names: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the variants asked for, all without.

    Raises:
        ScenarioError: there is none of that name.
    """
    known = tuple(variant.name for variant in VARIANTS)
    for name in names or ():
        if name not in known:
            raise ScenarioError(f"--variant {name}: unknown; there are {', '.join(known)}")
    return tuple(name for name in known if not names or name in names)


def _leaves(figures: dict[str, Any], path: str = "") -> Iterator[tuple[str, str, float]]:
    for name, value in figures.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{path}.{name}" if path else name)
        else:
            yield path, name, float(value)


def _save_traces(path: Path, traces: Sequence[Trace], wrench: WrenchTrace) -> None:
    arrays = {
        f"{trace.name}.{field}": getattr(trace, field)
        for trace in traces
        for field in ("time", "error", "held", "sigma", "nees")
    }
    arrays |= {f"wrench.{field}": getattr(wrench, field) for field in ("time", "F_s", "true", "held", "stiffness")}
    with path.open("wb") as file:
        np.savez(file, **arrays)
