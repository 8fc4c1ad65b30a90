"""The line from controller to drives: commands arrive a whole number of control periods after they are sent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from turnscrew.geometry.arrays import Array

UnderWay: TypeAlias = tuple[Array, ...]
"""Commands under way, the oldest first: the line's state.  A line that has carried nothing yet is empty."""


@dataclass(frozen=True, slots=True)
class Line:
    """A delay of commands.

    Attributes:
        periods: Control periods between sending and arriving.
    """

    periods: int = 0

    def update(self, sent: UnderWay, command: Array) -> tuple[UnderWay, Array]:
        """Sends a command and receives one.

        On a line that has carried nothing yet, the first command counts as sent all the time before: the robot was
        holding itself in some way.

        Args:
            sent: Under way.
            command: (24,) positions [rad] or torques [N.m].

        Returns:
            What is under way now, and the command (24,) that arrives.
        """
        queue = (*(sent or (command,) * self.periods), command)
        return queue[1:], queue[0]


NO_DELAY = Line()
