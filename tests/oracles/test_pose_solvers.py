"""The real-time solver of III-A against IPOPT over the family, its parts against differences, and against bad data."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from oracles.test_pose_refinement import TIP, Case, grasp, shifted

from turnscrew.estimate import pose_walk
from turnscrew.estimate.pose_chart import PHI, Z_POSE, pose_chart
from turnscrew.estimate.pose_ipopt import IpoptSolver
from turnscrew.estimate.pose_model import ENDLESS, OVERFLOWN
from turnscrew.estimate.pose_problem import PoseProblem, Tolerances, pose_problem
from turnscrew.estimate.pose_refine import Guess, PoseRefiner, Refinement
from turnscrew.estimate.pose_solution import SLACK, Answer, PoseSolution
from turnscrew.estimate.pose_sqp import SqpSolver
from turnscrew.estimate.pose_sqp_status import MODEL_ENDS, SQP_ANSWERS, SqpStatus
from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel, tapered
from turnscrew.geometry.rotations import exp_so3, matrix_from_quaternion
from turnscrew.geometry.surfaces import SurfaceOfRevolution
from turnscrew.study.solvers.comparison import REACHED

FAMILY: dict[str, SurfaceOfRevolution] = {
    "cylinder": Cylinder(0.018, 0.08, 0.2),
    "thin": Cylinder(0.010, 0.08, 0.2),
    "capsule": Capsule(0.015, 0.2),
    "cone": tapered(0.08, 0.2, 0.012, 0.018),
    "barrel": barrel(0.08, 0.2, 0.012, 0.018),
    "waist": barrel(0.08, 0.2, 0.018, 0.014),
    "turned": TurnedHandle((0.08, 0.11, 0.14, 0.17, 0.2), (0.014, 0.016, 0.015, 0.017, 0.015)),
}
CYLINDER = FAMILY["cylinder"]
TOLERANCES = Tolerances()


def start(problem: PoseProblem, case: Case, seed: int) -> np.ndarray:
    """Vision's pose, 5 mm and 3 deg off, and the predicted contacts."""
    p = case.p_WT + np.random.default_rng([seed, 5]).normal(0.0, 0.005, 3)
    return problem.point(case.frame, p, matrix_from_quaternion(case.frame.r_bar), case.frame.xi, case.uv)


def solved(solver: Any, case: Case, handle: SurfaceOfRevolution, seed: int = 0) -> PoseSolution:
    problem = pose_problem(handle, TIP, len(case.xi))
    return solver.solve(problem, case.frame, TOLERANCES, start(problem, case, seed), None)


def on(handle: SurfaceOfRevolution, k: int, seed: int) -> Case:
    """A grasp 140 mm above the tip; the capsule's chart runs in radians and from its end."""
    if not isinstance(handle, Capsule):
        return grasp(handle, k, seed, noise=np.deg2rad(3.0))
    case = grasp(Cylinder(handle.radius, -0.2, 0.2), k, seed, noise=np.deg2rad(3.0))
    # the same surface below its hemisphere: heights become angles, turned downwards
    lower = np.array([1.0, -1.0 / handle.radius])
    turn = np.diag([1.0, -1.0, -1.0])
    half_turned = replace(
        case.frame,
        xi=case.frame.xi * [-1.0, lower[1]],
        r_bar=_times(case.frame.r_bar, turn),
    )
    return replace(case, R_WT=case.R_WT @ turn, xi=case.xi * [-1.0, lower[1]], frame=half_turned)


def _times(r: np.ndarray, R: np.ndarray) -> np.ndarray:
    from turnscrew.geometry.rotations import quaternion_from_matrix

    return quaternion_from_matrix(matrix_from_quaternion(r) @ R)


