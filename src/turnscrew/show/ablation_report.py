"""The study of what makes the gait robust as it goes on, and its table and plot when it is done."""

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
from turnscrew.study.ablation.measures import ALL, Measure
from turnscrew.study.ablation.study import AblationPart, work, write_results
from turnscrew.study.rates import wilson

Entry = Mapping[str, Any]


def report(todo: Sequence[AblationPart], measures: Sequence[Measure], jobs: int, out: Path, console: Console) -> None:
    """Makes the trials and shows what each measure is worth.

    Args:
        todo: Units of work.
        measures: What is taken away.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
    """
    entries = [entry for _, entry in gather(todo, work, jobs, console, "trials without one measure")]
    console.print(worth_table(entries))
    for measure in measures:
        title = measure.name if measure is ALL else f"without {measure.name}"
        console.print(f"[bold]{title}[/]: {measure.meaning}", highlight=False)
    for line in failures(entries):
        console.print(line, highlight=False, soft_wrap=True)
    places = [write_results(entries, out), *_plots(entries, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if importlib.util.find_spec("matplotlib") is None:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def worth_table(entries: Sequence[Entry]) -> Table:
    """One row a measure: how many trials come in without it, and how well those do."""
    shown = Table(title="Without one measure at a time: medians (worst) of the trials that passed", box=SIMPLE)
    for heading in ("without", "passed", "95 % interval", "rounds, mean of all", "turning speed [deg/s]",
                    "largest tilt [deg]", "tip slip [mm]", "fingers slide [mm]"):  # fmt: skip
        shown.add_column(escape(heading))
    for name, trials in grouped(entries):
        passed = [trial for trial in trials if trial["passed"]]
        low, high = wilson(len(passed), len(trials))
        shown.add_row(
            "nothing" if name == ALL.name else name, f"{len(passed)}/{len(trials)}",
            f"{100 * low:.0f} to {100 * high:.0f} %", f"{np.mean([trial['rounds'] for trial in trials]):.2f}",
            _spread(passed, "deg_per_s", ".1f", min), _spread(passed, "max_tilt_deg", ".2f"),
            _spread(passed, "tip_slip_mm", ".2f"), _spread(passed, "finger_slip_mm", ".2f"),
        )  # fmt: skip
    return shown


def failures(entries: Sequence[Entry]) -> list[str]:
    """A line for each measure and way to fail."""
    lines = []
    for name, trials in grouped(entries):
        for outcome in dict.fromkeys(trial["outcome"] for trial in trials if not trial["passed"]):
            lost = [trial for trial in trials if trial["outcome"] == outcome and not trial["passed"]]
            where = ", ".join(f"{trial['seed']} ({trial['phase'] or 'start'})" for trial in lost)
            lines.append(f"without {name}: {len(lost)} x {outcome}: {where}")
    return lines


def grouped(entries: Sequence[Entry]) -> Iterator[tuple[str, list[Entry]]]:
    """Each measure and the trials without it."""
    for name in dict.fromkeys(entry["without"] for entry in entries):
        yield name, [entry for entry in entries if entry["without"] == name]


def _spread(trials: Sequence[Entry], column: str, form: str, worst: Any = max) -> str:
    """Median, and the worst in brackets."""
    values = [trial[column] for trial in trials]
    return f"{np.median(values):{form}} ({worst(values):{form}})" if values else ""


def _plots(entries: Sequence[Entry], out: Path) -> list[Path]:
    """The plot, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show.ablation_plots import worth

    return [worth(list(grouped(entries)), out / "figures" / "ablation.png")]
