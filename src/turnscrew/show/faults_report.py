"""The study of sensor faults as it goes on, and its table and plot when it is done."""

from __future__ import annotations

import importlib.util
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.show.parts_progress import gather
from turnscrew.signals import FaultKind
from turnscrew.study.disturbances.table import SENSOR_FAULTS
from turnscrew.study.disturbed import GOAL
from turnscrew.study.faults.events import AFTER
from turnscrew.study.faults.study import FaultPart, load_trace, work, write_results

Event = Mapping[str, Any]

COLUMNS = (("tip_mm", "tip [mm]"), ("tilt_deg", "tilt [deg]"), ("yaw_deg", "yaw [deg]"))
BOUND = 1.0
"""What errors should stay within [mm, deg]."""


def report(todo: Sequence[FaultPart], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
    """
    done = gather(todo, work, jobs, console, "spoiling sensors")
    events = [event for _, event in done]
    console.print(table(events))
    console.print(
        f"Errors: the largest from the fault's begin to {AFTER:g} s after its end, median over runs (worst run), and "
        f"in how many runs it stayed within {BOUND:g} mm or deg.  Healthy: time from the fault's end until nothing was "
        "named any more, median (longest).",
        highlight=False,
    )
    for line in odd(events):
        console.print(line, highlight=False)
    places = [write_results(events, out), *_plots(done, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if len(places) == 1:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def table(events: Sequence[Event]) -> Table:
    """One row a kind of fault."""
    shown = Table(title="Sensor faults while the tool is turned or handed over", box=SIMPLE)
    headings = ("fault", *(title for _, title in COLUMNS), "named (runs, after [s])", "refused", "healthy [s]", "goal")
    for heading in headings:
        shown.add_column(escape(heading), overflow="fold")
    for kind in dict.fromkeys(event["kind"] for event in events):
        of_kind = [event for event in events if event["kind"] == kind]
        reached = sum(event["outcome"] == GOAL for event in of_kind)
        shown.add_row(
            SENSOR_FAULTS[kind].meaning,
            *(_errors([event[name] for event in of_kind]) for name, _ in COLUMNS),
            _named(of_kind),
            _refused(of_kind),
            _healthy(of_kind),
            f"{reached}/{len(of_kind)}",
        )
    return shown


def odd(events: Sequence[Event]) -> list[str]:
    """A line for each run that missed its goal, and for each fault that should have been named and was not."""
    known = {GOAL, *(str(kind) for kind in FaultKind)}
    lines = []
    for event in events:
        where = f"{event['kind']}, seed {event['seed']}, {event['phase']} at {event['start']:.2f} s"
        if event["outcome"] not in known:
            lines.append(f"[red]unnamed outcome[/]: {where}: {event['outcome']}")
        elif event["outcome"] != GOAL:
            lines.append(f"goal missed: {where}: {event['outcome']} at {event['time']:.2f} s")
        if event["expected"] and event["expected_s"] is None:
            lines.append(f"{event['expected']} not named: {where}")
    if all(event["outcome"] in known for event in events):
        lines.append("unnamed outcomes: none")
    return lines


def _errors(values: Sequence[float]) -> str:
    within = sum(value <= BOUND for value in values)
    return f"{median(values):.2f} ({np.nanmax(values):.2f}) {within}/{len(values)}"


def _named(events: Sequence[Event]) -> str:
    """Each name, in how many runs; for the expected one also after how long, median."""
    counts = Counter(name for event in events for name in event["named"].split())
    delays = [event["expected_s"] for event in events if event["expected_s"] is not None]
    after = f", {median(delays):.2f}" if delays else ""
    expected = events[0]["expected"]
    return "  ".join(f"{name} ({count}{after if name == expected else ''})" for name, count in counts.items())


def _refused(events: Sequence[Event]) -> str:
    frames = sum(event["frames"] for event in events)
    return f"{sum(event['refused'] for event in events)}/{frames}" if frames else ""


def _healthy(events: Sequence[Event]) -> str:
    times = [event["healthy_s"] for event in events if event["healthy_s"] is not None]
    never = f", never {len(events) - len(times)}" if len(times) < len(events) else ""
    return f"{median(times):.2f} ({max(times):.2f}){never}" if times else never.removeprefix(", ")


def _plots(done: Sequence[tuple[FaultPart, Event]], out: Path) -> list[Path]:
    """The plot, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show.faults_plots import over_time

    runs = [(event, load_trace(part)) for part, event in done]
    return [over_time(runs, out / "figures" / "faults.png")]
