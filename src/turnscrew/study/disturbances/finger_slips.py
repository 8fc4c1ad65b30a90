"""Fingers that slip, made in the plant: for a moment one fingertip rubs less on whatever it touches.

Nothing pushes: what the contact can no longer hold by friction slides.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.random import Generator

from turnscrew.contact.rolling import slip_velocity
from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.plant.truth import Truth
from turnscrew.robot.joints import FINGERS

REACH = 0.001
"""Way over the handle that makes a slip [m]: ten times what a finger creeps in a tenth of a second."""

LENGTH = 0.3
"""How long a moment lasts [s]."""

HOLDS = 1.0
"""Force from which on a finger holds the tool and may be chosen [N]."""

OURS = 2
"""Priority of the chosen fingertip's contact properties over the handle's, which is 1."""


@dataclass
class FingerMoment:
    """One moment in which a finger rubs less, and what came of it.

    Attributes:
        finger: Row of the finger.
        start: When it began [s].
        ratio: Force across the contact's normal over the force along it, then.
        reached: When the finger had slid by `REACH` [s]; None while it has not.
        travel: Largest way that it has slid so far [m].
        down: Its part along the tool's axis, towards the tip [m].
    """

    finger: int
    start: float
    ratio: float
    reached: float | None = None
    travel: float = 0.0
    down: float = 0.0


@dataclass
class SlickFingers:
    """Makes fingers of a cell slick at random moments; to be called before each step of the plant.

    Attributes:
        cell: The plant.
        rng: Draws moments and fingers.
        factor: What a finger's friction is multiplied by.
        length: How long a moment lasts [s].
        first: Earliest time of the first moment [s].
        pause: Shortest time from the end of one to the next [s]; the longest is twice that.
        watched: How long after its start a finger's way is followed [s].
        most: Number of moments after which there are no more.
        made: The moments so far.
    """

    cell: Cell
    rng: Generator
    factor: float
    length: float = LENGTH
    first: float = 1.2
    pause: float = 1.5
    watched: float = 0.8
    most: float = inf
    made: list[FingerMoment] = field(default_factory=list)

    def __post_init__(self) -> None:
        model = self.cell.model
        self._tips = [model.geom(f"C_{finger.lower()}distal").id for finger in FINGERS]
        self._handle = model.geom("handle").id
        self._due = self.first + self.rng.uniform(0.0, self.pause)
        self._slick = False
        self._way = np.zeros(3)

    def step(self) -> None:
        """Applies what is due to the coming step, and follows the finger."""
        time = self.cell.time
        if not self._slick and time >= self._due and len(self.made) < self.most:
            self._begin(time)
        if not self.made or time >= self.made[-1].start + self.watched:
            return
        moment = self.made[-1]
        if self._slick and time >= moment.start + self.length:
            self._rub(moment.finger, None)
            self._slick = False
            self._due = time + self.pause * self.rng.uniform(1.0, 2.0)
        self._follow(moment, self.cell.truth(), time)

    def _begin(self, time: float) -> None:
        """Chooses one of the fingers that hold the tool, if there are any."""
        truth = self.cell.truth()
        holding = np.flatnonzero(np.linalg.norm(truth.f_W, axis=1) > HOLDS)
        if len(holding) == 0:
            return
        finger = int(self.rng.choice(holding))
        self.made.append(FingerMoment(finger, time, _ratio(truth, finger)))
        self._way = np.zeros(3)
        self._rub(finger, self.factor)
        self._slick = True

    def _rub(self, finger: int, factor: float | None) -> None:
        """Gives a fingertip's contacts a share of the handle's friction, or leaves them to the handle."""
        model, tip, handle = self.cell.model, self._tips[finger], self._handle
        model.geom_priority[tip] = 0 if factor is None else OURS
        if factor is not None:
            model.geom_friction[tip] = factor * model.geom_friction[handle]
            model.geom_condim[tip] = model.geom_condim[handle]
            model.geom_solref[tip], model.geom_solimp[tip] = model.geom_solref[handle], model.geom_solimp[handle]

    def _follow(self, moment: FingerMoment, truth: Truth, time: float) -> None:
        row = moment.finger
        if not truth.touching[row]:
            return
        v = slip_velocity(truth.c_W[row], truth.p_WT, truth.V_WT, truth.p_WF[row], truth.V_WF[row])
        self._way += float(self.cell.model.opt.timestep) * v
        way = float(np.linalg.norm(self._way))
        if way > moment.travel:
            # v is the handle's over the finger: where the handle goes up, the finger goes down
            moment.travel, moment.down = way, float(self._way @ truth.R_WT[:, 2])
        if moment.reached is None and way >= REACH:
            moment.reached = time


def _ratio(truth: Truth, finger: int) -> float:
    """How much of a finger's force is across its normal, over what is along it."""
    c, f = truth.c_W[finger] - truth.p_WT, truth.f_W[finger]
    z = truth.R_WT[:, 2]
    out: Array = c - (c @ z) * z
    n = out / np.linalg.norm(out)
    along = -float(n @ f)
    return float(np.linalg.norm(f + along * n)) / max(along, 0.1)
