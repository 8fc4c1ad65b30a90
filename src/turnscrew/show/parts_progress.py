"""A study's parts as they are finished, as a bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from turnscrew.study.parts import Done, Engine, Part, finish

P = TypeVar("P", bound=Part)


SPEED_OVER = 3600.0
"""Time over which the pace is taken that tells the time left [s]: a part may take minutes."""


def gather(
    todo: Sequence[P],
    work: Callable[[P], Done],
    jobs: int,
    console: Console,
    doing: str,
    *,
    tell: Callable[[Sequence[Done]], str] | None = None,
    engine: Engine | None = None,
) -> list[tuple[P, Done]]:
    """Does all parts and shows how it gets on; returns them in the order in which they were asked for.

    Args:
        todo: Units of work.
        work: Does one; a module's function.
        jobs: Processes at a time.
        console: Where the bar is shown.
        doing: What is being done, for the bar.
        tell: Says of what has been found so far what belongs beside the bar; each part is a line where there is no
            terminal.
        engine: Where the parts are done; processes of this machine without.
    """
    done: dict[int, Done] = {}
    place = {part.file: index for index, part in enumerate(todo)}
    ready = sum(part.file.is_file() for part in todo)
    columns = (
        TextColumn(doing),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[so_far]}"),
    )
    with Progress(*columns, console=console, speed_estimate_period=SPEED_OVER) as bar:
        # what lies on disk says nothing of the pace
        task = bar.add_task(doing, total=len(todo), completed=ready, so_far="")
        for part, found in finish(todo, work, jobs, engine):
            done[place[part.file]] = found
            so_far = "" if tell is None else tell(list(done.values()))
            bar.update(task, completed=max(ready, len(done)), so_far=so_far)
            if so_far and not console.is_terminal and len(done) > ready:
                console.print(f"{len(done)}/{len(todo)} {so_far}", highlight=False)
    return [(part, done[index]) for index, part in enumerate(todo)]
