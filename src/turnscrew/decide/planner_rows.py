"""What the planner's program is made of: rows with bounds and slacks, what is wished for, and what came out."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from turnscrew.decide.planner_round import Unknowns

SHORTEST, LONGEST = 0.3, 2.5
"""Range searched for the stroke [rad]; a round of less than 0.3 is lost to slot play and hand-overs."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What the program maximises besides smoothness.

    Attributes:
        stroke: Weight of the stroke [1/rad].
        margin: Weight of the joint margin [1/rad].
        clearance: Weight of the extra clearance [1/10 mm].
        spin: Price of the squared angles by which TH and MF turn about the normals of their contacts in the roll
            [1/rad2]: a fingertip that spins uses friction up, and creeps where the load pulls.
        least_stroke: The stroke is at least this [rad].
        most_stroke: The stroke never exceeds this [rad].
    """

    stroke: float = 1.0
    margin: float = 0.0
    clearance: float = 0.0
    spin: float = 0.0
    least_stroke: float = SHORTEST
    most_stroke: float = LONGEST


@dataclass(frozen=True)
class Outcome:
    """What a step led to.

    Attributes:
        unknowns: New values.
        slack: By how much each group of bounds is missed.
        violation: Largest violation of a constraint.
        objective: Of the program.
        status: IPOPT's.
    """

    unknowns: Unknowns
    slack: dict[str, float]
    violation: float
    objective: float
    status: str

    @property
    def missed(self) -> float:
        """Sum of slacks and violation: zero for a round that keeps all requirements."""
        return sum(self.slack.values()) + self.violation


class Rows:
    """Constraint rows with their bounds, and the slacks of their groups.

    Attributes:
        terms: Columns of rows.
        low: Lower bound of each row.
        high: Upper bound of each row.
        slacks: Of each group of bounds.
    """

    def __init__(self) -> None:
        self.terms: list[ca.SX] = []
        self.low: list[float] = []
        self.high: list[float] = []
        self.slacks: dict[str, ca.SX] = {}

    def zero(self, term: ca.SX) -> None:
        """Adds term == 0."""
        self._add(term, 0.0, 0.0)

    def least(self, group: str, term: ca.SX, bound: float | ca.SX) -> None:
        """Adds term >= bound, but for the group's slack."""
        slack = self.slacks.setdefault(group, ca.SX.sym(f"slack_{group}"))
        self._add(term - bound + slack, 0.0, np.inf)

    def most(self, group: str, term: ca.SX, bound: float | ca.SX) -> None:
        """Adds term <= bound, but for the group's slack."""
        self.least(group, -term, -bound)

    def _add(self, term: ca.SX, low: float, high: float) -> None:
        column = ca.vec(term)
        self.terms.append(column)
        self.low += [low] * column.numel()
        self.high += [high] * column.numel()
