"""The faithful reference: IPOPT on the pose problem as the paper states it, in quaternions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from time import perf_counter
from typing import Any

import casadi
import numpy as np

from turnscrew.estimate.pose_problem import X_POSE, Bounds, PoseFrame, PoseProblem, Tolerances, rotation
from turnscrew.estimate.pose_solution import BAD_DATA, Answer, Multipliers, PoseSolution, judged, usable
from turnscrew.geometry.arrays import Array

IPOPT_ANSWERS = {
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


@dataclass(frozen=True, slots=True)
class IpoptSolver:
    """IPOPT with MUMPS and the exact Hessian.

    Attributes:
        iterations: Most that it takes; four times the usual number: what needs more is infeasible.
    """

    iterations: int = 60

    def solve(
        self, problem: PoseProblem, frame: PoseFrame, tolerances: Tolerances, x0: Array, multipliers: Multipliers | None
    ) -> PoseSolution:
        """Solve one frame.

        Args:
            problem: The problem for as many contacts as the frame has.
            frame: Data.
            tolerances: Of (1)-(5).
            x0: (7 + 4k,) start.
            multipliers: Of a solution of this solver nearby, for a warm start.

        Paper: (6).
        """
        began = perf_counter()
        bounds, parameters = problem.bounds(frame, tolerances), frame.parameters(problem.tip.radius)
        if usable(frame, parameters, x0):
            x, both, status, count = self._asked(problem, frame, bounds, parameters, x0, multipliers)
            answer = IPOPT_ANSWERS.get(status, Answer.NEXT_RUNG)
        else:
            x, both, status, count, answer = x0, None, BAD_DATA, 0, Answer.GIVE_UP
        return PoseSolution(
            x=x,
            status=status,
            answer=answer,
            iterations=count,
            objective=float(abs(x[3:X_POSE] @ frame.r_bar)),
            residuals=judged(problem, frame, bounds, parameters, x),
            wall_time=perf_counter() - began,
            multipliers=both,
        )

    def _asked(
        self,
        problem: PoseProblem,
        frame: PoseFrame,
        bounds: Bounds,
        parameters: Array,
        x0: Array,
        multipliers: Multipliers | None,
    ) -> tuple[Array, Multipliers | None, str, int]:
        n = problem.size
        # |r| = 1 goes before the rows
        arguments: dict[str, Any] = {
            "x0": x0,
            "p": np.concatenate([frame.r_bar, parameters]),
            "lbx": bounds.low[:n],
            "ubx": bounds.high[:n],
            "lbg": np.concatenate([[1.0], bounds.low[n:]]),
            "ubg": np.concatenate([[1.0], bounds.high[n:]]),
        }
        # those of another solver have other shapes, and would be refused
        warm = multipliers is not None and (len(multipliers[0]), len(multipliers[1])) == (n, len(arguments["lbg"]))
        if warm and multipliers is not None:
            arguments |= {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
        return self.run(problem, warm, arguments)

    def run(self, problem: PoseProblem, warm: bool, arguments: dict[str, Any]) -> tuple[Array, Multipliers, str, int]:
        """One call of IPOPT: x, multipliers, status, iterations."""
        solver = ipopt(problem, warm, self.iterations)
        out = solver(**arguments)
        stats = solver.stats()
        both = (np.array(out["lam_x"]).ravel(), np.array(out["lam_g"]).ravel())
        return np.array(out["x"]).ravel(), both, str(stats["return_status"]), int(stats["iter_count"])


@lru_cache(maxsize=128)
def ipopt(problem: PoseProblem, warm: bool, iterations: int) -> Any:
    """IPOPT on this problem, built when first asked for; `warm` starts from given multipliers, close to the bounds.

    Settings, found by trial: MUMPS and the exact Hessian (L-BFGS needs ten times longer); the monotone barrier (a tenth
    faster than the adaptive one).
    """
    x, r_bar = casadi.SX.sym("x", problem.size), casadi.SX.sym("r_bar", 4)
    parameters, r = problem.parameters(), x[3:X_POSE]
    program = {
        "x": x,
        "p": casadi.vertcat(r_bar, parameters),
        "f": -(casadi.dot(r, r_bar) ** 2),
        "g": casadi.vertcat(casadi.dot(r, r), problem.rows(x[:3], rotation(r), x[X_POSE:], parameters)),
    }
    options: dict[str, Any] = {"print_level": 0, "sb": "yes", "mu_strategy": "monotone", "max_iter": iterations}
    if warm:
        near = dict.fromkeys(("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"), 1e-6)
        near |= {"mult_bound_push": 1e-6}
        options |= {"warm_start_init_point": "yes", "mu_init": 1e-4}
        options |= {f"warm_start_{name}": value for name, value in near.items()}
    settings = {"print_time": False, "record_time": False, "calc_lam_p": False, "error_on_fail": False}
    return casadi.nlpsol("pose", "ipopt", program, {**settings, "ipopt": options})
