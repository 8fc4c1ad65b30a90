"""The study of solvers as it goes on, and its tables when it is done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.show.parts_progress import gather
from turnscrew.study.solvers.comparison import REACHED
from turnscrew.study.solvers.study import Figures, Part, figures, work, write_results

MEANING = (
    ("found", "the solver is content and every bound of (1)-(5) holds to .1 micrometre"),
    ("SQP reaches it", f"SQP found an answer too, its (r . rbar)^2 at most {REACHED:g} below IPOPT's"),
    ("SQP better", f"its (r . rbar)^2 is more than {REACHED:g} above IPOPT's"),
    ("bounds violated by", "IPOPT's and SQP's answers, at most, in units of 10 mm, of radians and of sines"),
    ("NEES", "errors squared over their covariance; in brackets where an honest covariance puts it in 95 % of tries"),
)


def report(todo: Sequence[Part], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results go.
        console: Where progress and tables are shown.

    Raises:
        RecordError: a run cannot be read.
    """
    done = [rows for _, rows in gather(todo, work, jobs, console, "solving")]
    solvers, corrections = figures(done)
    for table in (answer_table(solvers), time_table(solvers), correction_table(corrections)):
        console.print(table)
    for line in _statuses(solvers):
        console.print(line, highlight=False, soft_wrap=True)
    for word, meaning in MEANING:
        console.print(f"[bold]{word}[/]: {meaning}", highlight=False)
    if jobs > 1:
        console.print("processes that run side by side share caches: for the times, --jobs 1", highlight=False)
    written = ", ".join(str(path) for path in write_results(done, out))
    console.print(f"written: {written}", highlight=False, soft_wrap=True)


def answer_table(found: Figures) -> Table:
    """Whether SQP reaches IPOPT's answers, and what it says where there are none."""
    headings = ("frames", "fingers", "n", "IPOPT found", "SQP reaches it", "where not, SQP said", "short by, most",
                "SQP better", "IPOPT found none, SQP said", "bounds violated by")  # fmt: skip
    table = _table("Answers: SQP against IPOPT", headings)
    for source, k, group in found:
        table.add_row(
            source,
            str(k),
            str(group["n"]),
            _share(group["ipopt_found"], group["n"]),
            _share(group["reached"], group["ipopt_found"]),
            _counts(group["missed"]),
            f"{group['short']:.0e}",
            str(group["better"]),
            _counts(group["none"]),
            " and ".join(f"{group[name]['violation']:.0e}" for name in ("ipopt", "sqp")),
        )
    return table


def time_table(found: Figures) -> Table:
    """How long the solvers take the processor, taking turns in one process."""
    headings = ("frames", "fingers", "IPOPT [ms], p99", "SQP [ms], p99", "ratio of medians",
                "IPOPT steps, p99", "SQP steps, p99")  # fmt: skip
    table = _table("Processor time of a solve, median and 99 %", headings)
    for source, k, group in found:
        times = [_pair(group[name]["ms"], 2) for name in ("ipopt", "sqp")]
        steps = [_pair(group[name]["iterations"], 0) for name in ("ipopt", "sqp")]
        table.add_row(source, str(k), *times, f"{group['ratio']:.1f}", *steps)
    return table


def correction_table(found: Figures) -> Table:
    """The filter's correction: time and consistency."""
    headings = ("corrections", "fingers", "n", "all taken in", "[ms], p99", "steps, p99", "NEES pose (6)",
                "in its 95 %", "NEES lasting states (27)", "in its 95 %")  # fmt: skip
    table = _table("The filter's correction (MAP)", headings)
    for source, k, group in found:
        cells = [_pair(group["ms"], 3), _pair(group["steps"], 0)]
        # those of a run follow each other, so nothing tells where their mean should lie
        alone = "lasting" in group
        table.add_row(
            source,
            str(k),
            str(group["n"]),
            _share(group["taken"], group["n"]),
            *cells,
            *_consistency(group["pose"], banded=alone),
            *(_consistency(group["lasting"], banded=True) if alone else ("", "")),
        )
    return table


def _table(title: str, headings: Sequence[str]) -> Table:
    table = Table(title=title, box=SIMPLE)
    for heading in headings:
        table.add_column(escape(heading))
    return table


def _counts(said: Mapping[str, int]) -> str:
    return ", ".join(f"{status} {count}" for status, count in sorted(said.items())) or "-"


def _share(part: int, whole: int) -> str:
    return f"{part} ({100 * part / whole:.2f} %)" if whole else "-"


def _pair(values: Mapping[str, float], digits: int) -> str:
    return f"{values['median']:.{digits}f}, {values['p99']:.{digits}f}"


def _consistency(found: Mapping[str, Any], *, banded: bool) -> tuple[str, str]:
    mean, within = f"{found['mean']:.2f}", f"{100 * found['within']:.1f} %"
    if not banded:
        return mean, within
    (low, high), (least, most) = found["band"], found["within_band"]
    return escape(f"{mean} [{low:.2f}, {high:.2f}]"), escape(f"{within} [{100 * least:.1f}, {100 * most:.1f}]")


def _statuses(found: Figures) -> list[str]:
    """What each solver said, one line each group."""
    lines = []
    for source, k, group in found:
        said = [f"{name} said {_counts(group[key]['status'])}" for name, key in (("IPOPT", "ipopt"), ("SQP", "sqp"))]
        lines.append(escape(f"{source}, {k} fingers: {'; '.join(said)}"))
    return lines
