"""The study of slipping fingers as it goes on, and its tables and plot when it is done."""

from __future__ import annotations

import importlib.util
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.show.parts_progress import gather
from turnscrew.study.disturbed import GOAL, ONLY_BELIEVED
from turnscrew.study.finger_slips.events import COUNTED, IN_TIME
from turnscrew.study.finger_slips.run import ONLY_WATCHES, QUIET, REACTS
from turnscrew.study.finger_slips.study import FingerPart, load_signals, work, write_results
from turnscrew.study.rates import poisson_upper, wilson

Entry = Mapping[str, Any]


def report(todo: Sequence[FingerPart], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
    """
    done = gather(todo, work, jobs, console, "letting fingers slip")
    entries = [entry for _, entry in done]
    if any(entry["kind"] != QUIET for entry in entries):
        console.print(detection_table(entries))
        console.print(reaction_table(entries))
    for line in quiet_lines([entry for entry in entries if entry["kind"] == QUIET]):
        console.print(line, highlight=False)
    places = [*write_results(entries, out), *_plots(done, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if importlib.util.find_spec("matplotlib") is None:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def detection_table(entries: Sequence[Entry]) -> Table:
    """How soon slips are noticed: one row for runs that react, one for those that do not."""
    shown = Table(title="Slips of a finger by 1 mm", box=SIMPLE)
    headings = ("the robot", "runs", "moments", "slips", f"alarm within {IN_TIME:g} s", "95 % interval",
                "delay [s]: median, 95 %, max", "late", "missed")  # fmt: skip
    for heading in headings:
        shown.add_column(escape(heading))
    for kind in (REACTS, ONLY_WATCHES):
        runs = [entry for entry in entries if entry["kind"] == kind]
        slips = [slip for entry in runs for slip in entry["slips"]]
        counts = Counter(slip["verdict"] for slip in slips)
        counted = sum(counts[name] for name in COUNTED)
        low, high = wilson(counts["in time"], counted)
        share = f" = {100 * counts['in time'] / counted:.0f} %" if counted else ""
        shown.add_row(
            kind, f"{len(runs)}", f"{len(slips)}", f"{counted}", f"{counts['in time']}/{counted}{share}",
            f"{100 * low:.0f} to {100 * high:.0f} %",
            _spread([slip["delay"] for slip in slips if slip["verdict"] in COUNTED and slip["delay"] is not None], 3),
            f"{counts['late']}", f"{counts['missed']}",
        )  # fmt: skip
    return shown


def reaction_table(entries: Sequence[Entry]) -> Table:
    """What the reaction is worth: one row for runs that react, one for those that do not."""
    shown = Table(title="What a slip costs", box=SIMPLE)
    headings = ("the robot", "goal reached", "runs lost, of moments", "95 % interval", "lost by",
                "way of slips by 1 mm [mm]: median, 95 %, max", "farthest of a run [mm]")  # fmt: skip
    for heading in headings:
        shown.add_column(escape(heading))
    for kind in (REACTS, ONLY_WATCHES):
        runs = [entry for entry in entries if entry["kind"] == kind]
        ends = Counter(entry["outcome"] for entry in runs if entry["outcome"] not in (GOAL, ONLY_BELIEVED))
        lost, moments = ends.total(), sum(len(entry["slips"]) for entry in runs)
        low, high = wilson(lost, moments)
        ways = [slip["travel_mm"] for entry in runs for slip in entry["slips"] if slip["rise"] is not None]
        shown.add_row(
            kind, f"{sum(entry['outcome'] == GOAL for entry in runs)}/{len(runs)}", f"{lost}/{moments}",
            f"{100 * low:.0f} to {100 * high:.0f} %", ", ".join(f"{name} {count}" for name, count in ends.items()),
            _spread(ways, 1), _spread([entry["slid_mm"] for entry in runs], 1),
        )  # fmt: skip
    return shown


def quiet_lines(entries: Sequence[Entry]) -> list[str]:
    """Alarms of quiet runs: how many in which time, and how many of them false."""
    if not entries:
        return []
    alarms = [alarm for entry in entries for alarm in entry["alarms"]]
    false = sum(alarm["false"] for alarm in alarms)
    minutes = sum(entry["time"] for entry in entries) / 60.0
    tens = minutes / 10.0
    lines = [
        f"false alarms: {false} in {len(entries)} quiet runs, {minutes:.1f} simulated minutes: {false / tens:.2f} in "
        f"ten minutes (95 %: below {poisson_upper(false) / tens:.2f}); "
        f"{len(alarms) - false} alarms of fingers that slid"
    ]
    lines += [
        f"{'false' if alarm['false'] else 'true'} alarm: seed {alarm['seed']}, {alarm['finger']}, {alarm['phase']} at "
        f"{alarm['start']:.2f} s: {alarm['slid_mm']:.2f} mm"
        for alarm in alarms
    ]
    return lines


def _spread(values: Sequence[float], digits: int) -> str:
    if not values:
        return ""
    shown = (np.median(values), np.percentile(values, 95.0), max(values))
    return ", ".join(f"{value:.{digits}f}" for value in shown)


def _plots(done: Sequence[tuple[FingerPart, Entry]], out: Path) -> list[Path]:
    """The plot, where matplotlib is installed and a finger slipped."""
    slips = [slip for _, entry in done for slip in entry["slips"] if slip["rise"] is not None]
    if not slips or importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show.finger_slips_plots import ways

    signals = [(entry["kind"], load_signals(part)) for part, entry in done if entry["kind"] != QUIET]
    return [ways(slips, signals, out / "figures" / "finger_slips.png")]
