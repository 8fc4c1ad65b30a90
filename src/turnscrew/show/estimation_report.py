"""The study of estimation as it goes on, and its tables and plots when it is done."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.show.parts_progress import gather
from turnscrew.study.estimation.study import Part, load_traces, work, write_results
from turnscrew.study.estimation.variants import VARIANTS
from turnscrew.study.parts import Done

FIGURES = "figures"
SWEEPS = {"noise": "noise per axis of the synthetic camera [mm]", "distance": "distance of the rendered camera [m]"}


def report(todo: Sequence[Part], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.

    Raises:
        RecordError: a run cannot be read.
    """
    done = gather(todo, work, jobs, console, "estimating")
    own = [(part, figures) for part, figures in done if not part.case.sweep]
    console.print(pose_table([figures for _, figures in own]))
    console.print(wrench_table([figures for _, figures in own]))
    for variant in VARIANTS:
        if variant.name in own[0][1]["pose"]:
            console.print(f"[bold]{variant.name}[/]: {variant.meaning}", highlight=False)
    places = [write_results([figures for _, figures in done], out), *plots(done, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if len(places) == 1:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def pose_table(done: Sequence[Mapping[str, Any]]) -> Table:
    """Errors of the pose, median over runs, and the worst run's rms."""
    title = f"Tool pose while two fingers hold, {len(done)} runs: rms (worst run), 95 %, largest"
    table = Table(title=title, box=SIMPLE)
    headings = ("from", "tip [mm]", "tilt [deg]", "yaw [deg]", "NEES (6), in 95 %", "solve [ms], p99", "solved")
    for heading in headings:
        table.add_column(escape(heading), no_wrap=True)
    for name in done[0]["pose"]:
        figures = [entry["pose"][name] for entry in done]
        cells = [_errors([figure["held"][key] for figure in figures]) for key in ("position_mm", "tilt_deg", "yaw_deg")]
        table.add_row(name, *cells, _nees(figures), _solve(figures), _solved(figures))
    return table


def wrench_table(done: Sequence[Mapping[str, Any]]) -> Table:
    """Errors of the tip wrench, median over runs."""
    table = Table(title="Wrench of the screw on the tip: rms error (worst run), 95 %, largest", box=SIMPLE)
    for heading in ("component", "error", "rms error over rms truth"):
        table.add_column(escape(heading), no_wrap=True)
    for name, unit, digits in (("f_z", "N", 2), ("f_xy", "N", 2), ("tau_z", "N.m", 4)):
        figures = [entry["wrench"][name] for entry in done]
        relative = [figure["relative"] for figure in figures if "relative" in figure]
        share = f"{100 * median(relative):.1f} % (worst {100 * max(relative):.1f} %)" if relative else ""
        table.add_row(escape(f"{name} [{unit}]"), _errors(figures, digits), share)
    return table


def plots(done: Sequence[tuple[Part, Done]], out: Path) -> list[Path]:
    """All plots, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show import estimation_plots as draw

    folder = out / FIGURES
    own = [(part, figures) for part, figures in done if not part.case.sweep]
    names = list(own[0][1]["pose"])
    traces = [load_traces(part) for part, _ in own]
    made = [
        draw.ablation([figures for _, figures in own], folder / "ablation.png"),
        draw.over_time(traces[0], names, folder / "over_time.png"),
        draw.wrench(traces[0], folder / "wrench.png"),
    ]
    if "MAP" in names:
        made.append(draw.consistency(traces, folder / "consistency.png"))
    for sweep, label in SWEEPS.items():
        part = [figures for _, figures in done if figures["sweep"] == sweep]
        if part:
            made.append(draw.sweep(part, label, folder / f"{sweep}.png"))
    return made


def _errors(spreads: Sequence[Mapping[str, float]], digits: int = 2) -> str:
    rms = [spread["rms"] for spread in spreads]
    p95, largest = median(spread["p95"] for spread in spreads), max(spread["max"] for spread in spreads)
    return f"{median(rms):.{digits}f} ({max(rms):.{digits}f}) {p95:.{digits}f} {largest:.{digits}f}"


def _nees(figures: Sequence[Mapping[str, Any]]) -> str:
    known = [figure["nees"] for figure in figures if "nees" in figure]
    if not known:
        return ""
    return f"{median(n['mean'] for n in known):.1f}, {100 * median(n['within_95'] for n in known):.0f} %"


def _solve(figures: Sequence[Mapping[str, Any]]) -> str:
    known = [figure["solve_ms"] for figure in figures if "solve_ms" in figure]
    if not known:
        return ""
    return f"{median(k['median'] for k in known):.2f}, {median(k['p99'] for k in known):.1f}"


def _solved(figures: Sequence[Mapping[str, Any]]) -> str:
    counts = [figure["status"] for figure in figures if "status" in figure]
    good = sum(count.get("warm", 0) + count.get("cold", 0) for count in counts)
    total = sum(sum(value for name, value in count.items() if name != "no contact") for count in counts)
    return f"{100 * good / total:.1f} %" if total else ""
