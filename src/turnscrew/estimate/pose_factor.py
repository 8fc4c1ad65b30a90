"""The Cholesky factor of the pose problem's Hessian, compiled, and the rows seen through it.

The Hessian is an arrow: position alone, contacts each for itself, and the rotation coupled with all of them.
Eliminated contacts first and rotation last it has a factor L with no other entries than its own, and a row of a
contact, which is about position, rotation and that contact, keeps its ten entries when it is divided by L'.  Such a row
is stored as (position 3, rotation 3, contact 4), with `at` the place in z of its contact.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled


@compiled
def factored(H: Array, L: Array) -> None:
    """Fills in L with H = L L'.

    Args:
        H: (6 + 4k, 6 + 4k) positive definite; its lower triangle is read.
        L: (6 + 4k, 6 + 4k) whose entries of position, rotation, contacts, and rotation by contacts are written.
    """
    for i in range(3):
        L[i, i] = np.sqrt(H[i, i])
        for j in range(i + 1):
            L[3 + i, 3 + j] = H[3 + i, 3 + j]
    for at in range(6, len(H), 4):
        for i in range(4):
            for j in range(i + 1):
                rest = H[at + i, at + j]
                for m in range(j):
                    rest -= L[at + i, at + m] * L[at + j, at + m]
                L[at + i, at + j] = np.sqrt(rest) if i == j else rest / L[at + j, at + j]
        for i in range(3, 6):
            for j in range(4):
                rest = H[at + j, i]
                for m in range(j):
                    rest -= L[i, at + m] * L[at + j, at + m]
                L[i, at + j] = rest / L[at + j, at + j]
            for j in range(3, i + 1):
                for m in range(at, at + 4):
                    L[i, j] -= L[i, m] * L[j, m]
    for i in range(3, 6):
        for j in range(3, i + 1):
            for m in range(3, j):
                L[i, j] -= L[i, m] * L[j, m]
            L[i, j] = np.sqrt(L[i, j]) if i == j else L[i, j] / L[j, j]


@compiled
def divided(L: Array, M: Array, row: int, at: int) -> None:
    """Divides a row of M (any, 10) by L', in place."""
    for i in range(3):
        M[row, i] /= L[i, i]
    for i in range(4):
        rest = M[row, 6 + i]
        for m in range(i):
            rest -= L[at + i, at + m] * M[row, 6 + m]
        M[row, 6 + i] = rest / L[at + i, at + i]
    for i in range(3, 6):
        rest = M[row, i]
        for m in range(4):
            rest -= L[i, at + m] * M[row, 6 + m]
        for m in range(3, i):
            rest -= L[i, m] * M[row, m]
        M[row, i] = rest / L[i, i]


@compiled
def returned(L: Array, y: Array, d: Array) -> None:
    """Fills in d (6 + 4k,) with L' d = y."""
    for i in range(3):
        d[i] = y[i] / L[i, i]
    for i in range(5, 2, -1):
        rest = y[i]
        for m in range(i + 1, 6):
            rest -= L[m, i] * d[m]
        d[i] = rest / L[i, i]
    for at in range(6, len(y), 4):
        for i in range(at + 3, at - 1, -1):
            rest = y[i]
            for m in range(3, 6):
                rest -= L[m, i] * d[m]
            for m in range(i + 1, at + 4):
                rest -= L[m, i] * d[m]
            d[i] = rest / L[i, i]
