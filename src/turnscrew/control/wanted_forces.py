"""What sharing the hand's wrench among the fingertips gives, however it is shared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import DRIVEN, FINGERS
from turnscrew.signals import Estimate, Goal

NO_MARGIN = np.full(len(FINGERS), np.nan)


@dataclass(frozen=True, slots=True)
class WantedForces:
    """Contact forces for a tick.

    Attributes:
        f_W: (5, 3) wanted force of each fingertip on the tool, in W [N].
        lost: (6,) part of the wanted wrench that they do not give, in T, force first [N, N.m].
        margin: (5,) by how much each is inside the cone of the friction counted with [N]; not a number where no finger
            grips, or where it is not worked out.
        limited: (24,) which drives' torques hold the forces back.
    """

    f_W: Array
    lost: Array
    margin: Array
    limited: Flags

    @classmethod
    def none(cls, F_hd: Array) -> WantedForces:
        """No forces, of a wanted wrench F_hd (6,) in T [N, N.m], which is lost."""
        return cls(np.zeros((len(FINGERS), 3)), F_hd, NO_MARGIN.copy(), np.zeros(len(DRIVEN), dtype=bool))


class WrenchSharing(Protocol):
    """Anything that shares the wanted wrench of the hand."""

    def init(self) -> Any:
        """Nothing asked for yet."""

    def update(self, state: Any, goal: Goal, estimate: Estimate, F_hd: Array, dt: float) -> tuple[Any, WantedForces]:
        """One tick: the new state, and the forces for F_hd (6,) in T, force first [N, N.m]."""
