"""Slips of the tip, made in the plant: a knock beside the tip, or a moment in which blade and slot do not rub.

Here something acts on the tool that is neither gravity nor a contact: that is the disturbance.

A slot longer than the blade lets the tip slide along it, as an open slot does; `OPEN_SLOT` asks for one.  A slip is
counted from the moment at which the tip has left the place that it had before the disturbance by `REACH`, along the
slot.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.rotations import cross
from turnscrew.plant.cell import Cell

Kind = Literal["knock", "slick"]

OPEN_SLOT = ("screw.slot_length=0.010", "screw.head_radius=0.0055")
"""A blade 6 mm wide can slide by 2 mm to either side of the slot's middle."""

REACH = 0.001
"""Travel of the tip that makes a slip [m]."""

SLOT = ("slot_floor", "slot_left", "slot_right", "slot_front", "slot_back")
SLICK = 0.01
"""Friction of blade and slot in a slick moment."""
HEIGHT = 0.01
"""Where the tool is pushed, above the tip [m]."""
KNOCK = (1.1, 1.8)
"""A knock's force, over what friction can hold along the slot."""

LOAD = (0.2, 0.6)
"""Side load of a slick moment, likewise."""

LENGTH: dict[Kind, tuple[float, float]] = {"knock": (0.015, 0.04), "slick": (0.1, 0.3)}
"""How long a disturbance lasts, from and to [s]."""

LEAN = 0.3
"""Time before a slick moment in which its side load rises, and after it falls [s]: slowly, for it is no knock."""


@dataclass
class Slip:
    """One disturbance and what came of it.

    Attributes:
        kind: "knock" or "slick".
        start: When it began [s].
        length: How long it lasts [s].
        peak: Largest force along the slot [N], positive towards x of S: of a knock, or of the side load that leans on
            the tool before and during a slick moment, less than what blade and slot hold while they rub.
        reached: When the tip had travelled by `REACH` [s]; None while it has not.
        travel: Largest travel so far [m].
    """

    kind: Kind
    start: float
    length: float
    peak: float
    reached: float | None = None
    travel: float = 0.0


@dataclass
class Slips:
    """Disturbs a cell at random moments; to be called before each step of the plant.

    Attributes:
        cell: The plant.
        rng: Draws moments and strengths.
        kind: What is done.
        first: Earliest moment of the first disturbance [s].
        pause: Shortest time from one to the next [s]; the longest is twice that.
        length: Range of a disturbance's length [s]; None takes the kind's of `LENGTH`.
        made: The disturbances so far.
    """

    cell: Cell
    rng: Generator
    kind: Kind
    first: float = 1.5
    pause: float = 2.0
    length: tuple[float, float] | None = None
    made: list[Slip] = field(default_factory=list)

    def __post_init__(self) -> None:
        model = self.cell.model
        self._tool, self._screw = model.body("tool").id, model.body("screw").id
        self._geoms = [model.geom(name).id for name in ("blade", "shaft", *SLOT)]
        self._friction = model.geom_friction[self._geoms].copy()
        self._width = 2.0 * float(model.geom("blade").size[0])
        self._due = self.first + self.rng.uniform(0.0, self.pause)
        self._origin = 0.0

    def step(self) -> None:
        """Applies what is due to the coming step, and watches the tip."""
        time, place = self.cell.time, self.place()
        if time >= self._due:
            self._begin(time, place)
        if not self.made:
            return
        slip = self.made[-1]
        slip.travel = max(slip.travel, abs(place - self._origin))
        if slip.reached is None and slip.travel >= REACH and time < slip.start + 1.0:
            slip.reached = time
        self._disturb(slip, time - slip.start)

    def place(self) -> float:
        """Where the tip is along the slot, from its middle [m]."""
        data = self.cell.data
        x_S = data.xmat[self._screw].reshape(3, 3)[:, 0]
        return float((data.xpos[self._tool] - data.xpos[self._screw]) @ x_S)

    def _hold(self) -> float:
        """What friction can hold along the slot now, of the axial force and of the couple on the walls [N]."""
        F_s = self.cell.truth().F_s
        return float(self._friction[0, 0] * (max(F_s[2], 1.0) + 2.0 * abs(F_s[5]) / self._width))

    def _begin(self, time: float, place: float) -> None:
        length = self.rng.uniform(*(self.length or LENGTH[self.kind]))
        # towards the far end, so that there is way to go
        side = -np.sign(place) if abs(place) > 2e-4 else self.rng.choice([-1.0, 1.0])
        peak = float(side * self.rng.uniform(*(KNOCK if self.kind == "knock" else LOAD)) * self._hold())
        start = time + (LEAN if self.kind == "slick" else 0.0)
        self.made.append(Slip(self.kind, start, float(length), peak))
        self._origin = place
        self._due = time + self.pause * self.rng.uniform(1.0, 2.0)

    def _disturb(self, slip: Slip, clock: float) -> None:
        """A knock: half a sine.  A slick moment: friction gone, under a side load."""
        model, data = self.cell.model, self.cell.data
        if slip.kind == "knock":
            size = np.sin(np.pi * clock / slip.length) if 0.0 <= clock < slip.length else 0.0
        else:
            size = np.clip(min(1.0 + clock / LEAN, 1.0 - (clock - slip.length) / LEAN), 0.0, 1.0)
            scale = SLICK / self._friction[0, 0] if 0.0 <= clock < slip.length else 1.0
            model.geom_friction[self._geoms] = self._friction * scale
        rotation = data.xmat[self._tool].reshape(3, 3)
        force = slip.peak * size * data.xmat[self._screw].reshape(3, 3)[:, 0]
        arm = data.xpos[self._tool] + HEIGHT * rotation[:, 2] - data.xipos[self._tool]
        data.xfrc_applied[self._tool] = np.concatenate([force, cross(arm, force)])
