"""The real-time solver: sequential quadratic programming on the pose problem in its chart, begun again where that pays.

The problem has optima beside each other.  The farther a contact point strays within its box, the more room a
penetrating pair of surfaces leaves, so its best place is a corner of the box, and which one depends on where one comes
from.  And a fingertip's curvature jumps at its seam: a contact on the ball, held there by its tangents, does not find
the cylinder, where they would let it go.  So where the Lagrangian is concave enough along a contact's parameters there
are further tries: contacts near a seam are rolled across it, and all contacts go back to the start with the pose as
found.  The best try counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from turnscrew.estimate.pose_chart import PHI, Z_POSE, pose_chart
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
from turnscrew.estimate.pose_sqp_status import SQP_ANSWERS, SqpStatus
from turnscrew.estimate.pose_walk import SEAM, Found, V, Walk
from turnscrew.geometry.arrays import Array

NEAR = 0.3
"""Angle [rad] up to which rbar itself is a better start than the guess's orientation: from there (6) only grows, and
twice as many of the frames recorded with the camera's rbar reach IPOPT's objective to 1e-7."""

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
        again: Least curvature at the start of the try with contacts back at the start, which is near its end and shall
            not jump.
        concave: How much a contact's curvature along any parameter had to be raised for such a try.
        rolling: How much along the fingertip, where it can go farthest.
        seam: How much there, near the seam, for a try across it: half of SEAM squared times that is 1.5e-6, and 1e-6
            the tolerance to which IPOPT's objective is wanted.  All three found by trial: they leave two in three
            random frames with one try, half of those with the camera's rbar, and with it six of the 248 among 14,000
            that another is known to help.
        pivots: Most changes of a model's active set; thirty are many.
    """

    iterations: int = 30
    tolerance: float = 1e-9
    settled: float = 1e-8
    violation: float = 1e-7
    weight: float = 1.0
    curvature: float = 3e-5
    again: float = 3e-2
    concave: float = 1e-2
    rolling: float = 3e-3
    seam: float = 3e-4
    pivots: int = 200

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
        chart.take(frame, parameters, bounds)
        walk = Walk(self, chart)
        z = chart.enter(frame, x0)
        if float(z[PHI] @ z[PHI]) < NEAR**2:
            z[PHI] = 0.0
        status, count = self._walked(walk, z, multipliers)
        return status, count, chart.leave(frame, walk.z), (walk.prices[: chart.size], walk.prices[chart.size :])

    def _walked(self, walk: Walk, z: Array, multipliers: Multipliers | None) -> tuple[SqpStatus, int]:
        """Once from z, and again where that may end elsewhere: status of the best, and steps of all."""
        size = len(z)
        if multipliers is not None and (len(multipliers[0]), len(multipliers[1])) == (size, len(walk.prices) - size):
            walk.prices = np.concatenate(multipliers)
        status, count = walk.run(z, self.curvature)
        if status not in RETRIED:
            return status, count
        first = found = walk.found(status)
        for begin, curvature in self._again(walk, first, z):
            walk.prices = first.prices
            status, more = walk.run(begin, curvature)
            count += more
            if found.status not in GOOD or (status in GOOD and walk.merit < found.merit):
                found = walk.found(status)
        walk.z[:], walk.prices, walk.merit = found.z, found.prices, found.merit
        return found.status, count

    def _again(self, walk: Walk, first: Found, z: Array) -> list[tuple[Array, float]]:
        """Where further tries begin, and with what curvature."""
        lost, seamed, tries = first.status not in GOOD, walk.seamed(), []
        if seamed.any():
            rolled = first.z.copy()
            rolled[V][seamed] = -SEAM
            tries.append((rolled, self.curvature))
        if lost or seamed.any() or walk.cornered():
            tries.append((np.concatenate([first.z[:Z_POSE], z[Z_POSE:]]), self.again))
        return tries


def _none(problem: PoseProblem) -> Multipliers:
    return np.zeros(Z_POSE + X_PER_CONTACT * problem.k), np.zeros(G_PER_CONTACT * problem.k)
