"""The command `turnscrew trials`: how often the screw is driven when everything varies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from turnscrew.cli.options import FileArgument, SetOption, TablesOption, wide_console


def trials(
    file: FileArgument = None,
    n: Annotated[int, typer.Option("--trials", "--n", metavar="N", min=1, help="How many.")] = 100,
    variation: Annotated[
        str, typer.Option("--variation", help="standard, hard (twice the standard one) or none.")
    ] = "standard",
    mishap: Annotated[
        str,
        typer.Option(
            "--mishap",
            metavar="KIND",
            help="What happens to the robot once in each trial: push, slick, knock, dark, frozen or dropout.",
        ),
    ] = "",
    overrides: SetOption = None,
    rounds: Annotated[int | None, typer.Option("--rounds", help="Short for --set goal.rounds=N.")] = None,
    first_seed: Annotated[
        int, typer.Option("--first-seed", min=0, help="Seed of the first trial; the next one has the next.")
    ] = 0,
    jobs: Annotated[int | None, typer.Option("--jobs", min=1, help="Processes at a time; one a core without.")] = None,
    engine: Annotated[
        str, typer.Option("--engine", help="joblib: this machine; ray: the cluster that RAY_ADDRESS names.")
    ] = "joblib",
    out: TablesOption = Path("runs/trials"),
) -> int:
    """Drive many screws under drawn variations, and say how many came in, how fast, and why others did not.

    Each trial is on disk as soon as it is done: killed, the same command goes on from there.
    """
    import os

    from turnscrew.show.trials_report import report
    from turnscrew.study.trials.engines import engine as find
    from turnscrew.study.trials.study import trials as plan

    chosen = find(engine)
    wishes = [*(overrides or []), *([f"goal.rounds={rounds}"] if rounds is not None else [])]
    study = plan(file, wishes, variation, range(first_seed, first_seed + n), out, mishap)
    report(study, jobs or os.cpu_count() or 1, out, wide_console(), chosen)
    return 0
