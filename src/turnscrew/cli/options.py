"""Options and a console that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

FileArgument = Annotated[Path | None, typer.Argument(metavar="[SCENARIO.toml]", help="Scenario; defaults without.")]
SetOption = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a key; repeatable.")]
SeedOption = Annotated[int | None, typer.Option("--seed", help="Seed of all that is random.")]
JobsOption = Annotated[int, typer.Option("--jobs", min=1, help="Processes at a time.")]
TablesOption = Annotated[Path, typer.Option("--out", metavar="DIR", help="Where tables and plots go.")]


def wide_console() -> Console:
    """A console for tables, which are wider than a narrow terminal: better their lines break than their cells."""
    from rich.console import Console

    console = Console()
    console.width = max(console.width, 150)
    return console