@pytest.mark.parametrize("name", FAMILY)
@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_it_reaches_ipopts_objective_on_every_handle_of_the_family(name: str, k: int) -> None:
    handle = FAMILY[name]
    for seed in range(3):
        case = on(handle, k, 10 * k + seed)
        reference, ours = solved(IpoptSolver(), case, handle, seed), solved(SqpSolver(), case, handle, seed)
        assert reference.accepted
        assert ours.accepted, ours.status
        assert ours.objective**2 > reference.objective**2 - REACHED


def test_it_reaches_ipopts_objective_in_nearly_all_of_many_instances() -> None:
    missed = []
    for seed in range(120):
        k = 2 + seed % 3
        case = grasp(CYLINDER, k, 2000 + seed, noise=np.deg2rad(3.0))
        reference, ours = solved(IpoptSolver(), case, CYLINDER, seed), solved(SqpSolver(), case, CYLINDER, seed)
        if not (ours.accepted and ours.objective**2 > reference.objective**2 - REACHED):
            missed.append(seed)
    # one in 800 was found to miss it; three of 120 then have a chance of 1e-3
    assert len(missed) < 3


def test_a_feasible_guess_that_looks_as_seen_is_certified_without_a_step() -> None:
    case = grasp(CYLINDER, 2, 3, noise=0.0)
    problem = pose_problem(CYLINDER, TIP, 2)
    x0 = problem.point(case.frame, case.p_WT, case.R_WT, case.xi, case.uv)
    answer = SqpSolver().solve(problem, case.frame, TOLERANCES, x0, None)
    assert (answer.status, answer.iterations) == (SqpStatus.CONVERGED, 0)
    # the merit that ends it at once is the sum of half a squared angle and violations
    assert answer.objective > 1.0 - SqpSolver().tolerance
    np.testing.assert_allclose(answer.x, x0, atol=1e-12)


def test_further_tries_find_corners_that_the_first_misses() -> None:
    gains = []
    first = SqpSolver(concave=np.inf, rolling=np.inf, seam=np.inf)
    for seed in range(100, 150):
        case = grasp(CYLINDER, 2, 5000 + seed, noise=np.deg2rad(3.0))
        once, twice = solved(first, case, CYLINDER, seed), solved(SqpSolver(), case, CYLINDER, seed)
        gains.append(twice.objective**2 - once.objective**2)
    assert max(gains) > REACHED
    # nothing found is lost, but for what the violation of 1e-7 allowed to both is worth
    assert min(gains) > -1e-7


def test_multipliers_of_another_solver_are_ignored() -> None:
    case = grasp(CYLINDER, 2, 1)
    problem = pose_problem(CYLINDER, TIP, 2)
    x0 = start(problem, case, 1)
    for solver, other in ((SqpSolver(), IpoptSolver()), (IpoptSolver(), SqpSolver())):
        theirs = other.solve(problem, case.frame, TOLERANCES, x0, None).multipliers
        cold = solver.solve(problem, case.frame, TOLERANCES, x0, None)
        np.testing.assert_array_equal(solver.solve(problem, case.frame, TOLERANCES, x0, theirs).x, cold.x)


def test_the_charts_objective_is_the_papers() -> None:
    case, problem = grasp(CYLINDER, 2, 7), pose_problem(CYLINDER, TIP, 2)
    chart = pose_chart(problem)
    for angle in (0.0, 0.1, 1.0, 2.5):
        R = exp_so3(angle * np.array([0.6, 0.0, 0.8])) @ matrix_from_quaternion(case.frame.r_bar)
        x = problem.point(case.frame, case.p_WT, R, case.xi, case.uv)
        z = chart.enter(case.frame, x)
        # an identity: rounding only
        assert float(x[3:7] @ case.frame.r_bar) ** 2 == pytest.approx(1.0 - z[PHI] @ z[PHI] / 4.0, abs=1e-14)
        np.testing.assert_allclose(chart.leave(case.frame, z), x, atol=1e-14)
        assert len(z) == Z_POSE + 8


