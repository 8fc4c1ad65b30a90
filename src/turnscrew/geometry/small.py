"""Small dense algebra for compiled functions to call."""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled


@compiled
def cross(a: Array, b: Array) -> Array:
    """Cross product (3,) of two vectors (3,)."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@compiled
def solve_positive(M: Array, B: Array) -> Array:
    """`M^-1 B` by Cholesky's decomposition, for matrices so small that LAPACK's calls cost more than its arithmetic.

    Args:
        M: (n, n) symmetric, positive definite; otherwise the result is not a number.
        B: (n, m).

    Returns:
        (n, m).
    """
    n, m = B.shape
    L, X = np.empty((n, n)), B.copy()
    for i in range(n):
        for j in range(i + 1):
            rest = M[i, j]
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(rest) if i == j else rest / L[j, j]
    for i in range(n):
        for k in range(i):
            for c in range(m):
                X[i, c] -= L[i, k] * X[k, c]
        for c in range(m):
            X[i, c] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            for c in range(m):
                X[i, c] -= L[k, i] * X[k, c]
        for c in range(m):
            X[i, c] /= L[i, i]
    return X
