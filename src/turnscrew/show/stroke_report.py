"""What one long stroke came to, a line a run, and its plot."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from turnscrew.errors import PlanError
from turnscrew.plant.log import read_log
from turnscrew.robot.joints import DRIVEN
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.task.fasten import fasten
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.signal_table import read_signals
from turnscrew.task.summary import Summary

LOADED = ("roll", "hold")
"""Phases in which the tip's force counts."""


@dataclass(frozen=True, slots=True)
class Stroke:
    """A stroke, by the truth.

    Attributes:
        summary: Of the run.
        load: Largest drive torque over its limit; not a number for a robot that takes positions.
        drive: Which drive's that was.
        thrust: Mean force on the tip in roll and hold [N].
        ripple: Its standard deviation [N].
    """

    summary: Summary
    load: float
    drive: str
    thrust: float
    ripple: float


def strike(scenario: Scenario, folder: Path) -> Stroke:
    """Runs a scenario and reads its record.

    Args:
        scenario: What to run.
        folder: Of the record.
    """
    summary = fasten(scenario, folder)
    load, drive = np.nan, ""
    if scenario.robot.actuation == "torque":
        used = (np.abs(read_log(folder).ctrl[:, : len(DRIVEN)]) / DRIVE_LIMITS).max(axis=0)
        load, drive = float(used.max()), DRIVEN[int(used.argmax())]
    columns = read_signals(folder)
    thrust = columns["truth.F_s.f_z"][np.isin(columns["goal.phase"], LOADED)]
    return Stroke(summary, load, drive, float(thrust.mean()), float(thrust.std()))


def report(scenarios: Sequence[Scenario], out: Path, console: Console) -> bool:
    """Runs scenarios, each into a folder of its own, and prints a line for each; whether all reached their goal.

    A run whose drawn start the fingers cannot reach is told of, and the others go on.

    Args:
        scenarios: With their seeds.
        out: Folder of the runs' folders and of the plot.
        console: Where to.

    Raises:
        PlanError: no run could start.
    """
    done: dict[int, Stroke] = {}
    failed: dict[int, PlanError] = {}
    with console.status("turning") as status:
        for count, scenario in enumerate(scenarios):
            status.update(f"stroke {count + 1} of {len(scenarios)}")
            try:
                done[scenario.seed] = strike(scenario, _folder(out, scenario.seed))
            except PlanError as error:
                failed[scenario.seed] = error
    if not done:
        raise next(iter(failed.values()))
    console.print(_table(done))
    for seed, why in failed.items():
        console.print(f"no start: seed {seed}: {why}", highlight=False, soft_wrap=True)
    if importlib.util.find_spec("matplotlib") is not None:
        from turnscrew.show.stroke_plots import plot

        console.print(f"written: {plot([_folder(out, seed) for seed in done], out)}", highlight=False, soft_wrap=True)
    return not failed and all(stroke.summary.outcome == "goal" for stroke in done.values())


def _folder(out: Path, seed: int) -> Path:
    return out / f"seed-{seed}"


def _table(done: Mapping[int, Stroke]) -> Table:
    """A line for each stroke, by its seed."""
    table = Table("seed", "outcome", "turned deg", "torque N.m", "finger slip mm", "tip slip mm", "tilt deg", "tip N",
                  "torque / limit")  # fmt: skip
    for seed, stroke in done.items():
        told = stroke.summary
        table.add_row(
            str(seed), told.outcome, f"{told.turned_deg:.1f}", f"{told.final_torque_nm:.3f}",
            f"{told.finger_slip_mm:.2f}", f"{told.tip_slip_mm:.2f}", f"{told.max_tilt_deg:.2f}",
            f"{stroke.thrust:.2f} +- {stroke.ripple:.2f}", f"{stroke.load:.2f} {stroke.drive}",
        )  # fmt: skip
    return table
