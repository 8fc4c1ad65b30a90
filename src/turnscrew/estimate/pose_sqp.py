"""The real-time solver: sequential quadratic programming on the pose problem in its chart, with daqp inside.

Each step minimises a convex second-order model of the Lagrangian under the linearised rows, which are soft: the model
then always has a solution, and where the rows can be met it is that of the hard one.  A step is taken if it lowers
`|phi|^2 / 2 + weight (sum of violations)`, the exact penalty function; if not, it is corrected once for the rows'
curvature, and then the model is bent more, which shortens it where the objective cares least (Levenberg).

The problem has optima beside each other: the farther a contact point strays within its box, the more room a penetrating
pair of surfaces leaves, so its best place is a corner of the box, and which one depends on where one comes from.  So a
solve whose contacts may have ended in a wrong corner is repeated with the contacts back at the start and all else as
found, and the better one counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from time import perf_counter

import daqp
import numpy as np

from turnscrew.estimate.pose_chart import PHI, Z_POSE, PoseChart, pose_chart
from turnscrew.estimate.pose_problem import (
    G_PER_CONTACT,
    X_PER_CONTACT,
    X_POSE,
    Bounds,
    PoseFrame,
    PoseProblem,
    Tolerances,
)
from turnscrew.estimate.pose_solution import Multipliers, PoseSolution, judged, usable
from turnscrew.estimate.pose_sqp_status import QP_FLAGS, SQP_ANSWERS, SqpStatus
from turnscrew.geometry.arrays import Array

SOFT = 8
"""daqp's mark of a row that may be violated at a price."""

PRICE = 1e3
"""Price of a unit of violation to daqp, which scales it row by row, so it has to be far above any multiplier."""

BEYOND = 1e30
"""daqp's infinity."""

ROWS = 1e-10
"""daqp's tolerance of rows, well below `SqpSolver.violation`."""

DECREASE = 1e-4
"""Share of the model's gain that a step must bring, the usual choice (Nocedal and Wright, 3.1)."""

STIFFEST = 10.0
"""Curvature beyond which no step is tried any more: ten times the objective's own."""

NEAR = 0.3
"""Angle [rad] up to which rbar itself is a better start than the guess's orientation: from there (6) only grows, and
twice as many of the frames recorded with the camera's rbar reach IPOPT's objective to 1e-7."""

ACCEPTABLE = 1e-6
"""Violation, and change in a step, with which a solve that ran out of steps is an answer all the same: IPOPT's own
tolerance for that.  It then creeps along a direction of hardly any curvature."""

GOOD = (SqpStatus.CONVERGED, SqpStatus.ACCEPTABLE)
RETRIED = (*GOOD, SqpStatus.STALLED, SqpStatus.MAX_ITERATIONS)


