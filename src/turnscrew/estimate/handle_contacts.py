"""Closest points of all five fingertips and the handle, with the learned error of its radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import ClosestPoints, closest_points
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.surfaces import SurfaceOfRevolution

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


@dataclass(frozen=True, slots=True)
class HandleContacts:
    """Where each fingertip is nearest to the handle.

    Attributes:
        points: The five closest points, of the handle without its radius error.
        c_W: (5, 3) points on the handle, in W [m].
        tip_W: (5, 3) points on the fingertips, in W [m].
        n_W: (5, 3) the handle's outward unit normals there, in W.
        gap: (5,) distances [m].
    """

    points: tuple[ClosestPoints, ...]
    c_W: Array
    tip_W: Array
    n_W: Array
    gap: Array


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
    points = tuple(
        closest_points(handle, capsule, p_WT, R_WT, tips.p_WF[i], tips.R_WF[i]) for i, capsule in enumerate(capsules)
    )
    n = np.array([point.n_W for point in points])
    c = np.array([point.c_W for point in points]) + radius_error * n
    gap = np.array([point.gap for point in points]) - radius_error
    return HandleContacts(points, c, np.array([point.tip_W for point in points]), n, gap)
