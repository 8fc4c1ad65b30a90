"""The tip is knocked out of the drive: something catches the blade, lifts it over the slot's rim and pushes it aside.

Here something acts on the tool that is neither gravity nor a contact: that is the disturbance.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import cross
from turnscrew.plant.cell import Cell

RISE = 400.0
"""How fast the force grows [N/s]: to twice a run's thrust in 25 ms, a knock and not a lift."""

MOST = 40.0
"""The largest force [N]: beyond it whatever has caught the blade lets go."""

RIM = 0.0003
"""Height over the slot's rim from which on the blade is pushed aside [m]."""

ASIDE = 0.0025
"""How far aside it is pushed [m]: farther than a slot reaches across itself, nearer than the screw head's rim."""

PUSHED = 5.0
"""What it is pushed aside with [N]: as much as it presses with."""

PATIENCE = 0.3
"""Longest time for all of it [s]."""


@dataclass
class KnockOut:
    """Knocks the tip out of the drive once; to be called before each step of the plant.

    Attributes:
        cell: The plant.
        start: When [s].
        heading: Which way the blade goes, level, from W's x axis [rad].
        depth: Of the slot [m].
        out: When the tip was out and let go [s]; None while it is not.
    """

    cell: Cell
    start: float
    heading: float
    depth: float
    out: float | None = None
    _force: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        model = self.cell.model
        self._tool, self._screw = model.body("tool").id, model.body("screw").id

    def step(self) -> None:
        """Applies what is due to the coming step."""
        time, data = self.cell.time, self.cell.data
        if time < self.start:
            return
        data.xfrc_applied[self._tool] = 0.0
        if self.out is not None or time > self.start + PATIENCE:
            return
        away = data.xpos[self._tool] - data.xpos[self._screw]
        if away[2] > self.depth + RIM and np.hypot(away[0], away[1]) > ASIDE:
            self.out = time
            return
        # aside only over the rim: within the slot its walls would take it, and turn the screw
        grown = RISE * float(self.cell.model.opt.timestep)
        if away[2] < self.depth + RIM:
            self._force[2] = min(self._force[2] + grown, MOST)
        else:
            pushed = min(float(np.hypot(*self._force[:2])) + grown, PUSHED)
            self._force[:2] = pushed * np.array([np.cos(self.heading), np.sin(self.heading)])
        arm = data.xpos[self._tool] - data.xipos[self._tool]
        data.xfrc_applied[self._tool] = np.concatenate([self._force, cross(arm, self._force)])