@dataclass(frozen=True, slots=True)
class SqpSolver:
    """Parameters of the solver.

    Attributes:
        iterations: Most steps of a try; four are usual.
        tolerance: Descent of |phi|^2 / 2 that the model must promise for another step [rad^2]; (r . rbar)^2 is half.
        settled: Change of the merit below which a feasible point needs no model to be called an optimum: the next
            step's is smaller by an order at least.
        violation: Sum of violations allowed at an optimum, in the program's units: 1 nanometre.
        weight: Price of a unit of violation in the merit, raised where multipliers come near: they are tilts over
            levers, .01 as a rule and .2 at most.
        curvature: Least curvature of the model along any direction: a hundredth of what multipliers give the contacts,
            so that it hardly slows them.
        again: Least curvature at the start of the second try, which is near its end and shall not jump.
        concave: How much a contact's curvature had to be raised for a second try: times a box's squared side of
            .014^2 that is 1e-6, the tolerance to which IPOPT's objective is wanted.  Two in five frames are tried
            twice; without second tries one in seventy misses that objective.  With them one in 230 random frames does,
            none with the filter's rbar, and with the camera's one in a hundred (unseen frames and runs).
        pivots: Most changes of daqp's active set; a hundred are many.
    """

    iterations: int = 30
    tolerance: float = 1e-9
    settled: float = 1e-8
    violation: float = 1e-7
    weight: float = 1.0
    curvature: float = 3e-5
    again: float = 3e-2
    concave: float = 5e-3
    pivots: int = 500

    def solve(
        self, problem: PoseProblem, frame: PoseFrame, tolerances: Tolerances, x0: Array, multipliers: Multipliers | None
    ) -> PoseSolution:
        """Solve one frame; never raises for what the data hold.

        Args:
            problem: The problem for as many contacts as the frame has.
            frame: Data.
            tolerances: Of (1)-(5).
            x0: (7 + 4k,) start.
            multipliers: Of a solution of this solver nearby: they bend the first model.

        Paper: (6).
        """
        began = perf_counter()
        bounds, parameters = problem.bounds(frame, tolerances), frame.parameters(problem.tip.radius)
        status, count, x, prices = SqpStatus.BAD_DATA, 0, x0, None
        objective = float(abs(x0[3:X_POSE] @ frame.r_bar))
        residuals = None
        if usable(frame, parameters, x0):
            # no answer beats a feasible start that looks as seen, which is what most frames of the loop are; where the
            # tip is out of its box there is nothing to judge
            if 1.0 - objective**2 <= 0.5 * self.tolerance and float(np.abs(x0[:3]).max()) <= bounds.high[0]:
                residuals = judged(problem, frame, bounds, parameters, x0)
            if residuals is not None and residuals.excess <= 0.0:
                status, prices = SqpStatus.CONVERGED, _none(problem)
            else:
                status, count, x, prices = self._stepped(problem, frame, bounds, parameters, x0, multipliers)
                objective = float(abs(x[3:X_POSE] @ frame.r_bar))
                residuals = None
        if residuals is None:
            residuals = judged(problem, frame, bounds, parameters, x)
        wall_time = perf_counter() - began
        return PoseSolution(x, status.value, SQP_ANSWERS[status], count, objective, residuals, wall_time, prices)

    def _stepped(
        self,
        problem: PoseProblem,
        frame: PoseFrame,
        bounds: Bounds,
        parameters: Array,
        x0: Array,
        multipliers: Multipliers | None,
    ) -> tuple[SqpStatus, int, Array, Multipliers]:
        """Status, number of steps, where they led, and the multipliers there."""
        chart = pose_chart(problem)
        walk = _Walk(self, chart, chart.data(frame, parameters), chart.bounds(bounds))
        z = chart.enter(frame, x0)
        if float(z[PHI] @ z[PHI]) < NEAR**2:
            z[PHI] = 0.0
        status, count = self._walked(walk, z, multipliers)
        return status, count, chart.leave(frame, walk.z), (walk.prices[: chart.size], walk.prices[chart.size :])

    def _walked(self, walk: _Walk, z: Array, multipliers: Multipliers | None) -> tuple[SqpStatus, int]:
        """Once from z, and again from its contacts where that may end elsewhere: status and steps of both."""
        size = len(z)
        if multipliers is not None and (len(multipliers[0]), len(multipliers[1])) == (size, len(walk.prices) - size):
            walk.prices = np.concatenate(multipliers)
        status, count = walk.run(z, self.curvature)
        if status not in RETRIED or (status in GOOD and not walk.cornered()):
            return status, count
        found, prices, merit = walk.z.copy(), walk.prices, walk.merit
        second, more = walk.run(np.concatenate([found[:Z_POSE], z[Z_POSE:]]), self.again)
        if status in GOOD and (second not in GOOD or walk.merit > merit):
            walk.z, walk.prices, walk.merit = found, prices, merit
            return status, count + more
        return second, count + more


def _none(problem: PoseProblem) -> Multipliers:
    return np.zeros(Z_POSE + X_PER_CONTACT * problem.k), np.zeros(G_PER_CONTACT * problem.k)


