"""Small algebra against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.geometry.euler import body_rate_matrix, euler_rates
from turnscrew.geometry.small import cross, solve_positive

RNG = np.random.default_rng(11)


def test_cross_is_numpys():
    a, b = RNG.normal(size=(2, 3))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))


@pytest.mark.parametrize(("n", "m"), [(3, 1), (12, 24), (24, 12)])
def test_solutions_of_positive_systems_are_lapacks(n, m):
    A, B = RNG.normal(size=(n, n)), RNG.normal(size=(n, m))
    M = A @ A.T + np.eye(n)
    # rounding of 1e-16 times the matrix's condition, some hundreds
    np.testing.assert_allclose(solve_positive(M, B), np.linalg.solve(M, B), atol=1e-11)


def test_a_matrix_that_is_not_positive_gives_no_number():
    assert np.isnan(solve_positive(-np.eye(3), np.ones((3, 1)))).all()


def test_euler_rates_undo_the_body_rate_matrix():
    gamma, rates = np.array([0.3, -0.5, 1.0]), np.array([0.2, -0.4, 1.3])
    np.testing.assert_allclose(euler_rates(gamma, body_rate_matrix(gamma) @ rates), rates, atol=1e-14)
