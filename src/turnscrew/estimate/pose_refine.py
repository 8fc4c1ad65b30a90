"""III-A: the tool pose from vision, polished under contact constraints, with an answer for every solver status."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from time import perf_counter

import numpy as np

from turnscrew.estimate.pose_problem import UNIT, X_PER_CONTACT, X_POSE, PoseFrame, PoseProblem, Tolerances, in_chart
from turnscrew.estimate.pose_solution import Answer, Multipliers, PoseSolution, PoseSolver, Residuals, judged
from turnscrew.estimate.pose_sqp import SqpSolver
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import matrix_from_quaternion


class Refinement(StrEnum):
    """How a frame's pose came about: the rung of the ladder that gave it."""

    WARM = "warm"
    COLD = "cold"
    RELAXED = "relaxed"
    PREDICTED = "predicted"


@dataclass(frozen=True, slots=True)
class RefinedPose:
    """The answer to one frame.

    Attributes:
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        xi: (k, 2) contact parameters on the handle's patch.
        tip_uv: (k, 2) contact parameters on the fingertips' patches.
        status: The rung of the ladder that gave it; PREDICTED is the caller's own pose.
        solver_statuses: What each rung's solver said, in order.
        iterations: Of all rungs together.
        residuals: At the answer, for the rung's boxes; for PREDICTED those of the first rungs.
        objective: |r . rbar|.
        wall_time: [s].
        multipliers: For the next frame's warm start; None unless solved.
    """

    p_WT: Array
    R_WT: Array
    xi: Array
    tip_uv: Array
    status: Refinement
    solver_statuses: tuple[str, ...]
    iterations: int
    residuals: Residuals
    objective: float
    wall_time: float
    multipliers: Multipliers | None


@dataclass(frozen=True, slots=True)
class Guess:
    """Where the solver starts, and what is handed on if it fails.

    Attributes:
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        xi: (k, 2) contact parameters on the handle's patch.
        tip_uv: (k, 2) contact parameters on the fingertips' patches.
        multipliers: Of the last frame with the same contacts, if it was solved.
    """

    p_WT: Array
    R_WT: Array
    xi: Array
    tip_uv: Array
    multipliers: Multipliers | None


@dataclass(frozen=True, slots=True)
class PoseRefiner:
    """Solves (1)-(6) by the ladder warm start, cold start, wider boxes, and at last the guess itself.

    Attributes:
        tolerances: Of the first rungs.
        relaxations: Factors of the wider boxes, tried in turn: the second covers joint offsets of three sigmas.
        solver: What solves each rung.
    """

    tolerances: Tolerances = field(default_factory=Tolerances)
    relaxations: tuple[float, ...] = (2.0, 5.0)
    solver: PoseSolver = field(default_factory=SqpSolver)

    def solve(self, problem: PoseProblem, frame: PoseFrame, guess: Guess) -> RefinedPose:
        """Refine one frame.

        Args:
            problem: The problem for as many contacts as the frame has.
            frame: Data.
            guess: Start and fall-back.

        Returns:
            The refined pose; its status says how it came about.  Never raises for what the data hold.
        """
        began = perf_counter()
        # what is not finite ends in a status; it need not warn on its way there
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            x0 = problem.point(frame, guess.p_WT, guess.R_WT, guess.xi, guess.tip_uv)
            said: list[str] = []
            iterations = 0
            for rung, tolerances in self._ladder(guess):
                multipliers = guess.multipliers if rung is Refinement.WARM else None
                solution = self.solver.solve(problem, frame, tolerances, x0, multipliers)
                iterations += solution.iterations
                if solution.accepted:
                    said.append(solution.status)
                    return _answer(problem, frame, solution, rung, said, iterations, began)
                said.append(solution.status + (" (bounds violated)" if solution.answer is Answer.ACCEPT else ""))
                if solution.answer is Answer.GIVE_UP:
                    break
            return self._predicted(problem, frame, guess, x0, said, iterations, began)

    def _predicted(
        self,
        problem: PoseProblem,
        frame: PoseFrame,
        guess: Guess,
        x0: Array,
        said: list[str],
        iterations: int,
        began: float,
    ) -> RefinedPose:
        """The guess as it came."""
        bounds, parameters = problem.bounds(frame, self.tolerances), frame.parameters(problem.tip.radius)
        return RefinedPose(
            p_WT=guess.p_WT,
            R_WT=guess.R_WT,
            xi=guess.xi,
            tip_uv=guess.tip_uv,
            status=Refinement.PREDICTED,
            solver_statuses=tuple(said),
            iterations=iterations,
            residuals=judged(problem, frame, bounds, parameters, x0),
            objective=float(abs(x0[3:X_POSE] @ frame.r_bar)),
            wall_time=perf_counter() - began,
            multipliers=None,
        )

    def _ladder(self, guess: Guess) -> Iterator[tuple[Refinement, Tolerances]]:
        if guess.multipliers is not None:
            yield Refinement.WARM, self.tolerances
        yield Refinement.COLD, self.tolerances
        for factor in self.relaxations:
            yield Refinement.RELAXED, self.tolerances.widened(factor)


def _answer(
    problem: PoseProblem,
    frame: PoseFrame,
    solution: PoseSolution,
    rung: Refinement,
    said: list[str],
    iterations: int,
    began: float,
) -> RefinedPose:
    x = solution.x
    contacts = x[X_POSE:].reshape(-1, X_PER_CONTACT)
    return RefinedPose(
        p_WT=frame.p_WS + UNIT * x[:3],
        R_WT=matrix_from_quaternion(x[3:X_POSE]),
        xi=contacts[:, 2:] * np.array([1.0, problem.eta_unit]),
        tip_uv=in_chart(contacts[:, :2], problem.tip.radius / frame.tip_radius),
        status=rung,
        solver_statuses=tuple(said),
        iterations=iterations,
        residuals=solution.residuals,
        objective=solution.objective,
        wall_time=perf_counter() - began,
        multipliers=solution.multipliers,
    )
