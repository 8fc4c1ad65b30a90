"""III-A: the tool pose from vision, polished under contact constraints, with an answer for every solver status."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from time import perf_counter
from typing import Any

import casadi
import numpy as np

from turnscrew.estimate.pose_problem import (
    G_PER_CONTACT,
    UNIT,
    X_PER_CONTACT,
    X_POSE,
    PoseFrame,
    PoseProblem,
    Tolerances,
)
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import matrix_from_quaternion, quaternion_from_matrix


class Refinement(StrEnum):
    """How a frame's pose came about: the rung of the ladder that gave it."""

    WARM = "warm"
    COLD = "cold"
    RELAXED = "relaxed"
    PREDICTED = "predicted"


class Answer(StrEnum):
    """What is done about a solver status."""

    ACCEPT = "accept"
    NEXT_RUNG = "next rung"
    GIVE_UP = "give up"


ANSWERS = {
    "Solve_Succeeded": Answer.ACCEPT,
    "Solved_To_Acceptable_Level": Answer.ACCEPT,
    "Feasible_Point_Found": Answer.ACCEPT,
    "Infeasible_Problem_Detected": Answer.NEXT_RUNG,
    "Search_Direction_Becomes_Too_Small": Answer.NEXT_RUNG,
    "Diverging_Iterates": Answer.NEXT_RUNG,
    "User_Requested_Stop": Answer.GIVE_UP,
    "Maximum_Iterations_Exceeded": Answer.NEXT_RUNG,
    "Restoration_Failed": Answer.NEXT_RUNG,
    "Error_In_Step_Computation": Answer.NEXT_RUNG,
    "Maximum_CpuTime_Exceeded": Answer.NEXT_RUNG,
    "Maximum_WallTime_Exceeded": Answer.NEXT_RUNG,
    "Not_Enough_Degrees_Of_Freedom": Answer.GIVE_UP,
    "Invalid_Problem_Definition": Answer.GIVE_UP,
    "Invalid_Option": Answer.GIVE_UP,
    "Invalid_Number_Detected": Answer.NEXT_RUNG,
    "Unrecoverable_Exception": Answer.GIVE_UP,
    "NonIpopt_Exception_Thrown": Answer.NEXT_RUNG,
    "Insufficient_Memory": Answer.GIVE_UP,
    "Internal_Error": Answer.GIVE_UP,
}
"""Every return status of IPOPT and its answer; one that is not listed goes to the next rung."""

NOT_FINITE = "Input_Not_Finite"
"""Our own status of a frame whose data hold a NaN or infinity: the solver is not asked."""

SLACK = 1e-5
"""Violation of a bound, in the program's units, that an accepted answer may have: .1 micrometre, and ten times what
IPOPT's relaxation of bounds (1e-8) and its acceptable tolerance leave."""


@dataclass(frozen=True, slots=True)
class Residuals:
    """Left-hand sides of the constraints at the answer; shapes with k contacts.

    Attributes:
        tip: |p - p_s|_j of (1), largest [m].
        contact: (k,) largest component of (2) [m].
        tangent: (k, 2) of (3) and (4), sines.
        opposed: (k,) n . n_i, near -1.
        step: (k, 2) move from the prediction of (5) [rad, and 10 mm].
        excess: Largest violation of a bound of the rung that answered, in the program's units; <= 0 when none.
    """

    tip: float
    contact: Array
    tangent: Array
    opposed: Array
    step: Array
    excess: float


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
        residuals: At the answer.
        objective: |r . rbar|.
        wall_time: [s].
        multipliers: lam_x and lam_g, for the next frame's warm start; None unless solved.
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
    multipliers: tuple[Array, Array] | None


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
    multipliers: tuple[Array, Array] | None


