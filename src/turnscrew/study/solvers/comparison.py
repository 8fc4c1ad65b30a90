"""The solvers of the pose problem side by side, on the same frames, as the loop would ask them.

A solver *finds* an answer where it is content and every bound of (1)-(5) holds to `SLACK`, .1 micrometre: ten times
what IPOPT's own tolerances leave.  The wider boxes that the loop falls back on are another problem, and left out.
SQP *reaches* IPOPT's answer where it finds one whose (r . rbar)^2 is at most `REACHED` below IPOPT's.

Times are the processor's, of the solver's thread: on a busy machine a solve of 5 ms is interrupted and one of .5 ms is
not, which by the clock on the wall would double their ratio.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import thread_time
from typing import Any, NamedTuple

import numpy as np

from turnscrew.estimate.pose_ipopt import IpoptSolver
from turnscrew.estimate.pose_problem import Tolerances
from turnscrew.estimate.pose_solution import PoseSolution, PoseSolver
from turnscrew.estimate.pose_sqp import SqpSolver
from turnscrew.geometry.arrays import Array
from turnscrew.study.solvers.instances import Posed

REACHED = 1e-6
"""How far from IPOPT's (r . rbar)^2 counts as there: its own "acceptable" tolerance.  It itself stops 3e-8 short of the
optimum, and of two corners of a contact's box that differ by less the problem does not tell which is better."""

TURN = 25
"""Frames that one solver has to itself before the other's turn: what else the machine does to the caches falls on both
alike, and as in the loop a solver finds its own code warm."""

TOLERANCES = Tolerances()
SOLVERS: Mapping[str, PoseSolver] = {"ipopt": IpoptSolver(), "sqp": SqpSolver()}

Row = dict[str, Any]
"""What is found out of one frame, or one correction: numbers and words by the names of a table's columns."""


class Answer(NamedTuple):
    """The last solution to a frame; steps and processor time [s] of all tries, warm and cold."""

    solution: PoseSolution
    iterations: int
    time: float


def in_turns(frames: Sequence[Posed], solvers: Mapping[str, PoseSolver]) -> dict[str, list[Answer]]:
    """Each solver's answers to all frames: warm by its own last answer where the same fingers go on, cold otherwise.

    Programs are built before the clock runs.
    """
    for posed in {posed.problem: posed for posed in frames}.values():
        for solver in solvers.values():
            _solved(solver, replace(posed, goes_on=True), _solved(solver, posed, None))
    answers: dict[str, list[Answer]] = {name: [] for name in solvers}
    for first in range(0, len(frames), TURN):
        for name, solver in solvers.items():
            for posed in frames[first : first + TURN]:
                answers[name].append(_solved(solver, posed, answers[name][-1] if answers[name] else None))
    return answers


def _solved(solver: PoseSolver, posed: Posed, before: Answer | None) -> Answer:
    warm = before.solution.multipliers if before is not None and before.solution.accepted and posed.goes_on else None
    began = thread_time()
    solution = solver.solve(posed.problem, posed.frame, TOLERANCES, posed.x0, warm)
    iterations = solution.iterations
    if warm is not None and not solution.accepted:
        solution = solver.solve(posed.problem, posed.frame, TOLERANCES, posed.x0, None)
        iterations += solution.iterations
    return Answer(solution, iterations, thread_time() - began)


def compared(frames: Sequence[Posed]) -> list[Row]:
    """One row a frame: contacts `k`, and of each solver what `_told` says, as `sqp.status`."""
    answers = in_turns(frames, SOLVERS)
    return [
        {"k": posed.problem.k}
        | {f"{name}.{key}": value for name in answers for key, value in _told(answers[name][i]).items()}
        for i, posed in enumerate(frames)
    ]


def _told(answer: Answer) -> Row:
    solution = answer.solution
    found = solution.accepted
    return {
        "found": found,
        "objective": solution.objective**2 if found else np.nan,
        "violation": max(solution.residuals.excess, 0.0) if found else np.nan,
        "status": solution.status,
        "iterations": answer.iterations,
        "time": answer.time,
    }


def solver_figures(rows: Sequence[Row]) -> dict[str, Any]:
    """The comparison over some frames, one at least.

    Returns:
        n: Frames.
        ipopt_found, reached: In how many IPOPT found an answer, and in how many of these SQP reached it.
        short: By how much (r . rbar)^2 falls short of IPOPT's where SQP found any answer, the most.
        better: In how many SQP's is better by more than `REACHED`.
        missed, none: Where SQP did not reach IPOPT's answer, and where IPOPT found none: what SQP said, and how often.
        ratio: Of the median times.
        ipopt, sqp: Of each solver: found, violation (largest), status, iterations and ms (median and 99 %).
    """
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    found, ours = columns["ipopt.found"], columns["sqp.found"]
    short = columns["ipopt.objective"] - columns["sqp.objective"]
    both = found & ours
    reached = both & ~(short > REACHED)
    figures: dict[str, Any] = {
        "n": len(rows),
        "ipopt_found": int(found.sum()),
        "reached": int(reached.sum()),
        "short": float(short[both].max(initial=0.0)),
        "better": int((short[both] < -REACHED).sum()),
        "missed": dict(Counter(columns["sqp.status"][found & ~reached].tolist())),
        "none": dict(Counter(columns["sqp.status"][~found].tolist())),
    }
    figures |= {name: _of_one(columns, name) for name in SOLVERS}
    figures["ratio"] = figures["ipopt"]["ms"]["median"] / figures["sqp"]["ms"]["median"]
    return figures


def _of_one(columns: Mapping[str, np.ndarray], name: str) -> dict[str, Any]:
    found = columns[f"{name}.found"]
    return {
        "found": int(found.sum()),
        "violation": float(columns[f"{name}.violation"][found].max(initial=0.0)),
        "status": dict(Counter(columns[f"{name}.status"].tolist())),
        "iterations": middle_and_tail(columns[f"{name}.iterations"]),
        "ms": middle_and_tail(1e3 * columns[f"{name}.time"]),
    }


def middle_and_tail(values: Array) -> dict[str, float]:
    """Median and 99th percentile."""
    return {"median": float(np.median(values)), "p99": float(np.percentile(values, 99.0))}
