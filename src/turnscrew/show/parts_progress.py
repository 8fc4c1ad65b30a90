"""A study's parts as they are finished, as a bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from turnscrew.study.parts import Done, Part, finish

P = TypeVar("P", bound=Part)


def gather(
    todo: Sequence[P], work: Callable[[P], Done], jobs: int, console: Console, doing: str
) -> list[tuple[P, Done]]:
    """Does all parts and shows how it gets on; returns them in the order in which they were asked for.

    Args:
        todo: Units of work.
        work: Does one; a module's function.
        jobs: Processes at a time.
        console: Where the bar is shown.
        doing: What is being done, for the bar.
    """
    done: dict[int, Done] = {}
    place = {part.file: index for index, part in enumerate(todo)}
    columns = (TextColumn(doing), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(doing, total=len(todo))
        for part, found in finish(todo, work, jobs):
            done[place[part.file]] = found
            bar.advance(task)
    return [(part, done[index]) for index, part in enumerate(todo)]
