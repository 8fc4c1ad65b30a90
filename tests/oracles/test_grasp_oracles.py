"""The grasp's inverse against NumPy's singular value decomposition, and a lever one can check by hand."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.contact.grasp import grasp

assert_close = partial(np.testing.assert_allclose, rtol=0.0)


@pytest.mark.parametrize("k", [1, 2, 3, 4, 5])
def test_the_inverse_is_the_moore_penrose_inverse(k):
    rng = np.random.default_rng(k)
    for _ in range(20):
        angles = rng.permutation(np.linspace(0.0, 2.0 * np.pi, k, endpoint=False)) + rng.uniform(-0.3, 0.3, k)
        c = np.column_stack([0.018 * np.cos(angles), 0.018 * np.sin(angles), 0.13 + 0.01 * rng.normal(size=k)])
        hold = grasp(c, 0.01 * rng.normal(size=3))
        expected = np.linalg.pinv(hold.G, rcond=1e-6)
        # Entries are up to 1 / 10 mm; eigenvalues of G G^T square the condition, which costs four more digits.
        assert_close(hold.inverse, expected, atol=1e-9)
        assert hold.rank == np.linalg.matrix_rank(hold.G, tol=1e-6)


def test_opposed_fingers_turn_the_tool_by_a_couple():
    # 0.18 N.m on a handle of 15.5 mm radius: each finger pushes along the circumference with tau / 2 r.
    r, tau = 0.0155, 0.18
    hold = grasp(np.array([[r, 0.0, 0.13], [-r, 0.0, 0.13]]), np.zeros(3))
    out = hold.distribute(np.array([0.0, 0.0, 0.0, 0.0, 0.0, -tau]))
    assert_close(
        out.f_W, [[0.0, -tau / (2 * r), 0.0], [0.0, tau / (2 * r), 0.0]], atol=1e-10
    )  # rounding of 1e-16 by the condition of G G^T, 1e5
    assert_close(out.lost, 0.0, atol=1e-10)


def test_thrust_is_shared_equally():
    hold = grasp(np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13]]), np.zeros(3))
    out = hold.distribute(np.array([0.0, 0.0, -5.0, 0.0, 0.0, 0.0]))
    assert_close(
        out.f_W, [[0.0, 0.0, -2.5], [0.0, 0.0, -2.5]], atol=1e-10
    )  # rounding of 1e-16 by the condition of G G^T, 1e5
