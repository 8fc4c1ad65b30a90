"""Closest points of a fingertip capsule and a handle: gap, both contacts' parameters, points and normal.

A capsule is all points within rho of a segment, and the handle is a surface of revolution; so the question is
for the point of the segment that is nearest to the handle.  For a cylinder that is the common perpendicular of
two lines, in closed form; any other handle is searched for (`turnscrew.geometry.foot`).

The gap's derivative needs no second search: at the closest points it is stationary in all four parameters, so
only the motion of the bodies themselves counts, along the normal (`gap_gradient`).
"""

from __future__ import annotations

from functools import lru_cache
from math import atan2, hypot, sqrt
from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.foot import Foot, Triple, foot_on_spline
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import cross
from turnscrew.geometry.surfaces import SurfaceOfRevolution

PARALLEL = 1e-12
"""Squared sine of the angle between the axes from which on they count as parallel.  At 1e-6 rad all points of a
40 mm fingertip are equally near to 0.04 um, while rounding of 1e-17 m already moves the foot by 10 um."""

GAP, U, V, XI, ETA = range(5)
CONTACT, TIP, NORMAL = 5, 8, 11
ON_PATCH, ITERATIONS, RESIDUAL, COLUMNS = 14, 15, 16, 17
"""Columns of `closest_table`: where each entry of `ClosestPoints` begins, and how many there are."""


class ClosestPoints(NamedTuple):
    """Where fingertip and handle are nearest.

    Attributes:
        gap: Signed distance [m], negative when they overlap.
        u: Angle of the contact about the fingertip's axis [rad].
        v: Parameter of the contact along the fingertip's meridian [rad].
        xi: Angle of the contact about the handle's axis [rad].
        eta: Parameter of the contact along the handle's meridian (height [m], for all handles here).
        c_W: (3,) point on the handle, in W [m].
        tip_W: (3,) point on the fingertip, in W [m]; `tip_W - c_W = gap n_W` where `on_patch`.
        n_W: (3,) direction from the handle to the fingertip, in W: the handle's outward unit normal where `on_patch`.
        on_patch: Whether both points lie within their patches; if not, a rim is nearest (or the capsule's axis crosses
            a handle that is no cylinder) and the normals are not opposed.
        iterations: Newton steps taken; 0 for the closed form.
        residual: Slope of the distance left at the answer [1]; 0 for the closed form.
    """

    gap: float
    u: float
    v: float
    xi: float
    eta: float
    c_W: Array
    tip_W: Array
    n_W: Array
    on_patch: bool
    iterations: int
    residual: float


@compiled
def _foot_on_axis(radius: float, a: Triple, d: Triple, length: float) -> Foot:
    """Common perpendicular of the capsule's segment and a cylinder's axis, however long the cylinder."""
    square = d[0] * d[0] + d[1] * d[1]
    s = -(a[0] * d[0] + a[1] * d[1]) / square if square > PARALLEL else -0.5 * length
    clamped = s < -length
    s = 0.0 if s > 0.0 else -length if clamped else s
    x, y, z = a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]
    distance = hypot(x, y)
    e_x, e_y = 1.0, 0.0
    if distance > 0.0:
        e_x, e_y = x / distance, y / distance
    elif square > PARALLEL:
        # Axes that meet leave two directions along their common perpendicular: either.
        e_x, e_y = -d[1] / sqrt(square), d[0] / sqrt(square)
    return Foot(s, atan2(e_y, e_x), z, distance - radius, (e_x, e_y, 0.0), not clamped, 0, 0.0)


@compiled
def _turned(R: Array, a: Triple) -> Triple:
    """R a."""
    x, y, z = a
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@compiled
def _turned_back(R: Array, a: Triple) -> Triple:
    """R^T a."""
    x, y, z = a
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )


@compiled
def _assemble(foot: Foot, rho: float, length: float, R_WT: Array, p_WF: Array, R_WF: Array, row: Array) -> None:
    """Fills a row of `closest_table`: points, parameters and normal in W from the foot in T."""
    n_W = _turned(R_WT, foot.direction)
    x, y, z = _turned_back(R_WF, n_W)
    v = atan2(-z, hypot(x, y)) if foot.s == 0.0 else foot.s / rho
    row[GAP] = foot.distance - rho
    row[U], row[V] = atan2(-y, -x), max(v, -length / rho)
    row[XI], row[ETA] = foot.xi, foot.eta
    for i in range(3):
        on_axis = p_WF[i] + foot.s * R_WF[i, 2]
        row[CONTACT + i] = on_axis - foot.distance * n_W[i]
        row[TIP + i] = on_axis - rho * n_W[i]
        row[NORMAL + i] = n_W[i]
    row[ON_PATCH], row[ITERATIONS], row[RESIDUAL] = foot.on_patch, foot.iterations, foot.residual


