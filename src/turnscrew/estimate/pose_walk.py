"""One try of the real-time solver: steps by quadratic programs from one place until nothing more is to be gained.

Each step minimises a convex second-order model of the Lagrangian under the linearised rows, which are soft: the model
then always has a solution, and where the rows can be met it is that of the hard one.  A step is taken if it lowers
`|phi|^2 / 2 + weight (sum of violations)`, the exact penalty function; if not, it is corrected once for the rows'
curvature, and then the model is bent more, which shortens it where the objective cares least (Levenberg).
"""

from __future__ import annotations

from math import inf, isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from turnscrew.estimate.pose_chart import PHI, Z_POSE, PoseChart
from turnscrew.estimate.pose_model import LIMIT, PAID, SOLVED, step_model
from turnscrew.estimate.pose_problem import X_PER_CONTACT
from turnscrew.estimate.pose_sqp_status import MODEL_ENDS, SqpStatus
from turnscrew.geometry.arrays import Array, Flags

if TYPE_CHECKING:
    from turnscrew.estimate.pose_sqp import SqpSolver

DECREASE = 1e-4
"""Share of the model's gain that a step must bring, the usual choice (Nocedal and Wright, 3.1)."""

STIFFEST = 1000.0
"""Curvature beyond which no step is tried any more: at a row's highest price it makes steps of 10 micrometres."""

ACCEPTABLE = 1e-6
"""Violation, and change in a step, with which a solve that ran out of steps is an answer all the same: IPOPT's own
tolerance for that.  It then creeps along a direction of hardly any curvature."""

V = slice(Z_POSE + 1, None, X_PER_CONTACT)
"""Where z has the contacts' places along the fingertips' meridians."""

SEAM = 0.1
"""How far from a fingertip's seam [rad] a contact may belong on its other side: three times eps2, by which its normal
may turn while the handle stays where it is."""


class Found(NamedTuple):
    """Where a try ended: status, merit, z and prices."""

    status: SqpStatus
    merit: float
    z: Array
    prices: Array


