"""The command `turnscrew envelope`: what the grasps of a round can give, worked out beforehand."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from turnscrew.cli.options import FileArgument, SetOption, wide_console


def envelope(
    file: FileArgument = None,
    overrides: SetOption = None,
    radius: Annotated[
        list[float] | None,
        typer.Option("--radius", help="Radius of the handle [m]; repeatable. The scenario's without."),
    ] = None,
    friction: Annotated[
        list[float] | None,
        typer.Option("--friction", help="Friction of a fingertip on it; repeatable. The scenario's without."),
    ] = None,
    most: Annotated[
        float, typer.Option("--squeeze", "--most", metavar="N", help="Largest squeeze of a finger [N].")
    ] = 12.0,
    angles: Annotated[int, typer.Option("--angles", min=2, help="How many angles of the stroke are looked at.")] = 13,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where table and plot go.")] = Path("runs/envelope"),
) -> int:
    """Say how much torque the grasps of a round can give, what holds them back, and which screws they seat.

    For each angle of the stroke, and for thumb and middle finger, first and ring finger, and all four, it works out
    the largest torque about the screw that contact forces can hold: inside their friction cones, up to the largest
    squeeze, within every joint's torque, while the tip is pressed into the screw. Nothing is simulated.
    """
    from rich.console import Console

    from turnscrew.show.envelope_report import report
    from turnscrew.task.envelope import envelope as work_out
    from turnscrew.task.scenario import load

    given = overrides or []
    radii = [f"tool.handle.radius={value}" for value in radius or ()]
    frictions = [f"contact.finger_friction={value}" for value in friction or ()]
    wanted = [
        load(file, [*given, *size, *rough])
        for size in ([[one] for one in radii] or [[]])
        for rough in ([[one] for one in frictions] or [[]])
    ]
    with Console(stderr=True).status("planning") as status:
        found = [work_out(scenario, most, angles, status.update) for scenario in wanted]
    report(found, out, wide_console())
    return 0
