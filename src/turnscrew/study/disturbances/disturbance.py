"""What every disturbance of a run has in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from numpy.random import Generator

from turnscrew.signals import FaultKind
from turnscrew.task.fasten import Run
from turnscrew.task.scenario_keys import Scenario

Hook: TypeAlias = Callable[[], None]
"""Called before each step of the plant."""


def idle() -> None:
    """The hook of a disturbance that leaves the plant alone."""


@dataclass(frozen=True)
class Span:
    """A stretch of time, its end not included.

    Attributes:
        start: When it begins [s].
        end: When it is over [s].
    """

    start: float
    end: float

    def holds(self, time: float) -> bool:
        """Whether a time lies in it."""
        return self.start <= time < self.end


@dataclass(frozen=True)
class Disturbance:
    """One thing that goes wrong once in a run.

    Attributes:
        meaning: In a few words, for tables.
        length: How long it lasts in a scenario [s].
        put: Prepares a run that has not begun, and returns what is to be called before each step of its plant; draws
            what is left open (which finger, which way) from the generator.
        expected: What the watch should name, None for trouble too small to have a name.
        refusable: Whether it spoils camera frames that arrive and that the filter should refuse.
    """

    meaning: str
    length: Callable[[Scenario], float]
    put: Callable[[Run, Span, Generator], Hook]
    expected: FaultKind | None = None
    refusable: bool = False
