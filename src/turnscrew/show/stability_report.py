"""The study of stability as it goes on, and its table and map when it is done."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path

from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from turnscrew.study.parts import Done, finish
from turnscrew.study.stability.study import Part, agrees, work, write_results

FIGURES = "figures"


def report(todo: Sequence[Part], jobs: int, out: Path, console: Console) -> None:
    """Runs the study and shows it.

    Args:
        todo: Units of work.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.

    Raises:
        ScenarioError: an override is wrong, or a run ended before its grasp was held.
    """
    done: dict[str, Done] = {}
    bar = Progress(TextColumn("disturbing"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console)
    with bar:
        task = bar.add_task("parts", total=len(todo))
        for part, found in finish(todo, work, jobs):
            done[part.case.label] = found
            bar.advance(task)
    in_order = [done[part.case.label] for part in todo]
    cases = [found for found in in_order if found["moved"] != "map"]
    console.print(edge_table(cases))
    close = sum(agrees(found) for found in cases)
    console.print(
        f"{close} of {len(cases)} measured edges lie within one control period, or 25 % of the gain, of the predicted",
        highlight=False,
    )
    places = [write_results(in_order, out), *plots(in_order, out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if len(places) == 1:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def edge_table(cases: Sequence[Done]) -> Table:
    """Predicted and measured edges of a swing of the kick's size, beside that of a loop without dry friction."""
    table = Table(title="Where a held grasp begins to swing", box=SIMPLE)
    headings = ("grasp", "moved", "frictionless", "predicted", "measured", "apart", "swing [rad/s]", "beyond the edge")
    for heading in headings:
        table.add_column(escape(heading), no_wrap=True)
    for found in cases:
        table.add_row(
            escape(found["case"]), found["moved"], _edge(found, found["frictionless"]),
            _edge(found, found["predicted"]), _edge(found, found["measured"]), _apart(found), f"{found['swing']:.0f}",
            _beyond(found),
        )  # fmt: skip
    return table


def plots(done: Sequence[Done], out: Path) -> list[Path]:
    """All plots, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show import stability_plots as draw

    folder = out / FIGURES
    cases = [found for found in done if found["moved"] != "map"]
    made = [draw.edges(cases, folder / "edges.png")]
    made += [draw.gain_map(found, cases, folder / "map.png") for found in done if found["moved"] == "map"]
    return made


def _edge(found: Done, at: float) -> str:
    return f"{1e3 * at * found['period']:.1f} ms" if found["moved"] == "delay" else f"{at:.2f}"


def _apart(found: Done) -> str:
    gap = found["measured"] - found["predicted"]
    if found["moved"] == "delay":
        return f"{gap:+.2f} periods"
    return f"{100 * gap / found['predicted']:+.0f} %"


def _beyond(found: Done) -> str:
    """What became of the tool beyond the edge."""
    beyond = found["beyond"]
    kept = "held" if beyond["holding"] >= beyond["of"] else f"{beyond['holding']} of {beyond['of']} fingers left"
    return f"at {_edge(found, beyond['at'])}: tilt {beyond['tilt_deg']:.1f} deg, {kept}"
