"""Rotation matrices, rotation vectors and quaternions (w, x, y, z), without the overhead of general routines.

These run some thousand times a second on single vectors, where NumPy's general routines cost more in
dispatch than in arithmetic: so the longer ones are compiled; in the others, which a call into compiled code would not
make faster, scalars are taken out once, and one array is made at the end.
"""

from __future__ import annotations

from math import atan2, sin, sqrt

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled


def skew(a: Array) -> Array:
    """Matrix of the cross product: `skew(a) @ b = a x b`.

    Args:
        a: (3,) vector.

    Returns:
        (3, 3) antisymmetric matrix.

    Paper: the operator `[.]x` of III-B.
    """
    x, y, z = a.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: Array, b: Array) -> Array:
    """Cross product of two 3-vectors, (3,), ten times faster than the general routine."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


@compiled
def _rodrigues(square: float) -> tuple[float, float]:
    """The two factors of Rodrigues' formula for the squared angle."""
    # Below 1e-8 rad^2 the series' next terms change the matrix by less than its rounding.
    if square < 1e-8:
        return 1.0 - square / 6.0, 0.5
    angle = sqrt(square)
    half = sin(0.5 * angle)
    return sin(angle) / angle, 2.0 * half * half / square


@compiled
def _quaternion_of(R: Array) -> tuple[float, float, float, float]:
    """Unit quaternion with w >= 0, from the largest of its four components (Shepperd), so none is lost."""
    a, b, c = R[0, 0], R[0, 1], R[0, 2]
    d, e, f = R[1, 0], R[1, 1], R[1, 2]
    g, h, i = R[2, 0], R[2, 1], R[2, 2]
    largest = max(a + e + i, a, e, i)
    if largest == a + e + i:
        w, x, y, z = 1.0 + a + e + i, h - f, c - g, d - b
    elif largest == a:
        w, x, y, z = h - f, 1.0 + a - e - i, b + d, c + g
    elif largest == e:
        w, x, y, z = c - g, b + d, 1.0 - a + e - i, f + h
    else:
        w, x, y, z = d - b, c + g, f + h, 1.0 - a - e + i
    s = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        s = -s
    return s * w, s * x, s * y, s * z


@compiled
def exp_so3(phi: Array) -> Array:
    """Rotation by the angle t = |phi| about phi: `R = I + sin t / t [phi]x + (1 - cos t) / t^2 [phi]x [phi]x`.

    Args:
        phi: (3,) rotation vector [rad].

    Returns:
        (3, 3) rotation matrix, orthogonal to rounding.
    """
    x, y, z = phi[0], phi[1], phi[2]
    a, b = _rodrigues(x * x + y * y + z * z)
    xx, yy, zz = b * x * x, b * y * y, b * z * z
    xy, xz, yz = b * x * y, b * x * z, b * y * z
    x, y, z = a * x, a * y, a * z
    R = np.empty((3, 3))
    R[0, 0], R[0, 1], R[0, 2] = 1.0 - yy - zz, xy - z, xz + y
    R[1, 0], R[1, 1], R[1, 2] = xy + z, 1.0 - xx - zz, yz - x
    R[2, 0], R[2, 1], R[2, 2] = xz - y, yz + x, 1.0 - xx - yy
    return R


@compiled
def log_so3(R: Array) -> Array:
    """Rotation vector of R, of length at most pi: the inverse of `exp_so3`, exact near 0 and near pi.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (3,) rotation vector [rad]; of the two that a half turn has, either.
    """
    w, x, y, z = _quaternion_of(R)
    s = sqrt(x * x + y * y + z * z)
    # Below 1e-8 the next term of 2 atan2(s, w) / s = 2 (1 - s^2 / 3 ...) is under rounding.
    factor = 2.0 * atan2(s, w) / s if s > 1e-8 else 2.0
    phi = np.empty(3)
    phi[0], phi[1], phi[2] = factor * x, factor * y, factor * z
    return phi


def matrix_from_quaternion(q: Array) -> Array:
    """Rotation matrix of a quaternion of any length but zero.

    Args:
        q: (4,) quaternion (w, x, y, z); only its direction matters.

    Returns:
        (3, 3) rotation matrix.
    """
    w, x, y, z = q.tolist()
    s = 2.0 / (w * w + x * x + y * y + z * z)
    xx, yy, zz = s * x * x, s * y * y, s * z * z
    xy, xz, yz = s * x * y, s * x * z, s * y * z
    wx, wy, wz = s * w * x, s * w * y, s * w * z
    return np.array(
        [
            [1.0 - yy - zz, xy - wz, xz + wy],
            [xy + wz, 1.0 - xx - zz, yz - wx],
            [xz - wy, yz + wx, 1.0 - xx - yy],
        ]
    )


def quaternion_from_matrix(R: Array) -> Array:
    """Unit quaternion (w, x, y, z) of a rotation matrix, with w >= 0.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (4,) unit quaternion.
    """
    return np.array(_quaternion_of(R))


def quaternion_product(p: Array, q: Array) -> Array:
    """Quaternion p q: the rotation q followed by p, so `R(pq) = R(p) R(q)`.

    Args:
        p: (4,) quaternion (w, x, y, z).
        q: (4,) quaternion (w, x, y, z).

    Returns:
        (4,) product.
    """
    a, b, c, d = p.tolist()
    w, x, y, z = q.tolist()
    return np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def quaternion_conjugate(q: Array) -> Array:
    """Quaternion of the inverse rotation, (4,), for a unit quaternion (w, x, y, z)."""
    w, x, y, z = q.tolist()
    return np.array([w, -x, -y, -z])
