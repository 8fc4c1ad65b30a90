"""Closest points of a fingertip capsule and a handle: gap, both contacts' parameters, points and normal.

A capsule is all points within rho of a segment, and the handle is a surface of revolution; so the question is
for the point of the segment that is nearest to the handle.  For a cylinder that is the common perpendicular of
two lines, in closed form; any other handle is searched for (`turnscrew.geometry.foot`).

The gap's derivative needs no second search: at the closest points it is stationary in all four parameters, so
only the motion of the bodies themselves counts, along the normal (`gap_gradient`).
"""

from __future__ import annotations

from math import atan2, hypot
from typing import NamedTuple, TypeAlias

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.foot import Foot, Triple, nearest_foot
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import cross
from turnscrew.geometry.surfaces import SurfaceOfRevolution

PARALLEL = 1e-12
"""Squared sine of the angle between the axes from which on they count as parallel.  At 1e-6 rad all points of a
40 mm fingertip are equally near to 0.04 um, while rounding of 1e-17 m already moves the foot by 10 um."""

Rows: TypeAlias = list[list[float]]


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

    Paper: the contact condition (12) with opposed normals (14), when the gap is zero.
    """
    T, F = R_WT.tolist(), R_WF.tolist()
    dx, dy, dz = (p_WF - p_WT).tolist()
    fx, fy, fz = F[0][2], F[1][2], F[2][2]
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = T
    a = (ax * dx + ay * dy + az * dz, bx * dx + by * dy + bz * dz, cx * dx + cy * dy + cz * dz)
    d = (ax * fx + ay * fy + az * fz, bx * fx + by * fy + bz * fz, cx * fx + cy * fy + cz * fz)
    foot = _foot_on_axis(handle, a, d, tip.length) if isinstance(handle, Cylinder) else None
    if foot is None:
        foot = nearest_foot(handle, a, d, tip.length)
    return _assemble(foot, tip, p_WT, T, p_WF, F)


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


def _foot_on_axis(handle: Cylinder, a: Triple, d: Triple, length: float) -> Foot | None:
    """Common perpendicular of the capsule's segment and the handle's axis; None where it misses the handle."""
    (ax, ay, az), (dx, dy, dz) = a, d
    square = dx * dx + dy * dy
    s = -(ax * dx + ay * dy) / square if square > PARALLEL else -0.5 * length
    clamped = s < -length
    s = 0.0 if s > 0.0 else -length if clamped else s
    x, y, z = ax + s * dx, ay + s * dy, az + s * dz
    if not handle.z0 <= z <= handle.z1:
        return None
    distance = hypot(x, y)
    if distance > 0.0:
        e_x, e_y = x / distance, y / distance
    elif square > PARALLEL:
        # Axes that meet leave two directions along their common perpendicular: either.
        e_x, e_y = -dy / square**0.5, dx / square**0.5
    else:
        e_x, e_y = 1.0, 0.0
    return Foot(s, atan2(e_y, e_x), z, distance - handle.radius, (e_x, e_y, 0.0), not clamped, 0, 0.0)


def _assemble(foot: Foot, tip: Capsule, p_WT: Array, T: Rows, p_WF: Array, F: Rows) -> ClosestPoints:
    """Points, parameters and normal in W from the foot in T, in scalars: this runs for every finger at every tick."""
    s, (ex, ey, ez) = foot.s, foot.direction
    (t00, t01, t02), (t10, t11, t12), (t20, t21, t22) = T
    (f00, f01, f02), (f10, f11, f12), (f20, f21, f22) = F
    wx = t00 * ex + t01 * ey + t02 * ez
    wy = t10 * ex + t11 * ey + t12 * ez
    wz = t20 * ex + t21 * ey + t22 * ez
    nx = -(f00 * wx + f10 * wy + f20 * wz)
    ny = -(f01 * wx + f11 * wy + f21 * wz)
    nz = -(f02 * wx + f12 * wy + f22 * wz)
    v = atan2(nz, hypot(nx, ny)) if s == 0.0 else s / tip.radius
    px, py, pz = p_WF.tolist()
    qx, qy, qz = px + s * f02, py + s * f12, pz + s * f22
    rho, distance = tip.radius, foot.distance
    points = np.array(
        [
            (qx - distance * wx, qy - distance * wy, qz - distance * wz),
            (qx - rho * wx, qy - rho * wy, qz - rho * wz),
            (wx, wy, wz),
        ]
    )
    return ClosestPoints(
        distance - rho,
        atan2(ny, nx),
        max(v, -tip.length / rho),
        foot.xi,
        foot.eta,
        points[0],
        points[1],
        points[2],
        foot.on_patch,
        foot.iterations,
        foot.residual,
    )
