"""A Kalman update that judges its measurements first: blocks beyond a gate are left out and reported."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.arrays import Rows as Numbers
from turnscrew.geometry.compiled import compiled

GATE = {1: 25.0, 3: 31.8, 6: 39.5}
"""Squared Mahalanobis distance of a 5-sigma outlier: as improbable (6e-7) in three and six dimensions as in one."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Measurements stacked, each block gated as a whole.

    Attributes:
        H: (m, n) derivative of the prediction by the errors.
        z: (m,) innovation: measured less predicted.
        R: (m, m) covariance of the measurement noise.
        blocks: Sizes of the blocks, 1, 3 or 6, in order.
    """

    H: Array
    z: Array
    R: Array
    blocks: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the gates said of each block: accepted or not, and its normalised innovation squared."""

    accepted: tuple[bool, ...]
    nis: tuple[float, ...]


class Step(NamedTuple):
    """Estimated errors (n,), their covariance (n, n) afterwards, and what the gates said."""

    error: Array
    P: Array
    verdict: Verdict


def gated_step(P: Array, rows: Rows) -> Step:
    """What measurements say of a state's errors.

    Args:
        P: (n, n) covariance of the errors before.
        rows: The measurements.

    Returns:
        The step; nothing moves where no block passes its gate, or where P has lost its definiteness to rounding.
    """
    sizes, limits = _gates(rows.blocks)
    error, after, nis, definite = _step(P, rows.H, rows.z, rows.R, sizes, limits)
    distances = tuple(nis.tolist())
    accepted = tuple(definite and x <= GATE[size] for x, size in zip(distances, rows.blocks, strict=True))
    return Step(error, after, Verdict(accepted, distances))


@lru_cache(maxsize=64)
def _gates(blocks: tuple[int, ...]) -> tuple[Numbers, Array]:
    """Sizes of the blocks, and their gates."""
    return np.array(blocks, dtype=np.intp), np.array([GATE[size] for size in blocks])


def stacked(*parts: Rows) -> Rows:
    """Several measurements as one, their noises independent."""
    m = sum(len(part.z) for part in parts)
    R, start = np.zeros((m, m)), 0
    for part in parts:
        stop = start + len(part.z)
        R[start:stop, start:stop] = part.R
        start = stop
    H, z = np.concatenate([part.H for part in parts]), np.concatenate([part.z for part in parts])
    return Rows(H, z, R, sum((part.blocks for part in parts), ()))


@compiled
def _innovated(P: Array, H: Array, z: Array, R: Array) -> tuple[Array, Array]:
    """H P with z as one more column (m, n + 1), and S = H P H^T + R; zeros of H, which most of it is, cost nothing."""
    m, n = H.shape
    HP, S = np.zeros((m, n + 1)), R.copy()
    for i in range(m):
        for k in range(n):
            factor = H[i, k]
            if factor != 0.0:
                for j in range(n):
                    HP[i, j] += factor * P[k, j]
        HP[i, n] = z[i]
    for j in range(m):
        for k in range(n):
            if H[j, k] != 0.0:
                for i in range(m):
                    S[i, j] += HP[i, k] * H[j, k]
    return HP, S


@compiled
def _factored(S: Array, picked: Numbers) -> tuple[Array, bool]:
    """L of S = L L^T, for some rows and columns of S; and whether there is one, S being positive definite."""
    m = len(picked)
    L = np.zeros((m, m))
    for i in range(m):
        for j in range(i + 1):
            rest = S[picked[i], picked[j]]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = rest / L[j, j]
            elif rest > 0.0:
                L[i, i] = sqrt(rest)
            else:
                return L, False
    return L, True


@compiled
def _whitened(L: Array, A: Array, picked: Numbers) -> Array:
    """L^-1 times some rows of A (m, n + 1): measurements in units of their deviation."""
    m, n = len(picked), A.shape[1]
    W = np.empty((m, n))
    for i in range(m):
        for j in range(n):
            W[i, j] = A[picked[i], j]
        for k in range(i):
            factor = L[i, k]
            for j in range(n):
                W[i, j] -= factor * W[k, j]
        for j in range(n):
            W[i, j] /= L[i, i]
    return W


@compiled
def _judged(S: Array, HP: Array, sizes: Numbers) -> Array:
    """Squared Mahalanobis distance z^T S^-1 z of each block, endless where its covariance is none."""
    nis, start = np.empty(len(sizes)), 0
    for b in range(len(sizes)):
        block = np.empty(sizes[b], np.intp)
        for i in range(sizes[b]):
            block[i] = start + i
        L, definite = _factored(S, block)
        nis[b] = 0.0 if definite else inf
        if definite:
            w = _whitened(L, HP, block)
            for i in range(len(w)):
                nis[b] += w[i, -1] * w[i, -1]
        start += sizes[b]
    return nis


@compiled
def _taken_in(P: Array, W: Array) -> tuple[Array, Array]:
    """K z and P - K H P of whitened rows [H P, z]: W_z^T W_HP and P - W_HP^T W_HP, symmetric to the last bit."""
    n = len(P)
    error, after = np.zeros(n), P.copy()
    for k in range(len(W)):
        for i in range(n):
            factor = W[k, i]
            error[i] += factor * W[k, n]
            for j in range(n):
                after[i, j] -= factor * W[k, j]
    return error, after


@compiled
def _step(P: Array, H: Array, z: Array, R: Array, sizes: Numbers, limits: Array) -> tuple[Array, Array, Array, bool]:
    """`gated_step`: errors, covariance, the blocks' distances, and whether their S was positive definite."""
    HP, S = _innovated(P, H, z, R)
    nis = _judged(S, HP, sizes)
    picked, start, m = np.empty(len(z), np.intp), 0, 0
    for b in range(len(sizes)):
        if nis[b] <= limits[b]:
            for i in range(start, start + sizes[b]):
                picked[m] = i
                m += 1
        start += sizes[b]
    picked = picked[:m]
    L, definite = _factored(S, picked)
    if not definite:
        picked = picked[:0]
    error, after = _taken_in(P, _whitened(L, HP, picked))
    return error, after, nis, definite
