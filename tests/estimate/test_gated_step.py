"""The compiled update against the textbook's formulas in plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.estimate.gated_step import GATE, Rows, gated_step

N = 12


def drawn(rng: np.random.Generator, blocks: tuple[int, ...], scale: float) -> tuple[np.ndarray, Rows]:
    """A covariance, and measurements whose innovations are `scale` times as large as they should be."""
    A, m = rng.normal(size=(N, N)), sum(blocks)
    B, H = rng.normal(size=(m, m)), rng.normal(size=(m, N)) * (rng.random((m, N)) < 0.5)
    P, R = A @ A.T, B @ B.T
    return P, Rows(H, scale * np.linalg.cholesky(H @ P @ H.T + R) @ rng.normal(size=m), R, blocks)


def textbook(P: np.ndarray, rows: Rows) -> tuple[np.ndarray, np.ndarray, tuple[bool, ...], list[float]]:
    S, nis, stop = rows.H @ P @ rows.H.T + rows.R, [], 0
    for size in rows.blocks:
        block = slice(stop, stop + size)
        nis.append(float(rows.z[block] @ np.linalg.solve(S[block, block], rows.z[block])))
        stop += size
    accepted = tuple(x <= GATE[size] for x, size in zip(nis, rows.blocks, strict=True))
    keep = np.repeat(accepted, rows.blocks)
    H, z = rows.H[keep], rows.z[keep]
    K = P @ H.T @ np.linalg.inv(S[np.ix_(keep, keep)])
    return K @ z, P - K @ H @ P, accepted, nis


@pytest.mark.parametrize("blocks", [(6, 3), (3,), (1,), (1, 1, 1, 1)])
def test_step_is_the_textbooks(blocks: tuple[int, ...]) -> None:
    rng, left_out = np.random.default_rng(0), 0
    for _ in range(50):
        P, rows = drawn(rng, blocks, 3.0)
        step = gated_step(P, rows)
        error, after, accepted, nis = textbook(P, rows)
        assert step.verdict.accepted == accepted
        left_out += not all(accepted)
        # rounding of 1e-16, times the condition of S, up to 1e5 here
        np.testing.assert_allclose(step.verdict.nis, nis, rtol=1e-9)
        np.testing.assert_allclose(step.error, error, atol=1e-9 * np.abs(P).max())
        np.testing.assert_allclose(step.P, after, atol=1e-9 * np.abs(P).max())
        np.testing.assert_array_equal(step.P, step.P.T)
    # else the gates were not tried
    assert left_out > 0


def test_a_covariance_that_is_none_moves_nothing() -> None:
    P, rows = drawn(np.random.default_rng(1), (3,), 1.0)
    broken = Rows(rows.H, rows.z, rows.R - 2.0 * (rows.H @ P @ rows.H.T + rows.R), rows.blocks)
    step = gated_step(P, broken)
    assert step.verdict.accepted == (False,)
    assert step.verdict.nis == (np.inf,)
    np.testing.assert_array_equal(step.error, np.zeros(N))
    np.testing.assert_array_equal(step.P, P)


def test_blocks_that_contradict_each_other_are_told() -> None:
    """Each has a variance of its own, yet together they have none: S is indefinite."""
    rows = Rows(np.zeros((2, N)), np.ones(2), np.array([[1.0, 2.0], [2.0, 1.0]]), (1, 1))
    step = gated_step(np.eye(N), rows)
    assert step.verdict == type(step.verdict)((False, False), (1.0, 1.0))
    np.testing.assert_array_equal(step.error, np.zeros(N))
