"""The command `turnscrew stroke`: one long stroke of two fingers against a spring."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from turnscrew.cli.options import FileArgument, SetOption, TablesOption, wide_console

PRESET = (
    "tool.handle.radius=0.0125", "screw.thread.stiffness=0.1", "robot.actuation=torque", "goal.course=stroke",
    "control.friction_used=0.8", "control.largest_squeeze=16", "control.frequency=45", "control.palm_weight=3",
    "contact.passes=30",
)  # fmt: skip
"""What stands in for a scenario.  A thin handle asks for a squeeze near the end of its friction, and for a servo as
stiff at its radius as 32 rad/s are at 18 mm; the palm may help, for no other finger comes near; the simulated friction
has to be as good as that."""


def stroke(
    file: FileArgument = None,
    overrides: SetOption = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of the first run; the next one has the next.")] = 0,
    n: Annotated[int, typer.Option("--n", min=1, help="Runs.")] = 1,
    out: TablesOption = Path("runs/stroke"),
) -> int:
    """Turn a screw as far as thumb and middle finger can in one stroke, against a torque that grows with the angle.

    Without a scenario: a handle of 12.5 mm radius, a thread of 0.1 N.m/rad, a robot that takes torques.  Every run
    leaves its record in a folder of its own; 0 if all of them came to the end of the stroke.
    """
    from turnscrew.show.stroke_report import report
    from turnscrew.task.scenario import load

    preset = () if file is not None else PRESET
    wanted = [load(file, [*preset, *(overrides or [])], seed + k) for k in range(n)]
    return 0 if report(wanted, out, wide_console()) else 1
