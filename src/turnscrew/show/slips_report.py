"""The study of slips as it goes on, and its tables and plot when it is done."""

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
from turnscrew.study.disturbed import CUT_SHORT
from turnscrew.study.rates import poisson_upper, wilson
from turnscrew.study.slips.events import COUNTED, IN_TIME
from turnscrew.study.slips.run import QUIET
from turnscrew.study.slips.study import SlipPart, load_signals, work, write_results

Entry = Mapping[str, Any]

ENDS = {CUT_SHORT: "tip out of its slot"}
"""What the ends of runs mean here, where that is not their name."""


def report(todo: Sequence[SlipPart], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
    """
    done = gather(todo, work, jobs, console, "letting the tip slip")
    entries = [entry for _, entry in done]
    if any(entry["kind"] != QUIET for entry in entries):
        console.print(slip_table(entries))
    for line in [*failures(entries), *quiet_lines([entry for entry in entries if entry["kind"] == QUIET])]:
        console.print(line, highlight=False)
    places = [*write_results(entries, out), *_plots(done, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if importlib.util.find_spec("matplotlib") is None:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def slip_table(entries: Sequence[Entry]) -> Table:
    """One row a kind of slip, and one for all."""
    shown = Table(title="Slips of the tip by 1 mm", box=SIMPLE)
    headings = ("kind", "runs", "slips", f"alarm within {IN_TIME:g} s", "95 % interval", "delay [s]: median, 95 %, max",
                "late", "missed", "disturbances that do not count")  # fmt: skip
    for heading in headings:
        shown.add_column(escape(heading))
    slipping = [entry for entry in entries if entry["kind"] != QUIET]
    kinds = list(dict.fromkeys(entry["kind"] for entry in slipping))
    for name, members in [*((kind, {kind}) for kind in kinds), ("all", set(kinds))]:
        runs = [entry for entry in slipping if entry["kind"] in members]
        shown.add_row(name, f"{len(runs)}", *_slip_cells([slip for entry in runs for slip in entry["slips"]]))
    return shown


def failures(entries: Sequence[Entry]) -> list[str]:
    """A line for each slip that was missed or found late, and for each run that did not reach its goal."""
    lines = []
    for entry in entries:
        for slip in entry["slips"]:
            if slip["verdict"] in ("late", "missed"):
                when = "" if slip["delay"] is None else f" by {slip['delay'] - IN_TIME:.2f} s"
                lines.append(
                    f"{slip['verdict']}{when}: {slip['kind']}, seed {slip['seed']}, {slip['phase']} at "
                    f"{slip['start']:.2f} s: 1 mm within {slip['rise']:.3f} s, {slip['travel_mm']:.1f} mm in all, "
                    f"signal {slip['signal']:.2f} of 1"
                )
    ends = Counter((entry["kind"], entry["outcome"]) for entry in entries)
    told = ", ".join(f"{kind} {ENDS.get(outcome, outcome)} {count}" for (kind, outcome), count in ends.items())
    return [*lines, f"runs ended with: {told}"]


def quiet_lines(entries: Sequence[Entry]) -> list[str]:
    """False alarms: how many in which time, and how sure their rate is."""
    if not entries:
        return []
    alarms = [alarm for entry in entries for alarm in entry["alarms"]]
    minutes = sum(entry["time"] for entry in entries) / 60.0
    tens = minutes / 10.0
    lines = [
        f"false alarms: {len(alarms)} in {len(entries)} runs without slips, {minutes:.1f} simulated minutes: "
        f"{len(alarms) / tens:.2f} in ten minutes (95 %: below {poisson_upper(len(alarms)) / tens:.2f})"
    ]
    lines += [
        f"false alarm: seed {alarm['seed']}, {alarm['phase']} at {alarm['start']:.2f} s: signal {alarm['signal']:.2f}"
        for alarm in alarms
    ]
    return lines


def _slip_cells(slips: Sequence[Entry]) -> list[str]:
    counted = [slip for slip in slips if slip["verdict"] in COUNTED]
    counts = Counter(slip["verdict"] for slip in slips)
    low, high = wilson(counts["in time"], len(counted))
    delays = np.array([slip["delay"] for slip in counted if slip["delay"] is not None])
    spread = f"{np.median(delays):.3f}, {np.percentile(delays, 95.0):.3f}, {delays.max():.3f}" if len(delays) else ""
    share = f" = {100 * counts['in time'] / len(counted):.0f} %" if counted else ""
    left_out = ", ".join(f"{name} {count}" for name, count in counts.items() if name not in COUNTED)
    return [
        f"{len(counted)}", f"{counts['in time']}/{len(counted)}{share}", f"{100 * low:.0f} to {100 * high:.0f} %",
        spread, f"{counts['late']}", f"{counts['missed']}", left_out,
    ]  # fmt: skip


def _plots(done: Sequence[tuple[SlipPart, Entry]], out: Path) -> list[Path]:
    """The plot, where matplotlib is installed and something slipped."""
    slips = [slip for _, entry in done for slip in entry["slips"] if slip["verdict"] in COUNTED]
    if not slips or importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show.slips_plots import delays

    signals = [(entry["kind"], load_signals(part)) for part, entry in done if entry["kind"] != QUIET]
    return [delays(slips, signals, out / "figures" / "slips.png")]
