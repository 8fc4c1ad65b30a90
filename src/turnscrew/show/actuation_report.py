"""The study of actuation as it goes on, and its tables and plots when it is done."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.show.parts_progress import gather
from turnscrew.study.actuation.conditions import FIXED, TORQUE
from turnscrew.study.actuation.figures import SLIP, WITHIN
from turnscrew.study.actuation.study import ActuationPart, load_trace, work, write_results
from turnscrew.study.rates import wilson

Entry = Mapping[str, Any]

SHORT = f"slips of {1e3 * SLIP:g} mm in {WITHIN:g} s"


def report(todo: Sequence[ActuationPart], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
    """
    done = gather(todo, work, jobs, console, "turning by torques and by positions")
    entries = [entry for _, entry in done]
    for table in (task_table(entries), force_table(entries)):
        console.print(table)
    for condition in dict.fromkeys(part.condition for part in todo):
        console.print(f"[bold]{condition.name}[/]: {condition.meaning}", highlight=False)
    for arm in dict.fromkeys(part.arm for part in todo):
        console.print(f"[bold]{arm.name}[/]: {arm.meaning}", highlight=False)
    for line in [*savings(entries), *lost(entries)]:
        console.print(line, highlight=False)
    places = [*write_results(entries, out), *_plots(done, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if importlib.util.find_spec("matplotlib") is None:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def task_table(entries: Sequence[Entry]) -> Table:
    """How the task was done: one row a condition and arm; figures of runs that reached their goal."""
    title = "The task: median (worst) of the runs that reached their goal"
    headings = ("condition", "arm", "reached", "95 % interval", "screw a round [deg]", "time a round [s]",
                "largest tilt [deg]", "tip force error [N]", "within 1 N", "tip slip [mm]")  # fmt: skip
    shown = _table(title, headings)
    for condition, arm, runs in _groups(entries):
        held = [run for run in runs if run["holds"]]
        low, high = wilson(len(held), len(runs))
        shown.add_row(
            condition, arm, f"{len(held)}/{len(runs)}", f"{100 * low:.0f} to {100 * high:.0f} %",
            _spread([run["turned_deg"] / run["rounds"] for run in held], ".1f", min),
            _spread([run["time"] / run["rounds"] for run in held], ".2f"),
            _spread([run["tilt_deg"] for run in held], ".2f"),
            _spread([run["tip_error"] for run in held], ".2f"),
            _spread([100 * run["tip_close"] for run in held], ".0f", min, " %"),
            _spread([run["tip_slip_mm"] for run in held], ".2f"),
        )  # fmt: skip
    return shown


def force_table(entries: Sequence[Entry]) -> Table:
    """What it cost: pressing forces, sliding, work and heat of the hand's drives."""
    title = "What it costs: median (worst) of the runs that reached their goal"
    headings = ("condition", "arm", "pressing force, mean [N]", "as wanted [N]", "largest [N]",
                "fingers slide a round [mm]", SHORT, "work of the hand a round [J]",
                "heat of the hand a round [N2.m2.s]")  # fmt: skip
    shown = _table(title, headings)
    for condition, arm, runs in _groups(entries):
        held = [run for run in runs if run["holds"]]
        shown.add_row(
            condition, arm,
            _spread([run["pressed"] for run in held], ".2f"),
            _spread([run["asked"] for run in held], ".2f"),
            _spread([run["peak"] for run in held], ".1f"),
            _spread([run["sliding_mm"] / run["rounds"] for run in held], ".2f"),
            _spread([run["slips"] for run in held], ".0f"),
            _spread([run["work_hand"] / run["rounds"] for run in held], ".3f"),
            _spread([run["heat_hand"] / run["rounds"] for run in held], ".2f"),
        )  # fmt: skip
    return shown


def savings(entries: Sequence[Entry]) -> list[str]:
    """A line for each condition and fixed F_0: what optimal forces save against it, on seeds that both reach."""
    lines = []
    for condition, arm, runs in _groups(entries):
        optimal = {e["seed"]: e for e in entries if (e["condition"], e["arm"], e["holds"]) == (condition, TORQUE, True)}
        pairs = [(optimal[run["seed"]], run) for run in runs if run["holds"] and run["seed"] in optimal]
        if not arm.startswith(FIXED) or not pairs:
            continue
        saved = 100 * (1.0 - np.array([one["pressed"] / other["pressed"] for one, other in pairs]))
        slips = [sum(run["slips"] for run in side) for side in zip(*pairs, strict=True)]
        lines.append(
            f"{condition}: optimal forces press {np.median(saved):.0f} % less than {arm} ({saved.min():.0f} to "
            f"{saved.max():.0f} % on {len(pairs)} seeds that both reach), slips {slips[0]} against {slips[1]}"
        )
    return lines


def lost(entries: Sequence[Entry]) -> list[str]:
    """A line for each run that did not reach its goal."""
    return [
        f"lost: {run['condition']}, {run['arm']}, seed {run['seed']}: {run['outcome']} at {run['time']:.2f} s after "
        f"{run['rounds']} rounds"
        for run in entries
        if not run["holds"]
    ]


def _groups(entries: Sequence[Entry]) -> Iterator[tuple[str, str, list[Entry]]]:
    """Condition, arm and its runs, in the order asked for."""
    for condition in dict.fromkeys(entry["condition"] for entry in entries):
        same = [entry for entry in entries if entry["condition"] == condition]
        for arm in dict.fromkeys(entry["arm"] for entry in same):
            yield condition, arm, [entry for entry in same if entry["arm"] == arm]


def _table(title: str, headings: Sequence[str]) -> Table:
    shown = Table(title=title, box=SIMPLE)
    for heading in headings:
        shown.add_column(escape(heading))
    return shown


def _spread(values: Sequence[float], form: str, worst: Any = max, unit: str = "") -> str:
    """Median, and the worst in brackets."""
    return f"{np.median(values):{form}} ({worst(values):{form}}){unit}" if len(values) else ""


def _plots(done: Sequence[tuple[ActuationPart, Entry]], out: Path) -> list[Path]:
    """The plots, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show.actuation_plots import around_pushes, comparison, over_time

    traces = [(entry, load_trace(part)) for part, entry in done]
    folder = out / "figures"
    made = [comparison([entry for _, entry in done], folder / "comparison.png")]
    made.append(over_time(traces, folder / "squeeze.png"))
    if any(entry["pushes"] for _, entry in done):
        made.append(around_pushes(traces, folder / "pushes.png"))
    return made
