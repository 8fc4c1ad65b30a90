"""Closest points of all five fingertips and the handle, with the learned error of its radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import (
    CONTACT,
    GAP,
    NORMAL,
    ON_PATCH,
    TIP,
    ClosestPoints,
    closest_table,
    points_of,
    sizes_of,
)
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.surfaces import SurfaceOfRevolution

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


@compiled
def _load(c_W: Array, n_W: Array, f_W: Array, p_WT: Array, R_WT: Array) -> tuple[Array, Array]:
    """`HandleContacts.load`."""
    F_W, F_T, squeeze = np.zeros(6), np.zeros(6), np.empty(len(f_W))
    for i in range(len(f_W)):
        x, y, z = c_W[i, 0] - p_WT[0], c_W[i, 1] - p_WT[1], c_W[i, 2] - p_WT[2]
        for j in range(3):
            F_W[j] += f_W[i, j]
        F_W[3] += y * f_W[i, 2] - z * f_W[i, 1]
        F_W[4] += z * f_W[i, 0] - x * f_W[i, 2]
        F_W[5] += x * f_W[i, 1] - y * f_W[i, 0]
        into = f_W[i, 0] * n_W[i, 0] + f_W[i, 1] * n_W[i, 1] + f_W[i, 2] * n_W[i, 2]
        squeeze[i] = max(-into, 0.0)
    for i in range(3):
        for j in range(3):
            F_T[i] += R_WT[j, i] * F_W[j]
            F_T[3 + i] += R_WT[j, i] * F_W[3 + j]
    return F_T, squeeze


@dataclass(frozen=True, slots=True)
class HandleContacts:
    """Where each fingertip is nearest to the handle.

    Attributes:
        table: (5, 17) rows of `closest_table`, of the handle without its radius error.
        c_W: (5, 3) points on the handle, in W [m].
        tip_W: (5, 3) points on the fingertips, in W [m].
        n_W: (5, 3) the handle's outward unit normals there, in W.
        gap: (5,) distances [m].
    """

    table: Array
    c_W: Array
    tip_W: Array
    n_W: Array
    gap: Array

    @property
    def points(self) -> tuple[ClosestPoints, ...]:
        """The five closest points, of the handle without its radius error."""
        return tuple(points_of(row) for row in self.table)

    def load(self, f_W: Array, p_WT: Array, R_WT: Array) -> tuple[Array, Array]:
        """What forces of the fingertips do to the tool.

        Args:
            f_W: (5, 3) forces on the tool, in W [N].
            p_WT: (3,) origin of T in W [m].
            R_WT: (3, 3) orientation of T in W.

        Returns:
            Their wrench (6,) on the tool at the origin of T, in T, force first [N, N.m]; and how much of each (5,)
            presses into the handle [N].

        Paper: `diag[R, R] F_h = G (f_1; ...; f_k)`, III-B.
        """
        return _load(self.c_W, self.n_W, f_W, p_WT, R_WT)


def capsules_of(tips: Fingertips) -> tuple[Capsule, ...]:
    """The fingertips' patches."""
    return tuple(Capsule(rho, length) for rho, length in zip(tips.rho.tolist(), tips.length.tolist(), strict=True))


def handle_contacts(
    handle: SurfaceOfRevolution,
    radius_error: float,
    capsules: tuple[Capsule, ...],
    tips: Fingertips,
    p_WT: Array,
    R_WT: Array,
) -> HandleContacts:
    """Closest points now; a handle thicker by radius_error is the parallel surface, with the same feet and normals."""
    table = closest_table(handle, sizes_of(capsules), p_WT, R_WT, tips.p_WF, tips.R_WF)
    return HandleContacts(table, *_parallel(table, radius_error))


@compiled
def _parallel(table: Array, radius_error: float) -> tuple[Array, Array, Array, Array]:
    """Points on the handle and on the fingertips, normals and gaps of the parallel surface."""
    n = table[:, NORMAL:ON_PATCH].copy()
    return table[:, CONTACT:TIP] + radius_error * n, table[:, TIP:NORMAL].copy(), n, table[:, GAP] - radius_error
