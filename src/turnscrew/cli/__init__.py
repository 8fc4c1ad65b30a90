"""The command `turnscrew`.

Exit status: 0 when the goal was reached, 1 when the run ended in a named fault (or a replay differs, or the machine
lacks something that a run needs), 2 on bad input, told in one line on stderr.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from turnscrew import __version__
from turnscrew.cli.envelope import envelope
from turnscrew.cli.options import FileArgument, SeedOption, SetOption
from turnscrew.cli.stroke import stroke
from turnscrew.cli.study import study_app
from turnscrew.cli.trials import trials
from turnscrew.errors import TurnscrewError

if TYPE_CHECKING:
    from turnscrew.task.scenario import Scenario
    from turnscrew.task.summary import Summary

# Everything else is imported by the command that needs it: `turnscrew scenario` starts in a third of a second.

app = typer.Typer(
    name="turnscrew",
    help="A robot hand that drives screws with an ordinary screwdriver held in its fingertips.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

app.add_typer(study_app, name="study")

FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.")]


def main() -> int:
    """Runs the command line and returns its exit status; the one place where errors become a line."""
    try:
        status = app(standalone_mode=False)
    except TurnscrewError as error:
        print(f"turnscrew: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except typer.Abort:
        return 1
    except typer.Exit as leave:
        return int(leave.exit_code)
    except Exception as error:
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        # what the command-line parser says of options it does not know; nothing when it has printed its help
        line = " ".join(message().split()).removesuffix(".")
        if line:
            print(f"turnscrew: {line}; see turnscrew --help", file=sys.stderr)
        return 2
    return status if isinstance(status, int) else 0


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        print(f"turnscrew {__version__}")
        raise typer.Exit


@app.command()
def fasten(
    scenario: FileArgument = None,
    overrides: SetOption = None,
    seed: SeedOption = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the record goes.")] = Path("runs/last"),
    rounds: Annotated[int | None, typer.Option("--rounds", help="Short for --set goal.rounds=N.")] = None,
    video: Annotated[bool, typer.Option("--video", help="Draw video.mp4 when the run has ended.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON and nothing else.")] = False,
) -> int:
    """Drive the screw, and leave a record of it."""
    from turnscrew.task.scenario import load

    wishes = [*(overrides or []), *([f"goal.rounds={rounds}"] if rounds is not None else [])]
    wanted = load(scenario, wishes, seed)
    if video:
        from turnscrew.show import gl

        gl.require()
    summary = _watched(wanted, out, quiet=as_json)
    if video:
        from turnscrew.show.video import film

        film(out)
    if as_json:
        print(summary.model_dump_json(indent=2))
    else:
        _tell(summary, out)
    return 0 if summary.outcome == "goal" else 1


def _watched(scenario: Scenario, out: Path, *, quiet: bool) -> Summary:
    from rich.console import Console

    from turnscrew.geometry.compiled import on_translation
    from turnscrew.show.progress import ProgressView
    from turnscrew.task.fasten import fasten as run

    try:
        if quiet:
            return run(scenario, out)
        with ProgressView(Console()) as view:
            on_translation(view.tell_of_translation)
            return run(scenario, out, on_progress=view.show, on_planning=view.tell)
    except KeyboardInterrupt:
        print(f"turnscrew: interrupted; the record up to here is in {out}", file=sys.stderr)
        raise typer.Exit(1) from None


def _tell(summary: Summary, out: Path) -> None:
    rows = {
        "outcome": summary.outcome,
        "rounds": f"{summary.rounds}",
        "screw turned": f"{summary.turned_deg:.0f} deg, {summary.advance_mm:.2f} mm in",
        "final torque": f"{summary.final_torque_nm:.3f} N.m",
        "largest tilt": f"{summary.max_tilt_deg:.2f} deg",
        "largest slip": f"tip {summary.tip_slip_mm:.2f} mm, fingers {summary.finger_slip_mm:.2f} mm",
        "support": f"{100 * summary.support_fraction:.1f} % of the turning time",
        "time": f"{summary.sim_time_s:.1f} s simulated in {summary.wall_time_s:.1f} s",
        "record": str(out),
    }
    faults = [("fault", f"{fault.kind} at {fault.time_s:.2f} s: {fault.evidence}") for fault in summary.faults]
    _list([*rows.items(), *faults])


def _list(rows: Sequence[tuple[str, str]]) -> None:
    """Names and values, one pair a line."""
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:{width}}  {value}")


@app.command()
def replay(folder: FolderArgument) -> int:
    """Simulate a record again from its model, first state and controls alone, and compare."""
    from turnscrew.plant.replay import TOLERANCE
    from turnscrew.plant.replay import replay as again

    found = again(folder)
    verdict = "the same run" if found.agrees else f"not the same run (more than {TOLERANCE:g})"
    where = "" if found.deviation == 0 else f", largest at step {found.step}"
    print(
        f"{found.steps} steps replayed: largest deviation {found.deviation:.3g} "
        f"(qpos {found.qpos:.3g}, qvel {found.qvel:.3g}){where}: {verdict}"
    )
    return 0 if found.agrees else 1


@app.command()
def plan(
    radius: Annotated[float, typer.Option("--radius", help="Radius of the handle [m].")] = 0.018,
    length: Annotated[float, typer.Option("--length", help="Length of the handle [m].")] = 0.10,
    middle: Annotated[float, typer.Option("--middle", help="Height of its middle above the tip [m].")] = 0.125,
    shaft_radius: Annotated[float, typer.Option("--shaft-radius", help="Radius of the shaft [m].")] = 0.003,
    stroke: Annotated[bool, typer.Option("--stroke", help="One long stroke of two fingers instead.")] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Plan anew, even if a plan is at hand.")] = False,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Write the plan there as JSON.")] = None,
) -> int:
    """Plan the finger gait for a handle, or find it among the plans at hand."""
    from rich.console import Console

    from turnscrew.decide.plan import Course
    from turnscrew.decide.plan_file import save
    from turnscrew.decide.plans import plan_for

    course = Course.STROKE if stroke else Course.ROUND

    with Console(stderr=True).status("planning") as status:
        found = plan_for(
            radius, length=length, middle=middle, shaft_radius=shaft_radius, course=course, fresh=fresh,
            progress=status.update,
        )  # fmt: skip
    rows = [
        ("handle radius", f"{found.radius * 1000:g} mm"),
        ("stroke", f"{math.degrees(found.stroke):.0f} deg"),
    ]
    rows += [(name, f"{margin:.4g}") for name, margin in found.margins.items()]
    if out is not None:
        save(found, out)
        rows.append(("written to", str(out)))
    _list(rows)
    return 0


app.command()(envelope)
app.command()(stroke)
app.command()(trials)


@app.command()
def scenario(
    file: FileArgument = None,
    overrides: SetOption = None,
    seed: SeedOption = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the reference of all keys instead.")] = False,
) -> int:
    """Print every key with its meaning, unit, range, source and value, as a scenario that can be edited."""
    from turnscrew.task.scenario import load
    from turnscrew.task.scenario_text import to_markdown, to_toml

    print(to_markdown() if markdown else to_toml(load(file, overrides or [], seed)), end="")
    return 0


@app.command()
def video(
    folder: FolderArgument,
    webp: Annotated[Path | None, typer.Option("--webp", metavar="FILE", help="Also cut an animated WebP.")] = None,
    start: Annotated[float, typer.Option("--from", help="Where the cut begins [s].")] = 0.0,
    seconds: Annotated[float, typer.Option("--seconds", help="How long the cut is [s].")] = 6.0,
) -> int:
    """Draw the video of a run that was made without one."""
    from turnscrew.plant.log import read_log
    from turnscrew.show import gl
    from turnscrew.show.video import cut, film

    read_log(folder)
    gl.require()
    print(film(folder))
    if webp is not None:
        cut(folder / "video.mp4", webp, start, seconds)
        print(webp)
    return 0


@app.command()
def see(
    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help="An image, a folder of images, a video, or a number.")
    ],
    calibration: Annotated[
        Path, typer.Option("--calibration", metavar="FILE", help="Of the camera: TOML or OpenCV's.")
    ],
    overrides: SetOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object a picture.")] = False,
) -> int:
    """Find the tool by its markers in pictures of your own; 1 if no picture tells its pose."""
    from turnscrew.sense.picture_source import see as look
    from turnscrew.show.sightings import as_line, as_record
    from turnscrew.task.camera_wiring import build_board
    from turnscrew.task.scenario import load

    wanted = load(None, overrides or [])
    told = False
    for frame in look(source, calibration, build_board(wanted), wanted.tool.markers.dictionary):
        print(as_record(frame) if as_json else as_line(frame), flush=True)
        told = told or frame.vision is not None
    return 0 if told else 1


@app.command()
def doctor(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where runs would be written.")] = Path("runs"),
) -> int:
    """Say what is missing on this machine, rendering included, and how to get it."""
    from rich.console import Console

    from turnscrew.show.doctor import examine

    console = Console()
    lacking = False
    for finding in examine(out):
        mark = "[green]ok[/]  " if finding.good else "[red]no[/]  " if finding.needed else "[yellow]no[/]  "
        cure = f"  ->  {finding.cure}" if finding.cure else ""
        console.print(f"{mark}{finding.name:20}{finding.detail}{cure}", highlight=False, soft_wrap=True)
        lacking = lacking or (finding.needed and not finding.good)
    console.print("a needed part is missing" if lacking else "turnscrew fasten will run here", highlight=False)
    return 1 if lacking else 0
