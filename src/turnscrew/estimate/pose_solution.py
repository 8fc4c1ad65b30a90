"""What a solver of the pose problem gives: an answer that can judge itself, and what is to be done about its status."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from typing import Protocol, TypeAlias

import numpy as np

from turnscrew.estimate.pose_problem import G_PER_CONTACT, UNIT, Bounds, PoseFrame, PoseProblem, Tolerances
from turnscrew.geometry.arrays import Array

SLACK = 1e-5
"""Violation of a bound, in the program's units, that an accepted answer may have: .1 micrometre, and ten times what
IPOPT's relaxation of bounds (1e-8) and its acceptable tolerance leave."""

BAD_DATA = "data not finite, rbar not of unit length or a fingertip without radius"
"""Any solver's status for a frame that is not `usable`."""

Multipliers: TypeAlias = tuple[Array, Array]
"""Multipliers of the variables' boxes and of the rows, in a solver's own scaling: good for its own warm start only."""


class Answer(StrEnum):
    """What is done about a solver status."""

    ACCEPT = "accept"
    NEXT_RUNG = "next rung"
    GIVE_UP = "give up"


@dataclass(frozen=True, slots=True)
class Residuals:
    """Left-hand sides of the constraints at the answer; shapes with k contacts.

    Attributes:
        tip: |p - p_s|_j of (1), largest [m].
        contact: (k,) largest component of (2) [m].
        tangent: (k, 2) of (3) and (4), sines.
        opposed: (k,) n . n_i, near -1.
        step: (k, 2) move from the prediction of (5) [rad, and 10 mm].
        excess: Largest violation of a bound in the program's units; <= 0 when none, infinite when it cannot be told.
    """

    tip: float
    contact: Array
    tangent: Array
    opposed: Array
    step: Array
    excess: float


@dataclass(frozen=True, slots=True)
class PoseSolution:
    """A solver's answer to one frame.

    Attributes:
        x: (7 + 4k,) variables of the problem.
        status: What the solver said, in its own words.
        answer: What is to be done about that.
        iterations: Number of steps taken.
        objective: |r . rbar|.
        residuals: At x, for the tolerances that were asked for.
        wall_time: [s].
        multipliers: For the next frame's warm start; None where there are none.
    """

    x: Array
    status: str
    answer: Answer
    iterations: int
    objective: float
    residuals: Residuals
    wall_time: float
    multipliers: Multipliers | None

    @property
    def feasible(self) -> bool:
        """Whether every bound holds to `SLACK`."""
        return self.residuals.excess <= SLACK

    @property
    def accepted(self) -> bool:
        """Whether the solver is content and right to be."""
        return self.answer is Answer.ACCEPT and self.feasible


class PoseSolver(Protocol):
    """Anything that solves one frame."""

    def solve(
        self, problem: PoseProblem, frame: PoseFrame, tolerances: Tolerances, x0: Array, multipliers: Multipliers | None
    ) -> PoseSolution:
        """Solve from x0, warm where multipliers are given; never raises for what finite data hold."""


def usable(frame: PoseFrame, parameters: Array, x0: Array) -> bool:
    """Whether all is finite, rbar a rotation and every fingertip round: a solver is not asked otherwise.

    Args:
        frame: Data.
        parameters: Of the frame, as it gives them.
        x0: (7 + 4k,) start.
    """
    # a sum is not finite where one of its parts is not; 2e-6 of a squared length is what single precision leaves
    with np.errstate(invalid="ignore", over="ignore"):
        total = float(x0.sum() + parameters.sum() + frame.xi.sum())
        unit = abs(float(frame.r_bar @ frame.r_bar) - 1.0) < 2e-6
        return isfinite(total) and unit and float(frame.tip_radius.min()) > 0.0


def judged(problem: PoseProblem, frame: PoseFrame, bounds: Bounds, parameters: Array, x: Array) -> Residuals:
    """Residuals of (1)-(5) at any x, with the frame's bounds and parameters as the problem gives them."""
    g = problem.g(x, parameters)
    rows = g.reshape(-1, G_PER_CONTACT)
    with np.errstate(invalid="ignore", over="ignore"):
        values = np.concatenate([x, g])
        excess = float(np.maximum(bounds.low - values, values - bounds.high).max())
        return Residuals(
            tip=UNIT * float(np.abs(x[:3]).max()),
            contact=UNIT * np.abs(rows[:, :3]).max(axis=1),
            tangent=rows[:, 3:5],
            opposed=rows[:, 5],
            step=problem.step(frame, x),
            excess=excess if np.isfinite(excess) else np.inf,
        )
