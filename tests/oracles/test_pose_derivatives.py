"""The compiled rows of the pose problem, their derivatives and convex Hessian against CasADi's of the same problem."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np
import pytest
from oracles.test_pose_refinement import TIP
from oracles.test_pose_solvers import FAMILY, TOLERANCES, on, start

from turnscrew.estimate.pose_chart import PHI, Z_POSE, PoseChart, pose_chart
from turnscrew.estimate.pose_convex import convexified
from turnscrew.estimate.pose_problem import PoseFrame, pose_problem, rotation
from turnscrew.estimate.pose_rows import pose_derivatives
from turnscrew.geometry.rotations import matrix_from_quaternion
from turnscrew.geometry.surfaces import SurfaceOfRevolution


def posed(handle: SurfaceOfRevolution, k: int, seed: int) -> tuple[PoseChart, PoseFrame, np.ndarray]:
    """A chart that has taken a frame, its thumb of another radius than the patch, and a place in it."""
    case, problem = on(handle, k, seed), pose_problem(handle, TIP, k)
    chart, frame = pose_chart(problem), case.frame
    chart.take(frame, frame.parameters(TIP.radius), problem.bounds(frame, TOLERANCES))
    rng = np.random.default_rng(seed)
    z = chart.enter(frame, start(problem, case, seed)) + rng.normal(0.0, 0.05, chart.size)
    return chart, frame, z


def casadis(chart: PoseChart, frame: PoseFrame, z: np.ndarray, weights: np.ndarray) -> list[np.ndarray]:
    """Rows, Jacobian and Hessian by algorithmic differentiation."""
    problem, symbol = chart.problem, casadi.SX.sym("z", chart.size)
    s = 0.5 * symbol[PHI]
    turn = rotation(casadi.vertcat(casadi.sqrt(1.0 - casadi.dot(s, s)), s))
    R = turn @ casadi.DM(matrix_from_quaternion(frame.r_bar))
    g = problem.rows(symbol[:3], R, symbol[Z_POSE:], casadi.DM(frame.parameters(TIP.radius)))
    total = 0.5 * casadi.dot(symbol[PHI], symbol[PHI]) + casadi.dot(weights, g)
    function: Any = casadi.Function("all", [symbol], [g, casadi.jacobian(g, symbol), casadi.hessian(total, symbol)[0]])
    return [np.array(casadi.densify(part)) for part in function(z)]


@pytest.mark.parametrize("name", FAMILY)
@pytest.mark.parametrize("k", [1, 3])
def test_rows_and_derivatives_are_those_of_algorithmic_differentiation(name: str, k: int) -> None:
    chart, frame, z = posed(FAMILY[name], k, 3 * k)
    weights = np.random.default_rng(k).normal(size=6 * k)
    g, J, H = casadis(chart, frame, z, weights)
    violation = chart.rows(z)
    # rounding of levers of 14 units, a thousand times where curvatures of a blended seam come in
    np.testing.assert_allclose(chart.g, g.ravel(), atol=1e-13)
    n = chart.size
    outside = np.maximum(np.maximum(chart.low[n:] - chart.g, chart.g - chart.high[n:]), 0.0)
    assert violation == pytest.approx(outside.sum(), abs=1e-13)
    found = np.zeros((n, n))
    pose_derivatives(z, chart._data, chart._jets, weights, chart.J, found)
    np.testing.assert_allclose(chart.J, J, atol=1e-12)
    np.testing.assert_allclose(found, np.tril(H), atol=1e-10)


@pytest.mark.parametrize("k", [1, 2, 4])
def test_the_hessian_is_made_convex_by_its_diagonal_alone(k: int) -> None:
    chart, frame, z = posed(FAMILY["cylinder"], k, k)
    for scale in (0.0, 0.01, 1.0, 100.0):
        weights = scale * np.random.default_rng(k).normal(size=6 * k)
        _, _, H = casadis(chart, frame, z, weights)
        chart.rows(z)
        chart.derivatives(z, weights)
        size = max(1.0, np.abs(H).max())
        added = chart.H - H
        np.testing.assert_allclose(added - np.diag(np.diag(added)), 0.0, atol=1e-12 * size)
        np.testing.assert_allclose(np.diag(added)[Z_POSE:], chart.raised.ravel(), atol=1e-12 * size)
        np.testing.assert_array_equal(chart.H, chart.H.T)
        # rounding of the largest entries
        assert np.linalg.eigvalsh(chart.H).min() > -1e-12 * size


def test_a_convex_hessian_stays_what_it_is() -> None:
    rng = np.random.default_rng(4)
    root = np.zeros((14, 14))
    for at in (6, 10):
        root[at : at + 4, at : at + 4] = np.eye(4) + 0.1 * rng.normal(size=(4, 4))
        root[at : at + 4, 3:6] = 0.1 * rng.normal(size=(4, 3))
    H = root.T @ root
    H[PHI, PHI] += np.eye(3)
    found, raised = np.tril(H), np.empty(8)
    convexified(found, raised)
    # nothing but rounding
    np.testing.assert_allclose(found, H, atol=1e-14)
    np.testing.assert_allclose(raised, 0.0, atol=1e-14)
