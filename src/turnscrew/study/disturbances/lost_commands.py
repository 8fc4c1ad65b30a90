"""Commands that are lost on their way: the drives keep the last one that arrived."""

from __future__ import annotations

from dataclasses import dataclass, replace

from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.task.fasten import Run
from turnscrew.task.line import Line, UnderWay


@dataclass(frozen=True, slots=True)
class LossyLine(Line):
    """A line that delivers nothing new for a while.

    Its state holds one command more than a sound one's: the one that arrived last.

    Attributes:
        span: When.
        cell: The plant, whose clock tells.
    """

    span: Span | None = None
    cell: Cell | None = None

    def update(self, sent: UnderWay, command: Array) -> tuple[UnderWay, Array]:
        """Sends a command, and receives one or the last again."""
        last, queue = sent[:1], sent[1:]
        following, due = Line.update(self, queue, command)
        if last and self.span is not None and self.cell is not None and self.span.holds(self.cell.time):
            due = last[0]
        return (due, *following), due


def lose_commands(run: Run, span: Span) -> None:
    """Puts itself between the loop and the drives of a run that has not begun."""
    run.loop = replace(run.loop, line=LossyLine(run.loop.line.periods, span, run.cell))