@pytest.mark.parametrize("end", [ENDLESS, OVERFLOWN])
def test_a_model_without_a_solution_ends_the_solve_with_a_status(end: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(*arguments: Any) -> int:
        *_, d, prices = arguments
        d[:], prices[:] = np.nan, np.nan
        return end

    monkeypatch.setattr(pose_walk, "step_model", ended)
    answer = solved(SqpSolver(), grasp(CYLINDER, 2, 0), CYLINDER)
    assert answer.status == MODEL_ENDS[end]
    assert answer.answer is Answer.NEXT_RUNG
    assert not answer.accepted
    assert np.isfinite(answer.x).all()


def test_statuses_of_hard_frames() -> None:
    case = grasp(CYLINDER, 2, 0)
    assert solved(SqpSolver(), shifted(case, 0.02), CYLINDER).status == SqpStatus.INFEASIBLE
    assert solved(SqpSolver(iterations=1), case, CYLINDER).status == SqpStatus.MAX_ITERATIONS
    # finite, but in units of 10 mm no more
    far = replace(case, frame=replace(case.frame, radius_error=1e307))
    assert solved(SqpSolver(), far, CYLINDER).status == SqpStatus.OVERFLOW
    assert set(SQP_ANSWERS) == set(SqpStatus)


def spoilt(rng: np.random.Generator) -> tuple[PoseProblem, Case, Guess]:
    """A frame with a fault of some kind in it."""
    k = int(rng.integers(1, 5))
    case = grasp(CYLINDER, k, int(rng.integers(1000)))
    frame, guess = case.frame, case.guess()
    names = ("p_WS", "r_bar", "p_WF", "R_WF", "tip_radius", "xi")
    for _ in range(rng.integers(1, 3)):
        name = names[rng.integers(len(names))]
        array = getattr(frame, name).copy()
        place = rng.integers(array.size)
        match rng.integers(6):
            case 0:
                array.flat[place] = (np.nan, np.inf, -np.inf)[rng.integers(3)]
            case 1:
                array.flat[place] = 10.0 ** rng.uniform(-300.0, 308.0)
            case 2:
                array[...] = 0.0
            case 3:
                array += rng.normal(0.0, 10.0 ** rng.uniform(-4.0, 6.0), array.shape)
            case 4:
                array[...] = array.flat[place]
            case _:
                array *= -1.0
        if name == "r_bar" and rng.uniform() < 0.5:
            with np.errstate(all="ignore"):
                length = np.linalg.norm(array)
                array = array / length if 0.0 < length < np.inf else array
        frame = replace(frame, **{name: array})
    if rng.uniform() < 0.3:
        frame = replace(frame, radius_error=float(rng.choice([np.nan, np.inf, -0.018, 1e9, 0.0])))
    if rng.uniform() < 0.3:
        guess = replace(guess, R_WT=rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-300.0, 300.0))
    if rng.uniform() < 0.3:
        prices = tuple(rng.normal(size=n) * 10.0 ** rng.uniform(-5.0, 300.0) for n in (6 + 4 * k, 6 * k))
        guess = replace(guess, multipliers=prices)
    return pose_problem(CYLINDER, TIP, k), replace(case, frame=frame), guess


@pytest.mark.filterwarnings("error")
def test_nothing_in_a_frame_makes_it_raise_or_lie() -> None:
    rng = np.random.default_rng(77)
    seen = set()
    for _ in range(400):
        problem, case, guess = spoilt(rng)
        answer = PoseRefiner().solve(problem, case.frame, guess)
        seen.add(answer.status)
        if answer.status is Refinement.PREDICTED:
            assert answer.multipliers is None
            continue
        assert answer.residuals.excess <= SLACK
        for array in (answer.p_WT, answer.R_WT, answer.xi, answer.tip_uv):
            assert np.isfinite(array).all()
        # r . rbar of unit quaternions, rbar's length to 1e-6
        assert answer.objective <= 1.0 + 2e-6
    assert seen >= {Refinement.COLD, Refinement.PREDICTED}
