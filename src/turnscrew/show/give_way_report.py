"""The study of the envelope as it goes on, and its tables and plots when it is done."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from turnscrew.study.envelope.study import Part, load_traces, work, write_results
from turnscrew.study.parts import Done, finish

FIGURES = "figures"
WITHIN = 0.1
"""Difference that still counts as agreement."""


def report(todo: Sequence[Part], jobs: int, out: Path, console: Console, torque: float | None = None) -> None:
    """Runs the study and shows it.

    Args:
        todo: Grasps.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
        torque: At which the grasps' slip and what they have left is told, too [N.m].

    Raises:
        PlanError: no gait fits a handle.
        ScenarioError: a radius or a friction is out of range.
    """
    done: list[tuple[Part, Done]] = []
    bar = Progress(TextColumn("giving way"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console)
    with bar:
        task = bar.add_task("parts", total=len(todo))
        for part, entry in finish(todo, work, jobs):
            done.append((part, entry))
            bar.advance(task)
    done.sort(key=lambda pair: todo.index(pair[0]))
    figures = [entry for _, entry in done]
    console.print(grasp_table(figures))
    console.print(agreement_table(figures))
    if torque is not None:
        console.print(held_table(done, torque))
    places = [write_results(figures, out), *plots(done, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if len(places) == 1:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def grasp_table(done: Sequence[Mapping[str, Any]]) -> Table:
    """One row a grasp: predicted, and what really happened.

    "ratio" is the torque over the prediction for the plan's posture, "there" over that for the posture it gave way in.
    """
    table = Table(title="Torque at which grasps give way, predicted and simulated", box=SIMPLE)
    headings = ("handle [mm]", "friction", "squeeze [N]", "grasp", "at [deg]", "forces", "predicted [N.m]", "limit",
                "gave way [N.m]", "ratio", "there", "how")  # fmt: skip
    for heading in headings:
        table.add_column(escape(heading), no_wrap=True)
    for entry in done:
        table.add_row(
            f"{entry['radius_mm']:g}", f"{entry['friction']:g}", f"{entry['most_n']:g}", entry["grasp"],
            f"{entry['angle_deg']:.0f}", entry["forces"], f"{entry['predicted_nm']:.3f}", entry["limit"],
            f"{entry['gave_way_nm']:.3f}", f"{entry['ratio']:.2f}", f"{entry['gave_way_nm'] / entry['there_nm']:.2f}",
            f"{entry['end']} ({entry['finger']} {entry['slip_mm']:.2f} mm)",
        )  # fmt: skip
    return table


def agreement_table(done: Sequence[Mapping[str, Any]]) -> Table:
    """How well prediction and simulation agree, for each choice of forces and each grasp."""
    table = Table(title="Simulated over predicted", box=SIMPLE)
    for heading in ("forces", "grasp", "cases", "mean", "least", "largest", "within 10 %"):
        table.add_column(escape(heading), no_wrap=True)
    kinds = list(dict.fromkeys((entry["forces"], entry["grasp"]) for entry in done))
    for forces, grasp in kinds:
        ratios = np.array([e["ratio"] for e in done if (e["forces"], e["grasp"]) == (forces, grasp)])
        known = ratios[np.isfinite(ratios)]
        if len(known) == 0:
            table.add_row(forces, grasp, f"{len(ratios)}", *[""] * 4)
            continue
        close = int((np.abs(known - 1.0) < WITHIN).sum())
        figures = (f"{value:.3f}" for value in (known.mean(), known.min(), known.max()))
        table.add_row(forces, grasp, f"{len(ratios)}", *figures, f"{close} of {len(known)}")
    return table


def held_table(done: Sequence[tuple[Part, Done]], torque: float) -> Table:
    """How grasps stand when they hold a torque [N.m] for the first time, a row each; empty where they never do."""
    table = Table(title=f"At {torque:g} N.m", box=SIMPLE)
    for heading in ("handle [mm]", "friction", "squeeze [N]", "grasp", "at [deg]", "slip [mm]", "drive / limit",
                    "from a joint's limit [rad]"):  # fmt: skip
        table.add_column(escape(heading), no_wrap=True)
    for part, entry in done:
        traces = load_traces(part)
        reached = np.flatnonzero(traces["got"] >= torque)
        case = (f"{entry['radius_mm']:g}", f"{entry['friction']:g}", f"{entry['most_n']:g}", entry["grasp"],
                f"{entry['angle_deg']:.0f}")  # fmt: skip
        if len(reached) == 0:
            table.add_row(*case, *[""] * 3)
            continue
        now = slice(0, int(reached[0]) + 1)
        slip, load, room = traces["slip"][now].max(), traces["load"][now].max(), traces["room"][now].min()
        table.add_row(*case, f"{slip * 1e3:.2f}", f"{load:.2f}", f"{room:.3f}")
    return table


def plots(done: Sequence[tuple[Part, Done]], out: Path) -> list[Path]:
    """Agreement of all, and the course of those that disagree, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show import envelope_plots as draw

    folder = out / FIGURES
    made = [draw.agreement([figures for _, figures in done], folder / "agreement.png")]
    for part, figures in done:
        if abs(figures["ratio"] - 1.0) >= WITHIN:
            title = (
                f"{figures['radius_mm']:g} mm, friction {part.friction:g}, {part.most:g} N, {part.grip}, forces "
                f"{part.forces}: predicted {figures['predicted_nm']:.3f} N.m"
            )
            made.append(draw.giving_way(load_traces(part), title, folder / f"{part.file.stem}.png"))
    return made
