"""Both solvers of the pose problem on the same random frames: `python -m pytest benchmarks/test_pose_solvers.py`.

The solvers take turns within one process, so that what else the machine does falls on both alike; quoted are medians.
"""

from __future__ import annotations

from time import process_time

import numpy as np
import pytest
from oracles.test_pose_refinement import HANDLES, TIP, grasp

from turnscrew.estimate.pose_ipopt import IpoptSolver
from turnscrew.estimate.pose_problem import Tolerances, pose_problem
from turnscrew.estimate.pose_sqp import SqpSolver
from turnscrew.geometry.rotations import matrix_from_quaternion

FRAMES = 200
TURN = 25
"""Frames that one solver has to itself before the other's turn, as in the loop a solver finds its own code warm."""


def frames(k: int) -> list[tuple]:
    """Grasps seen with 5 mm and 3 deg of noise."""
    problem, out = pose_problem(HANDLES["cylinder"], TIP, k), []
    for seed in range(FRAMES):
        case = grasp(HANDLES["cylinder"], k, 10_000 + seed, noise=np.deg2rad(3.0))
        p = case.p_WT + np.random.default_rng([seed, 5]).normal(0.0, 0.005, 3)
        x0 = problem.point(case.frame, p, matrix_from_quaternion(case.frame.r_bar), case.frame.xi, case.uv)
        out.append((problem, case.frame, Tolerances(), x0, None))
    return out


@pytest.mark.parametrize("k", [2, 3, 4])
@pytest.mark.benchmark(group="pose", timer=process_time)
def test_the_real_time_solver_takes_less_than_a_fifth_of_ipopts_time(benchmark, k):
    cases, solvers = frames(k), {"ipopt": IpoptSolver(), "sqp": SqpSolver()}
    for solver in solvers.values():
        solver.solve(*cases[0])
    times: dict[str, list[float]] = {name: [] for name in solvers}

    def both() -> None:
        for first in range(0, FRAMES, TURN):
            for name, solver in solvers.items():
                times[name] += [solver.solve(*case).wall_time for case in cases[first : first + TURN]]

    benchmark.pedantic(both, rounds=1)
    median = {name: float(np.median(values)) for name, values in times.items()}
    benchmark.extra_info |= {f"{name}_median_ms": 1e3 * value for name, value in median.items()}
    benchmark.extra_info |= {f"{name}_p99_ms": 1e3 * float(np.percentile(times[name], 99)) for name in times}
    benchmark.extra_info["ratio"] = median["ipopt"] / median["sqp"]
    # a tenth is the aim; 7 (four contacts, idle machine) to 19 (two contacts, busy machine) was measured: neighbours on
    # the caches slow IPOPT down more
    assert benchmark.extra_info["ratio"] > 5.0
