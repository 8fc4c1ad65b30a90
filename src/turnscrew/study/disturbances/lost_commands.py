"""Commands that are lost on their way: drives hear nothing new for a while."""

from __future__ import annotations

from dataclasses import dataclass

from turnscrew.plant.cell import Cell
from turnscrew.study.disturbances.disturbance import Span


@dataclass(frozen=True, slots=True)
class LostCommands:
    """Keeps commands from a cell's drives; to be called before each step of the plant.

    Attributes:
        cell: The plant.
        span: When.
    """

    cell: Cell
    span: Span

    def step(self) -> None:
        """Before a step: what is written from now on arrives, or does not."""
        self.cell.drives.hears = not self.span.holds(self.cell.time)
