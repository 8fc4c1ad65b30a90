"""Differences against derivatives that are known, and states as vectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.study.stability.linearise import jacobian, pack, smoothed_jacobian, unpack


def test_a_quadratic_has_its_linear_part_exactly():
    rng = np.random.default_rng(1)
    A, Q = rng.normal(size=(3, 4)), rng.normal(size=(3, 4, 4))

    def f(x: np.ndarray) -> np.ndarray:
        return A @ x + np.einsum("ijk,j,k->i", Q, x, x)

    # central differences cancel the square; rounding of 1e-16 over steps of 1e-3 is left
    np.testing.assert_allclose(jacobian(f, np.full(4, 1e-3)), A, atol=1e-12)


def test_a_rotation_that_is_turned_on_has_the_closed_form_on_the_manifold():
    R, omega = exp_so3(np.array([0.3, -0.2, 0.5])), np.array([0.4, 0.1, -0.3])

    def f(phi: np.ndarray) -> np.ndarray:
        moved, rest = exp_so3(phi) @ R, exp_so3(omega) @ R
        return log_so3(exp_so3(omega) @ moved @ rest.T)

    # turning on in W turns the deviation along; the third-order error of a step of 1e-4 is 1e-8
    np.testing.assert_allclose(jacobian(f, np.full(3, 1e-4)), exp_so3(omega), atol=1e-7)


def test_the_median_over_points_passes_over_a_kink():
    def f(x: np.ndarray) -> np.ndarray:
        # a corner that touches only while the other coordinate is next to 0
        return np.array([2.0 * x[0] + 0.5 * (x[0] > 0.0) * (abs(x[1]) < 0.03)])

    steps = np.full(2, 0.1)
    # half of the corner's .5 over the step of .1
    assert abs(jacobian(f, steps)[0, 0] - 2.0) > 2.4
    # a quarter of all points are that near; of nine, five are in 5 % of all draws
    np.testing.assert_allclose(smoothed_jacobian(f, steps, 9, np.random.default_rng(4)), [[2.0, 0.0]], atol=1e-12)


def test_the_median_of_a_linear_map_is_the_map():
    A = np.random.default_rng(5).normal(size=(3, 4))
    found = smoothed_jacobian(lambda x: A @ x, np.full(4, 1e-3), 5, np.random.default_rng(6))
    np.testing.assert_allclose(found, A, atol=1e-11)


@dataclass(frozen=True)
class Inner:
    a: np.ndarray
    count: int


@dataclass(frozen=True)
class Outer:
    x: float
    inner: Inner
    pair: tuple[np.ndarray, float]
    marks: np.ndarray
    name: str


STATE = Outer(1.5, Inner(np.arange(4.0).reshape(2, 2), 7), (np.array([8.0]), 9.0), np.array([1, 2]), "roll")


def test_a_state_becomes_its_floating_numbers():
    np.testing.assert_array_equal(pack(STATE), [1.5, 0.0, 1.0, 2.0, 3.0, 8.0, 9.0])


def test_a_vector_becomes_a_state_with_the_rest_unchanged():
    there = unpack(STATE, pack(STATE) + 1.0)
    np.testing.assert_array_equal(pack(there), pack(STATE) + 1.0)
    assert there.inner.a.shape == (2, 2)
    assert (there.inner.count, there.name) == (7, "roll")
    np.testing.assert_array_equal(there.marks, [1, 2])