@compiled
def _closest_rows(
    heights: Array, cubics: Array, straight: bool, sizes: Array, p_WT: Array, R_WT: Array, p_WF: Array, R_WF: Array
) -> Array:
    """Rows of `closest_table`; `straight` tells that the handle is a cylinder, `sizes` are the capsules' (k, 2)."""
    table = np.empty((len(p_WF), COLUMNS))
    for i in range(len(p_WF)):
        rho, length = sizes[i, 0], sizes[i, 1]
        apart = (p_WF[i, 0] - p_WT[0], p_WF[i, 1] - p_WT[1], p_WF[i, 2] - p_WT[2])
        a = _turned_back(R_WT, apart)
        d = _turned_back(R_WT, (R_WF[i, 0, 2], R_WF[i, 1, 2], R_WF[i, 2, 2]))
        foot = _foot_on_axis(cubics[0, 3], a, d, length)
        if not (straight and heights[0] <= foot.eta <= heights[1]):
            foot = foot_on_spline(heights, cubics, a, d, length)
        _assemble(foot, rho, length, R_WT, p_WF[i], R_WF[i], table[i])
    return table


@lru_cache(maxsize=64)
def sizes_of(capsules: tuple[Capsule, ...]) -> Array:
    """(k, 2) radius and length of the cylindrical part of each capsule [m]."""
    return np.array([(capsule.radius, capsule.length) for capsule in capsules])


def closest_table(
    handle: SurfaceOfRevolution, sizes: Array, p_WT: Array, R_WT: Array, p_WF: Array, R_WF: Array
) -> Array:
    """Closest points of some fingertips and a handle, as rows of numbers: what runs at every tick.

    Args:
        handle: The handle's surface, in T.
        sizes: (k, 2) capsules' radii and lengths, as of `sizes_of` [m].
        p_WT: (3,) origin of T in W [m].
        R_WT: (3, 3) orientation of T in W.
        p_WF: (k, 3) centres of the fingertips' hemispheres in W [m].
        R_WF: (k, 3, 3) orientations of F in W, z along the capsule outwards.

    Returns:
        (k, 17): the entries of `ClosestPoints`, in their order; a vector takes three columns from the named one on.

    Raises:
        ModelError: the surface is no handle: its meridian is no spline of the height.
    """
    heights, cubics = handle.spline
    return _closest_rows(heights, cubics, isinstance(handle, Cylinder), sizes, p_WT, R_WT, p_WF, R_WF)


def points_of(row: Array) -> ClosestPoints:
    """The closest points that a row (17,) of `closest_table` tells."""
    gap, u, v, xi, eta = row[:CONTACT].tolist()
    c_W, tip_W, n_W = row[CONTACT:ON_PATCH].reshape(3, 3)
    on_patch, iterations, residual = row[ON_PATCH:].tolist()
    return ClosestPoints(gap, u, v, xi, eta, c_W, tip_W, n_W, bool(on_patch), int(iterations), residual)


def closest_points(
    handle: SurfaceOfRevolution, tip: Capsule, p_WT: Array, R_WT: Array, p_WF: Array, R_WF: Array
) -> ClosestPoints:
    """Closest points of a fingertip and a handle.

    The handle is its patch only: it has no end faces, and beyond its ends the nearest point is on the rim.

    Args:
        handle: The handle's surface, in T.
        tip: The fingertip's capsule, in F.
        p_WT: (3,) origin of T in W [m].
        R_WT: (3, 3) orientation of T in W.
        p_WF: (3,) centre of the fingertip's hemisphere in W [m].
        R_WF: (3, 3) orientation of F in W, z along the capsule outwards.

    Returns:
        The closest points.  The gap of a cylinder is exact until the axes meet; that of another handle until the
        capsule's axis enters it (an overlap of rho), and is -rho or less beyond.

    Raises:
        ModelError: the surface is no handle: its meridian is no spline of the height.

    Paper: the contact condition (12) with opposed normals (14), when the gap is zero.
    """
    return points_of(closest_table(handle, sizes_of((tip,)), p_WT, R_WT, p_WF[None], R_WF[None])[0])


def gap_gradient(points: ClosestPoints, p_WT: Array, p_WF: Array) -> tuple[Array, Array]:
    """Derivative of the gap with respect to small motions of tool and fingertip.

    `d gap = n . (dp_F + dphi_F x (tip - p_F)) - n . (dp_T + dphi_T x (c - p_T))`: the closest points' own travel
    over the surfaces drops out, as the gap is stationary in it.  For a fingertip moved by joints it is `n^T J_c`,
    J_c the linear Jacobian of the fingertip's point.  A handle whose radius grows by dr loses dr of the gap.

    Args:
        points: The closest points.
        p_WT: (3,) origin of T in W [m].
        p_WF: (3,) origin of F in W [m].

    Returns:
        (6,) row for the tool and (6,) row for the fingertip, each over (translation of the frame's origin [m],
        rotation vector in W [rad]): the first [1], the second [m/rad].
    """
    n = points.n_W
    tool, finger = np.empty(6), np.empty(6)
    tool[:3], finger[:3] = -n, n
    tool[3:] = cross(n, points.c_W - p_WT)
    finger[3:] = cross(points.tip_W - p_WF, n)
    return tool, finger
