from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.geometry.euler import (
    body_rate_matrix,
    body_rate_matrix_derivative,
    euler_rate_matrix,
    euler_rate_matrix_derivative,
    matrix_from_euler,
)
from turnscrew.geometry.rotations import exp_so3, log_so3, skew

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

STEP = 1e-5
TRUNCATION = 1e-9  # central differences: third derivatives of order 1 times STEP^2 / 6, and 1e-16 / STEP of rounding


@pytest.fixture(params=range(8))
def motion(request):
    rng = np.random.default_rng(request.param)
    gamma = rng.uniform([-3.0, -1.2, -3.0], [3.0, 1.2, 3.0])
    return gamma, rng.normal(size=3)


def test_t_turns_rates_of_angles_into_angular_velocity_in_the_world(motion):
    gamma, gammadot = motion
    forward, back = matrix_from_euler(gamma + STEP * gammadot), matrix_from_euler(gamma - STEP * gammadot)
    omega_W = log_so3(forward @ back.T) / (2.0 * STEP)
    assert_close(euler_rate_matrix(gamma) @ gammadot, omega_W, atol=10 * TRUNCATION)  # rates up to 3 rad/s, cubed
    omega_T = log_so3(back.T @ forward) / (2.0 * STEP)
    assert_close(body_rate_matrix(gamma) @ gammadot, omega_T, atol=10 * TRUNCATION)


@pytest.mark.parametrize(
    ("matrix", "derivative"),
    [(euler_rate_matrix, euler_rate_matrix_derivative), (body_rate_matrix, body_rate_matrix_derivative)],
)
def test_rate_matrices_derivatives_are_their_central_differences(motion, matrix, derivative):
    gamma, gammadot = motion
    numeric = (matrix(gamma + STEP * gammadot) - matrix(gamma - STEP * gammadot)) / (2.0 * STEP)
    assert_close(derivative(gamma, gammadot), numeric, atol=10 * TRUNCATION)  # as above


def test_exp_moves_along_its_own_axis_at_the_given_speed(motion):
    _, omega = motion
    numeric = (exp_so3((1.0 + STEP) * omega) - exp_so3((1.0 - STEP) * omega)) / (2.0 * STEP)
    assert_close(numeric, exp_so3(omega) @ skew(omega), atol=10 * TRUNCATION)  # as above
