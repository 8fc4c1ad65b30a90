"""Frames of turned surfaces and of the pose chart, compiled: what the pose problem's rows are written in.

A surface of revolution is its meridian turned about its axis z by an angle u: with e = (cos u, sin u, 0) and
e' = de/du, points, tangents and normals have fixed components in the frame (e, e', z), those of the meridian.  The
derivative by u turns e into e' and e' into -e.  Frames are (3, 3) with e, e' and z for rows, in W.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled

Triple = tuple[float, float, float]
"""A vector, or its components in a frame."""


@compiled
def framed(R: Array, u: float, frame: Array) -> None:
    """Fills in the frame (3, 3) at the angle u [rad] of a surface with orientation R (3, 3)."""
    c, s = np.cos(u), np.sin(u)
    for i in range(3):
        frame[0, i], frame[1, i], frame[2, i] = c * R[i, 0] + s * R[i, 1], c * R[i, 1] - s * R[i, 0], R[i, 2]


@compiled
def seen(frame: Array, v: Triple) -> Triple:
    """Components of a vector along e, e' and z."""
    x, y, z = v
    return (
        frame[0, 0] * x + frame[0, 1] * y + frame[0, 2] * z,
        frame[1, 0] * x + frame[1, 1] * y + frame[1, 2] * z,
        frame[2, 0] * x + frame[2, 1] * y + frame[2, 2] * z,
    )


@compiled
def mixed(frame: Array, e: float, t: float, z: float) -> Triple:
    """The vector with these components along e, e' and z."""
    return (
        e * frame[0, 0] + t * frame[1, 0] + z * frame[2, 0],
        e * frame[0, 1] + t * frame[1, 1] + z * frame[2, 1],
        e * frame[0, 2] + t * frame[1, 2] + z * frame[2, 2],
    )


@compiled
def quaternion_turn(phi: Array, E: Array) -> float:
    """The rotation by the quaternion (w, s) with s = phi / 2.

        E = (1 - 2 s.s) I + 2 s s' + 2 w [s]x,    w = sqrt(1 - s.s)

    Args:
        phi: (3,).
        E: (3, 3) to be filled in.

    Returns:
        w.
    """
    s = (0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2])
    w: float = np.sqrt(1.0 - s[0] * s[0] - s[1] * s[1] - s[2] * s[2])
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        E[i, i] = 1.0 - 2.0 * (s[j] * s[j] + s[k] * s[k])
        E[i, j], E[j, i] = 2.0 * (s[i] * s[j] - w * s[k]), 2.0 * (s[i] * s[j] + w * s[k])
    return w


@compiled
def quaternion_slopes(phi: Array, w: float, slopes: Array) -> None:
    """Derivatives of that rotation by phi, with dw / ds = -s / w.

    Args:
        phi: (3,).
        w: Of the quaternion.
        slopes: (3, 3, 3) to be filled in, by phi_m first.
    """
    s = (0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2])
    for m in range(3):
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            slopes[m, i, i] = 0.0 if m == i else -2.0 * s[m]
            even = (s[j] if m == i else 0.0) + (s[i] if m == j else 0.0)
            odd = (w if m == k else 0.0) - s[m] * s[k] / w
            slopes[m, i, j], slopes[m, j, i] = even - odd, even + odd


@compiled
def quaternion_curvature(phi: Array, w: float, M: Array, H: Array) -> None:
    """Second derivatives by phi of the sum of products E_ij M_ij.

    With s = phi / 2 and `[s]x . M = s . m` that sum is (1 - 2 s.s) tr M + 2 s' M s + 2 w s . m.

    Args:
        phi: (3,).
        w: Of the quaternion.
        M: (3, 3).
        H: (3, 3) whose lower triangle is raised by them.
    """
    s = (0.5 * phi[0], 0.5 * phi[1], 0.5 * phi[2])
    m = (M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1])
    trace, along = M[0, 0] + M[1, 1] + M[2, 2], s[0] * m[0] + s[1] * m[1] + s[2] * m[2]
    for i in range(3):
        H[i, i] -= trace + 0.5 * along / w
        for j in range(i + 1):
            bent = s[i] * m[j] + s[j] * m[i] + s[i] * s[j] / (w * w) * along
            H[i, j] += 0.5 * (M[i, j] + M[j, i] - bent / w)


@compiled
def times(A: Array, B: Array, out: Array) -> None:
    """Fills in the product of two (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