class Walk:
    """The steps of one try.

    Attributes:
        z: (6 + 4k,) where it stands.
        g: (6k,) the rows there.
        merit: Objective and priced violations there.
        violation: Their sum.
        prices: (6 + 10k,) multipliers of boxes and rows, after the last model.
        held: (6 + 10k,) those that the next model begins with: none after rows that could not be met, of which too many
            are held.
    """

    def __init__(self, solver: SqpSolver, chart: PoseChart) -> None:
        self.solver, self.chart, self.weight = solver, chart, solver.weight
        n, m = chart.size, len(chart.low)
        self.here, self.prices = np.empty(m), np.zeros(m)
        self.z, self.g = self.here[:n], self.here[n:]
        self.diagonal = chart.H.reshape(-1)[:: n + 1]

    def run(self, z: Array, curvature: float) -> tuple[SqpStatus, int]:
        """Step from z until the model promises nothing more: status and number of steps."""
        n, solver, chart = self.chart.size, self.solver, self.chart
        self.bend, self.merit, self.change = curvature, inf, inf
        self._priced(self.prices)
        self._taken(np.minimum(np.maximum(z, chart.low[:n]), chart.high[:n]), 0.0)
        if self.merit == inf:
            self.z[:] = z
            return SqpStatus.OVERFLOW, 0
        for count in range(solver.iterations):
            # the merit's least value is zero, so no model is needed to know that nothing more can be gained
            if self.merit <= solver.tolerance:
                self.prices = np.zeros(len(self.prices))
                return SqpStatus.CONVERGED, count
            if self.change <= solver.settled and self.violation <= solver.violation:
                return SqpStatus.CONVERGED, count
            status = self._step()
            if status is not None:
                return status, count
        near = self.violation <= ACCEPTABLE and self.change <= ACCEPTABLE
        return SqpStatus.ACCEPTABLE if near else SqpStatus.MAX_ITERATIONS, solver.iterations

    def found(self, status: SqpStatus) -> Found:
        """What stays when the next try begins."""
        return Found(status, self.merit, self.z.copy(), self.prices)

    def cornered(self) -> bool:
        """Whether the Lagrangian is so concave along a contact's parameters that there may be a better corner."""
        raised, solver = self.chart.raised, self.solver
        concave = raised.max() > solver.concave or raised[:, 1].max() > solver.rolling
        return self.merit > solver.tolerance and bool(concave)

    def seamed(self) -> Flags:
        """(k,) whether it is concave along the fingertip at a contact near the seam of ball and cylinder."""
        if self.merit <= self.solver.tolerance:
            return np.zeros(self.chart.problem.k, np.bool_)
        flags: Flags = (np.abs(self.z[V]) < SEAM) & (self.chart.raised[:, 1] > self.solver.seam)
        return flags

    def _step(self) -> SqpStatus | None:
        """One step; how the solve ends, None where it goes on."""
        solver, chart, first = self.solver, self.chart, True
        chart.derivatives(self.z, self.prices[chart.size :])
        self.diagonal += self.bend
        while True:
            d, prices, flag = self._model(self.here)
            if flag not in (SOLVED, PAID):
                return MODEL_ENDS[flag]
            descent = -float(self.z[PHI] @ d[PHI])
            if first:
                self._priced(prices)
                first = False
            if self.violation <= solver.violation and descent <= solver.tolerance:
                return SqpStatus.CONVERGED
            gain = self._gain(d, descent, flag)
            if gain <= solver.tolerance:
                return SqpStatus.INFEASIBLE
            if self._taken(self.z + d, gain) or self._corrected(d, gain):
                self.bend = max(0.1 * self.bend, solver.curvature)
                return None
            self.diagonal += 9.0 * self.bend
            self.bend *= 10.0
            if self.bend > STIFFEST:
                return SqpStatus.STALLED

    def _priced(self, prices: Array) -> None:
        """Remember prices, and whether the next model can begin with them."""
        highest = float(np.abs(prices[self.chart.size :]).max())
        self.prices, self.held = prices, prices if highest < LIMIT else np.zeros(len(prices))

    def _gain(self, d: Array, descent: float, flag: int) -> float:
        """What the model promises of the merit, whose weight it raises above twice any multiplier first."""
        n = self.chart.size
        if flag == SOLVED:
            needed = 2.0 * float(np.abs(self.prices[n:]).max())
            if needed > self.weight:
                self.merit += (needed - self.weight) * self.violation
                self.weight = needed
            return descent + self.weight * self.violation
        ahead = self.g + self.chart.J @ d
        left = np.maximum(np.maximum(self.chart.low[n:] - ahead, ahead - self.chart.high[n:]), 0.0).sum()
        return descent + self.weight * (self.violation - float(left))

    def _model(self, here: Array) -> tuple[Array, Array, int]:
        """The quadratic program about z with rows `g + J d`, from prices nearby: step, prices and how it ended."""
        chart, d, prices = self.chart, np.empty(self.chart.size), self.held.copy()
        low, high = chart.low - here, chart.high - here
        flag = step_model(chart.H, self.z[PHI], chart.J, low, high, self.solver.pivots, d, prices)
        return d, prices, flag

    def _taken(self, z: Array, gain: float) -> bool:
        """Go to z if that brings enough."""
        violation, phi = self.chart.rows(z), z[PHI]
        merit = 0.5 * float(phi @ phi) + self.weight * violation
        # written so that a merit that is not a number is refused
        if not merit <= self.merit - DECREASE * gain:
            return False
        self.change = self.merit - merit
        self.z[:], self.g[:], self.merit, self.violation = z, self.chart.g, merit, violation
        return True

    def _corrected(self, d: Array, gain: float) -> bool:
        """Go where the model leads that knows what the rows are at the end of the step."""
        there = np.concatenate([self.z, self.chart.g - self.chart.J @ d])
        if not isfinite(there.sum()):
            return False
        d, _, flag = self._model(there)
        return flag in (SOLVED, PAID) and self._taken(self.z + d, gain)