@dataclass(frozen=True, slots=True)
class PoseRefiner:
    """Solves (1)-(6) by the ladder warm start, cold start, wider boxes, and at last the guess itself.

    Attributes:
        tolerances: Of the first rungs.
        relaxations: Factors of the wider boxes, tried in turn: the second covers joint offsets of three sigmas.
    """

    tolerances: Tolerances = field(default_factory=Tolerances)
    relaxations: tuple[float, ...] = (2.0, 5.0)

    def solve(self, problem: PoseProblem, frame: PoseFrame, guess: Guess) -> RefinedPose:
        """Refine one frame.

        Args:
            problem: The program for as many contacts as the frame has.
            frame: Data.
            guess: Start and fall-back.

        Returns:
            The refined pose; its status says how it came about.  Never raises for what the data hold.
        """
        began = perf_counter()
        x0 = self._start(problem, frame, guess)
        parameters = frame.parameters(problem.tip.radius)
        said: list[str] = []
        iterations = 0
        for rung, tolerances in self._ladder(guess) if _finite(x0, parameters, frame.xi) else ():
            bounds = problem.bounds(frame, tolerances)
            warm = guess.multipliers if rung is Refinement.WARM else None
            x, multipliers, status, count = _run(problem, x0, parameters, bounds, warm)
            iterations += count
            answer = ANSWERS.get(status, Answer.NEXT_RUNG)
            if answer is Answer.ACCEPT:
                residuals = _residuals(problem, frame, x, parameters, bounds)
                if residuals.excess <= SLACK:
                    said.append(status)
                    return _answer(problem, frame, x, rung, said, iterations, residuals, began, multipliers)
                status += " (bounds violated)"
            said.append(status)
            if answer is Answer.GIVE_UP:
                break
        bounds = problem.bounds(frame, self.tolerances)
        with np.errstate(invalid="ignore"):
            residuals = _residuals(problem, frame, x0, parameters, bounds)
            if not said:
                said, residuals = [NOT_FINITE], replace(residuals, excess=np.inf)
            return _answer(problem, frame, x0, Refinement.PREDICTED, said, iterations, residuals, began, None)

    def _ladder(self, guess: Guess) -> list[tuple[Refinement, Tolerances]]:
        rungs = [(Refinement.WARM, self.tolerances)] if guess.multipliers is not None else []
        rungs += [(Refinement.COLD, self.tolerances)]
        return rungs + [(Refinement.RELAXED, self.tolerances.widened(factor)) for factor in self.relaxations]

    def _start(self, problem: PoseProblem, frame: PoseFrame, guess: Guess) -> Array:
        r = quaternion_from_matrix(guess.R_WT)
        # q and -q are one rotation; starting on the side of rbar keeps the path short.
        r = r if float(r @ frame.r_bar) >= 0.0 else -r
        uv = _in_chart(guess.tip_uv, frame.tip_radius / problem.tip.radius)
        contacts = np.column_stack([uv, guess.xi[:, :1], guess.xi[:, 1:] / problem.eta_unit])
        return np.concatenate([(guess.p_WT - frame.p_WS) / UNIT, r, contacts.ravel()])


def _in_chart(uv: Array, ratio: Array) -> Array:
    """Contact parameters in another capsule's chart, which runs down the cylinder at its own radius a radian.

    Args:
        uv: (k, 2) parameters in the charts of the capsules as they are.
        ratio: (k,) their radii over that of the capsule whose chart is wanted.
    """
    u, v = uv[:, 0], uv[:, 1]
    return np.column_stack([u, np.where(v < 0.0, v * ratio, v)])


def _finite(*arrays: Array) -> bool:
    return all(bool(np.isfinite(a).all()) for a in arrays)


def _run(
    problem: PoseProblem,
    x0: Array,
    parameters: Array,
    bounds: tuple[Array, Array, Array, Array],
    multipliers: tuple[Array, Array] | None,
) -> tuple[Array, tuple[Array, Array], str, int]:
    """One call of IPOPT: x, multipliers, status, iterations."""
    lbx, ubx, lbg, ubg = bounds
    arguments: dict[str, Any] = {"x0": x0, "p": parameters, "lbx": lbx, "ubx": ubx, "lbg": lbg, "ubg": ubg}
    if multipliers is not None:
        arguments |= {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
    solver = problem.solver(multipliers is not None)
    out = solver(**arguments)
    stats = solver.stats()
    both = (np.array(out["lam_x"]).ravel(), np.array(out["lam_g"]).ravel())
    return np.array(out["x"]).ravel(), both, str(stats["return_status"]), int(stats["iter_count"])


def _residuals(
    problem: PoseProblem, frame: PoseFrame, x: Array, parameters: Array, bounds: tuple[Array, Array, Array, Array]
) -> Residuals:
    lbx, ubx, lbg, ubg = bounds
    g = np.array(casadi.DM(problem.g(x, parameters))).ravel()
    rows = g[1:].reshape(-1, G_PER_CONTACT)
    contacts = x[X_POSE:].reshape(-1, X_PER_CONTACT)
    predicted = np.column_stack([frame.xi[:, 0], frame.xi[:, 1] / problem.eta_unit])
    excess = float(np.max(np.concatenate([lbx - x, x - ubx, lbg - g, g - ubg])))
    return Residuals(
        tip=UNIT * float(np.max(np.abs(x[:3]))),
        contact=UNIT * np.max(np.abs(rows[:, :3]), axis=1),
        tangent=rows[:, 3:5],
        opposed=rows[:, 5],
        step=contacts[:, 2:] - predicted,
        excess=excess if np.isfinite(excess) else np.inf,
    )


def _answer(
    problem: PoseProblem,
    frame: PoseFrame,
    x: Array,
    rung: Refinement,
    said: list[str],
    iterations: int,
    residuals: Residuals,
    began: float,
    multipliers: tuple[Array, Array] | None,
) -> RefinedPose:
    contacts = x[X_POSE:].reshape(-1, X_PER_CONTACT)
    return RefinedPose(
        p_WT=frame.p_WS + UNIT * x[:3],
        R_WT=matrix_from_quaternion(x[3:7]),
        xi=np.column_stack([contacts[:, 2], contacts[:, 3] * problem.eta_unit]),
        tip_uv=_in_chart(contacts[:, :2], problem.tip.radius / frame.tip_radius),
        status=rung,
        solver_statuses=tuple(said),
        iterations=iterations,
        residuals=residuals,
        objective=float(abs(x[3:7] @ frame.r_bar)),
        wall_time=perf_counter() - began,
        multipliers=multipliers,
    )
