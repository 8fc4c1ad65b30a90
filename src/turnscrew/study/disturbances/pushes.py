"""Pushes against the handle: somebody's elbow, or a cable.

Here something acts on the tool that is neither gravity nor a contact: that is the disturbance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import cross
from turnscrew.plant.cell import Cell
from turnscrew.study.disturbances.disturbance import Span

FORCE = 3.0
"""A push, unless told otherwise [N]: four times the tool's weight."""

LENGTH = 0.1
"""How long it lasts [s]."""

ALWAYS = Span(1.0, inf)
"""From the first grip's settling to the end of a run."""


@dataclass(frozen=True)
class Push:
    """One push.

    Attributes:
        start: When it begins [s].
        heading: Its direction, level, from W's x axis [rad].
        height: Where it acts, along the tool's axis from the tip [m].
        size: Of its force [N].
    """

    start: float
    heading: float
    height: float
    size: float = FORCE

    def force(self, time: float) -> Array:
        """Force (3,) in W at a time [N]."""
        if not self.start <= time < self.start + LENGTH:
            return np.zeros(3)
        return self.size * np.array([np.cos(self.heading), np.sin(self.heading), 0.0])


@dataclass
class Pushes:
    """Pushes the handle of a cell at random moments; to be called before each step of the plant.

    Moments, directions and heights depend on the generator alone, so that different robots meet the same pushes.

    Attributes:
        cell: The plant.
        rng: Draws.
        span: When pushes may begin.
        pause: Shortest time from one push to the next [s]; the longest is twice that.
        size: Of their force [N].
        most: Number of pushes after which there are no more.
        made: The pushes so far.
    """

    cell: Cell
    rng: Generator
    span: Span = ALWAYS
    pause: float = 2.0
    size: float = FORCE
    most: float = inf
    made: list[Push] = field(default_factory=list)

    def __post_init__(self) -> None:
        model = self.cell.model
        self._tool, handle = model.body("tool").id, model.geom("handle").id
        middle, half = float(model.geom_pos[handle][2]), float(model.geom_size[handle][1])
        self._handle = (middle - half, middle + half)
        self._next = self._draw(self.span.start + self.rng.uniform(0.0, self.pause))

    def step(self) -> None:
        """Applies what is due to the coming step."""
        time, data = self.cell.time, self.cell.data
        if time >= self._next.start and self.span.holds(self._next.start) and len(self.made) < self.most:
            self.made.append(self._next)
            self._next = self._draw(self._next.start + self.pause * self.rng.uniform(1.0, 2.0))
        if not self.made:
            return
        push = self.made[-1]
        force = push.force(time)
        axis = data.xmat[self._tool].reshape(3, 3)[:, 2]
        arm = data.xpos[self._tool] + push.height * axis - data.xipos[self._tool]
        data.xfrc_applied[self._tool] = np.concatenate([force, cross(arm, force)])

    def _draw(self, start: float) -> Push:
        heading, height = self.rng.uniform(0.0, 2.0 * np.pi), self.rng.uniform(*self._handle)
        return Push(start, float(heading), float(height), self.size)