class _Walk:
    """The steps of one solve.

    Attributes:
        z: (6 + 4k,) where it stands.
        g: (6k,) the rows there.
        merit: Objective and priced violations there.
        violation: Their sum.
        prices: (6 + 10k,) multipliers of boxes and rows, after the last model.
    """

    def __init__(self, solver: SqpSolver, chart: PoseChart, data: Array, bounds: Bounds) -> None:
        self.solver, self.chart, self.weight = solver, chart, solver.weight
        chart.take(data, bounds)
        n = chart.size
        self.low, self.high = np.maximum(bounds.low, -BEYOND), np.minimum(bounds.high, BEYOND)
        self.kinds = np.zeros(len(self.low), np.int32)
        self.kinds[n:] = SOFT
        self.here, self.prices, self.slope = np.empty(len(self.low)), np.zeros(len(self.low)), np.zeros(n)
        self.z, self.g = self.here[:n], self.here[n:]

    def run(self, z: Array, curvature: float) -> tuple[SqpStatus, int]:
        """Step from z until the model promises nothing more: status and number of steps."""
        n, solver = self.chart.size, self.solver
        self.bend, self.merit, self.change = curvature, inf, inf
        self._taken(np.minimum(np.maximum(z, self.low[:n]), self.high[:n]), 0.0)
        if self.merit == inf:
            self.z[:] = z
            return SqpStatus.OVERFLOW, 0
        for count in range(solver.iterations):
            # the merit's least value is zero, so no model is needed to know that nothing more can be gained
            if self.merit <= solver.tolerance:
                self.prices[:] = 0.0
                return SqpStatus.CONVERGED, count
            if self.change <= solver.settled and self.violation <= solver.violation:
                return SqpStatus.CONVERGED, count
            status = self._step()
            if status is not None:
                return status, count
        near = self.violation <= ACCEPTABLE and self.change <= ACCEPTABLE
        return SqpStatus.ACCEPTABLE if near else SqpStatus.MAX_ITERATIONS, solver.iterations

    def cornered(self) -> bool:
        """Whether the Lagrangian is so concave along some contact's parameters that there may be a better corner."""
        return self.merit > self.solver.tolerance and bool(self.chart.curves.results[2][0] > self.solver.concave)

    def _step(self) -> SqpStatus | None:
        """One step; how the solve ends, None where it goes on."""
        solver, first = self.solver, True
        J, H = self._derivatives()
        # squares are not finite where a number is not; a product is four times faster than a sum
        if not isfinite(np.vdot(J, J) + np.vdot(H, H)):
            return SqpStatus.OVERFLOW
        self.slope[PHI] = self.z[PHI]
        diagonal = H.reshape(-1)[:: len(H) + 1]
        own = diagonal.copy()
        while self.bend <= STIFFEST:
            diagonal[:] = own + self.bend
            d, prices, flag = self._model(H, J, self.here)
            if flag < 1:
                return QP_FLAGS.get(flag, SqpStatus.QP_UNKNOWN)
            descent = -float(self.slope @ d)
            if first:
                self.prices, first = prices, False
            if self.violation <= solver.violation and descent <= solver.tolerance:
                return SqpStatus.CONVERGED
            gain = self._gain(d, descent, J, flag)
            if gain <= solver.tolerance:
                return SqpStatus.INFEASIBLE
            if self._taken(self.z + d, gain) or self._corrected(d, gain, H, J):
                self.bend = max(0.1 * self.bend, solver.curvature)
                return None
            self.bend *= 10.0
        return SqpStatus.STALLED

    def _derivatives(self) -> tuple[Array, Array]:
        """The rows' Jacobian and the Lagrangian's Hessian, made convex."""
        chart = self.chart
        if not self.prices.any():
            chart.slopes.arguments[0][:] = self.z
            chart.slopes.evaluate()
            H = np.zeros((chart.size, chart.size))
            H[PHI, PHI] = np.eye(3)
            return chart.slopes.results[0], H
        chart.curves.arguments[0][:], chart.curves.arguments[2][:] = self.z, self.prices[chart.size :]
        chart.curves.evaluate()
        return chart.curves.results[0], chart.curves.results[1]

    def _gain(self, d: Array, descent: float, J: Array, flag: int) -> float:
        """What the model promises of the merit, whose weight it raises above twice any multiplier first."""
        n = self.chart.size
        if flag == 1:
            needed = 2.0 * float(np.abs(self.prices[n:]).max())
            if needed > self.weight:
                self.merit += (needed - self.weight) * self.violation
                self.weight = needed
            return descent + self.weight * self.violation
        ahead = self.g + J @ d
        left = np.maximum(np.maximum(self.low[n:] - ahead, ahead - self.high[n:]), 0.0).sum()
        return descent + self.weight * (self.violation - float(left))

    def _model(self, H: Array, J: Array, here: Array) -> tuple[Array, Array, int]:
        """The quadratic program about z with rows `g + J d`: step, multipliers and daqp's flag."""
        d, _, flag, info = daqp.solve(
            H, self.slope, J, self.high - here, self.low - here, self.kinds,
            w_soft=PRICE, iter_limit=self.solver.pivots, primal_tol=ROWS,
        )  # fmt: skip
        prices = info["lam"]
        # daqp says that it succeeded even where numbers overflowed
        return d, prices, int(flag) if flag < 1 or isfinite(float(d @ d) + float(prices @ prices)) else 0

    def _taken(self, z: Array, gain: float) -> bool:
        """Go to z if that brings enough."""
        rows = self.chart.rows
        rows.arguments[0][:] = z
        rows.evaluate()
        violation, phi = float(rows.results[1][0]), z[PHI]
        merit = 0.5 * float(phi @ phi) + self.weight * violation
        # written so that a merit that is not a number is refused
        if not merit <= self.merit - DECREASE * gain:
            return False
        self.change = self.merit - merit
        self.z[:], self.g[:], self.merit, self.violation = z, rows.results[0], merit, violation
        return True

    def _corrected(self, d: Array, gain: float, H: Array, J: Array) -> bool:
        """Go where the model leads that knows what the rows are at the end of the step."""
        there = np.concatenate([self.z, self.chart.rows.results[0] - J @ d])
        if not isfinite(there.sum()):
            return False
        d, _, flag = self._model(H, J, there)
        return flag > 0 and self._taken(self.z + d, gain)
