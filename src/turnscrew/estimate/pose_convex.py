"""The pose problem's Hessian made convex, compiled.

The modified Cholesky factorisation of Gill, Murray and Wright (Practical Optimization, 4.4.2.2): a pivot that is
negative, or so small that later ones would drown in what it subtracts from them, is replaced by a larger one.
Contacts are eliminated one by one, as only the rotation couples them, and the rotation last; the position has no
curvature.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled

FLAT = 1e-6
"""Least pivot of a contact's parameters, a ten-thousandth of what multipliers give them as a rule."""

STEEP = 0.1
"""Least pivot of the rotation, a tenth of what the objective gives it."""

SHARE = 0.5
"""What one pivot may take of the rotation's own curvature, which is 1."""


@compiled
def convexified(H: Array, raised: Array) -> None:
    """Adds to H's diagonal what makes it positive semidefinite.

    Args:
        H: (6 + 4k, 6 + 4k) over position, rotation and contacts, whose lower triangle is read; both come back.
        raised: (4k,) to be filled in with what was added for the contacts.
    """
    n, largest = len(H), FLAT
    A = np.zeros((7, 7))
    for first in range(6, n, 4):
        for i in range(first, first + 4):
            for j in range(first, i + 1):
                largest = max(largest, abs(H[i, j]))
    for i in range(3):
        for j in range(i + 1):
            A[4 + i, 4 + j] = H[3 + i, 3 + j]
    for first in range(6, n, 4):
        # a contact's own rows, then the rotation's
        for i in range(4):
            for j in range(i + 1):
                A[i, j] = H[first + i, first + j]
            for j in range(3):
                A[4 + j, i] = H[first + i, 3 + j]
        for i in range(4):
            raised[first - 6 + i] = eliminated(A, i, len(A) - 3, largest, SHARE, FLAT)
            H[first + i, first + i] += raised[first - 6 + i]
    for i in range(4, 7):
        H[i - 1, i - 1] += eliminated(A, i, len(A), 1.0, 1.0, STEEP)
    for i in range(n):
        for j in range(i):
            H[j, i] = H[i, j]


@compiled
def eliminated(A: Array, j: int, near: int, most_near: float, most_far: float, least: float) -> float:
    """Pivots on A_jj, made so large that it takes no more from any later pivot than is said.

    Args:
        A: (m, m) whose lower triangle is what is left.
        j: Row.
        near: End of the rows from which it may take `most_near`; from those beyond, `most_far`.
        most_near: See there.
        most_far: See there.
        least: Least pivot.

    Returns:
        What the pivot was raised by.
    """
    pivot = max(abs(A[j, j]), least)
    for i in range(j + 1, len(A)):
        pivot = max(pivot, A[i, j] * A[i, j] / (most_near if i < near else most_far))
    for i in range(j + 1, len(A)):
        share = A[i, j] / pivot
        for m in range(j + 1, i + 1):
            A[i, m] -= share * A[m, j]
    added: float = pivot - A[j, j]
    return added
