"""What grasps can give, as tables, Parquet and a plot; and the study that compares it with the simulated cell."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.contact.envelope import Verdict
from turnscrew.task.envelope import Envelope, Grip, Moment
from turnscrew.task.seating import SIZES, seated_by
from turnscrew.task.signal_table import write_parquet

RESULTS, FIGURE = "envelope.parquet", "envelope.png"

NAMED = 2
"""How many of the limits that bind stand in the table; the file has them all."""


def report(envelopes: Sequence[Envelope], out: Path, console: Console) -> None:
    """Shows envelopes, and writes them down.

    Args:
        envelopes: One for each handle and friction.
        out: Where table and plot go.
        console: Where tables are shown.
    """
    if len(envelopes) == 1:
        console.print(angle_table(envelopes[0]))
    console.print(summary_table(envelopes))
    seats = ", ".join(f"{size.name} {size.seating_torque:.2f}" for size in SIZES)
    console.print(f"seating takes, in N.m: {seats} (class 4.6, 75 % of the proof load, dry)", highlight=False)
    out.mkdir(parents=True, exist_ok=True)
    places = [write_envelopes(envelopes, out)]
    if importlib.util.find_spec("matplotlib") is None:
        console.print("no plot without matplotlib: pip install 'turnscrew[plots]'", highlight=False)
    else:
        from turnscrew.show.envelope_plots import over_stroke

        places.append(over_stroke(envelopes, out / FIGURE))
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)


def angle_table(found: Envelope) -> Table:
    """Torque and what binds, angle by angle."""
    title = (
        f"Largest steady torque in N.m, handle {found.radius * 1e3:g} mm, friction {found.friction:g}, "
        f"squeeze up to {found.most:g} N; what binds, and its share"
    )
    table = Table(title=title, box=SIMPLE)
    table.add_column(escape("angle [deg]"), justify="right", no_wrap=True)
    for grip in Grip:
        table.add_column(str(grip), no_wrap=True)
    for row in zip(*(found.of(grip) for grip in Grip), strict=True):
        table.add_row(f"{np.degrees(row[0].angle):.0f}", *(_cell(moment) for moment in row))
    return table


def summary_table(envelopes: Sequence[Envelope]) -> Table:
    """What each grasp gives over the whole stroke, and what that seats."""
    table = Table(title="Over the whole stroke", box=SIMPLE)
    for heading in ("handle [mm]", "friction", "grasp", "least [N.m]", "at [deg]", "bound by", "largest", "seats"):
        table.add_column(escape(heading), no_wrap=True)
    for found in envelopes:
        for grip in Grip:
            weakest = found.weakest(grip)
            steady = weakest.steady
            largest = max(moment.steady.torque for moment in found.of(grip))
            size = seated_by(steady.torque)
            table.add_row(
                f"{found.radius * 1e3:g}", f"{found.friction:g}", str(grip), f"{steady.torque:.3f}",
                f"{np.degrees(weakest.angle):.0f}", _limits(weakest), f"{largest:.3f}",
                "none of M2 to M6" if size is None else f"up to {size.name}",
            )  # fmt: skip
    return table


def write_envelopes(envelopes: Sequence[Envelope], out: Path) -> Path:
    """One row for each handle, friction, grasp and angle."""
    rows = [(found, moment) for found in envelopes for moment in found.moments]
    steady = [moment.steady for _, moment in rows]
    columns = {
        "radius": np.array([found.radius for found, _ in rows]),
        "friction": np.array([found.friction for found, _ in rows]),
        "most": np.array([found.most for found, _ in rows]),
        "grasp": np.array([str(moment.grip) for _, moment in rows]),
        "angle": np.array([moment.angle for _, moment in rows]),
        "torque": np.array([s.torque for s in steady]),
        "ceiling": np.array([s.ceiling for s in steady]),
        "verdict": np.array([str(s.verdict) for s in steady]),
        "limits": np.array([", ".join(f"{x.name} {x.share:.3f}" for x in moment.limits) for _, moment in rows]),
        "side_force": np.array([float(np.hypot(s.F_s[0], s.F_s[1])) for s in steady]),
    }
    path = out / RESULTS
    write_parquet(path, columns)
    return path


def _cell(moment: Moment) -> str:
    return f"{moment.steady.torque:.3f}  {_limits(moment)}"


def _limits(moment: Moment) -> str:
    if moment.steady.verdict is not Verdict.SOLVED:
        return f"{moment.steady.verdict}: cannot press the tip"
    return ", ".join(f"{limit.name} {100 * limit.share:.0f} %" for limit in moment.limits[:NAMED])
