"""The rows of the pose problem, their Jacobian and the Lagrangian's Hessian in closed form, compiled.

Let A be the frame of the handle and B that of a fingertip at the contact (`pose_frames`), (r, h) a meridian's point and
(a, b) its unit tangent.  Then, all in W,

    S = r A_e + h A_z,    Q = r B_e + h B_z,    n = b B_e - a B_z

are the two points and the fingertip's normal, and the six rows of the contact are

    S + p - Q - p_F,    A_e' . n,    (a A_e + b A_z) . n,    (b A_e - a A_z) . n

Weighed by l, or `weights`, they add up to

    l_p . (S - Q) + n . C,    C = c_e A_e + l_4 A_e' + c_z A_z,    c_e = l_5 a + l_6 b,    c_z = l_5 b - l_6 a

where S and C turn with the tool, Q and n do not.

Meridians come as jets (k, 2, 3, 4): of fingertip and handle of each contact, the value, first and second derivative by
the variable, of (r, h, a, b); lengths in units of 10 mm.  Data are one vector: rbar's matrix (9), the fingertips'
centres (3k) and their matrices (9k).  What is never anything but zero or one in J and H is written by none.
"""

from __future__ import annotations

import numpy as np

from turnscrew.estimate.pose_frames import (
    Triple,
    framed,
    mixed,
    quaternion_curvature,
    quaternion_slopes,
    quaternion_turn,
    seen,
    times,
)
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled


@compiled
def facing(along: Triple, t: float, a: float, b: float) -> Triple:
    """The last three rows, from a normal's components in the handle's frame; t is the length of the tangent along u."""
    return t * along[1], a * along[0] + b * along[2], b * along[0] - a * along[2]


@compiled
def pose_rows(z: Array, data: Array, jets: Array, low: Array, high: Array, g: Array) -> float:
    """Left-hand sides of (2)-(4) and of the opposed normals.

    Args:
        z: (6 + 4k,) in the chart.
        data: (9 + 12k,) or more.
        jets: (k, 2, 3, 4) at z.
        low: (6k,) bounds.
        high: (6k,) bounds.
        g: (6k,) to be filled in.

    Returns:
        Sum of the bounds' violations.
    """
    k, violation = len(jets), 0.0
    E, R, A, B = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    quaternion_turn(z[3:6], E)
    times(E, data[:9].reshape((3, 3)), R)
    p_F, R_F = data[9 : 9 + 3 * k].reshape((k, 3)), data[9 + 3 * k : 9 + 12 * k].reshape((k, 3, 3))
    for i in range(k):
        tip, ours = jets[i, 0, 0], jets[i, 1, 0]
        framed(R_F[i], z[6 + 4 * i], B)
        framed(R, z[8 + 4 * i], A)
        S, Q = mixed(A, ours[0], 0.0, ours[1]), mixed(B, tip[0], 0.0, tip[1])
        told = facing(seen(A, mixed(B, tip[3], 0.0, -tip[2])), 1.0, ours[2], ours[3])
        for j in range(3):
            g[6 * i + j], g[6 * i + 3 + j] = S[j] + z[j] - Q[j] - p_F[i, j], told[j]
    for j in range(6 * k):
        # written so that a row that is not a number is one of the sum
        outside = max(low[j] - g[j], g[j] - high[j])
        violation += 0.0 if outside <= 0.0 else outside
    return violation


@compiled
def pose_derivatives(z: Array, data: Array, jets: Array, weights: Array, J: Array, H: Array) -> None:
    """The rows' Jacobian, and the Hessian of |phi|^2 / 2 + weights . g.

    Args:
        z: (6 + 4k,) in the chart.
        data: (9 + 12k,) or more.
        jets: (k, 2, 3, 4) at z.
        weights: (6k,) of the rows.
        J: (6k, 6 + 4k) to be filled in.
        H: (6 + 4k, 6 + 4k) whose lower triangle is to be filled in.
    """
    k = len(jets)
    E, slopes, M, both = np.empty((3, 3)), np.empty((3, 3, 3)), np.zeros((3, 3)), np.empty((3, 3))
    R, A, B = np.empty((4, 3, 3)), np.empty((4, 3, 3)), np.empty((3, 3))
    w = quaternion_turn(z[3:6], E)
    quaternion_slopes(z[3:6], w, slopes)
    R_bar, R_F = data[:9].reshape((3, 3)), data[9 + 3 * k : 9 + 12 * k].reshape((k, 3, 3))
    times(E, R_bar, R[0])
    for m in range(3):
        times(slopes[m], R_bar, R[1 + m])
    for i in range(k):
        framed(R_F[i], z[6 + 4 * i], B)
        for m in range(4):
            framed(R[m], z[8 + 4 * i], A[m])
        tip, ours, row, at = jets[i, 0], jets[i, 1], 6 * i, 6 + 4 * i
        contact_slopes(A, B, tip, ours, J[row : row + 6], at)
        contact_curvature(A, B, tip, ours, weights[row : row + 6], H[at : at + 4], at, M)
    times(M, E, both)
    for i in range(3):
        H[i, i] = 0.0
        for j in range(3):
            H[3 + i, 3 + j] = 1.0 if i == j else 0.0
    quaternion_curvature(z[3:6], w, both, H[3:6, 3:6])


@compiled
def column(J: Array, j: int, point: Triple, told: Triple) -> None:
    """Fills in a contact's six entries of one variable."""
    for i in range(3):
        J[i, j], J[3 + i, j] = point[i], told[i]


@compiled
def contact_slopes(A: Array, B: Array, tip: Array, ours: Array, J: Array, at: int) -> None:
    """Derivatives of a contact's rows by position, phi and its own variables.

    Args:
        A: (4, 3, 3) the handle's frame and its derivatives by phi.
        B: (3, 3) the fingertip's.
        tip: (3, 4) jet of the fingertip.
        ours: (3, 4) of the handle.
        J: (6, 6 + 4k) to be filled in.
        at: Where the contact's variables begin.
    """
    r, h, a, b = ours[0, 0], ours[0, 1], ours[0, 2], ours[0, 3]
    n = mixed(B, tip[0, 3], 0.0, -tip[0, 2])
    n_u, n_v = mixed(B, 0.0, tip[0, 3], 0.0), mixed(B, tip[1, 3], 0.0, -tip[1, 2])
    for j in range(3):
        J[j, j] = 1.0
        column(J, 3 + j, mixed(A[1 + j], r, 0.0, h), facing(seen(A[1 + j], n), 1.0, a, b))
    along = seen(A[0], n)
    column(J, at, mixed(B, 0.0, -tip[0, 0], 0.0), facing(seen(A[0], n_u), 1.0, a, b))
    column(J, at + 1, mixed(B, -tip[1, 0], 0.0, -tip[1, 1]), facing(seen(A[0], n_v), 1.0, a, b))
    column(J, at + 2, mixed(A[0], 0.0, r, 0.0), facing((along[1], -along[0], 0.0), 1.0, a, b))
    column(J, at + 3, mixed(A[0], ours[1, 0], 0.0, ours[1, 1]), facing(along, 0.0, ours[1, 2], ours[1, 3]))


@compiled
def by_tip(tip: Array, c: Triple) -> tuple[float, float]:
    """Of n . c the derivatives by the fingertip's u and v, c in the fingertip's frame."""
    return tip[0, 3] * c[1], tip[1, 3] * c[0] - tip[1, 2] * c[2]


@compiled
def weighed(jet: Array, weights: Array) -> tuple[float, float]:
    """c_e and c_z of the handle's (r, h, a, b), or their derivatives of its derivatives."""
    return weights[4] * jet[2] + weights[5] * jet[3], weights[4] * jet[3] - weights[5] * jet[2]


@compiled
def contact_curvature(A: Array, B: Array, tip: Array, ours: Array, weights: Array, H: Array, at: int, M: Array) -> None:
    """Second derivatives of a contact's weighed rows by its own variables, and by these and phi.

    Args:
        A: (4, 3, 3) the handle's frame and its derivatives by phi.
        B: (3, 3) the fingertip's.
        tip: (3, 4) jet of the fingertip.
        ours: (3, 4) of the handle.
        weights: (6,) of the rows.
        H: (4, 6 + 4k) the contact's rows, to be filled in up to the diagonal.
        at: Where the contact's variables begin.
        M: (3, 3) raised by l_p S' + n C', which phi turns as a whole.
    """
    force, n = (weights[0], weights[1], weights[2]), mixed(B, tip[0, 3], 0.0, -tip[0, 2])
    e, z = weighed(ours[0], weights)
    e1, z1 = weighed(ours[1], weights)
    e2, z2 = weighed(ours[2], weights)
    S, C = mixed(A[0], ours[0, 0], 0.0, ours[0, 1]), mixed(A[0], e, weights[3], z)
    f, c = seen(B, force), seen(B, C)
    H[0, at], H[1, at] = tip[0, 0] * f[0] - tip[0, 3] * c[0], tip[1, 3] * c[1] - tip[1, 0] * f[1]
    H[1, at + 1] = tip[2, 3] * c[0] - tip[2, 2] * c[2] - tip[2, 0] * f[0] - tip[2, 1] * f[2]
    H[2, at], H[2, at + 1] = by_tip(tip, seen(B, mixed(A[0], -weights[3], e, 0.0)))
    H[3, at], H[3, at + 1] = by_tip(tip, seen(B, mixed(A[0], e1, 0.0, z1)))
    f, c = seen(A[0], force), seen(A[0], n)
    H[2, at + 2], H[3, at + 2] = -ours[0, 0] * f[0] - e * c[0] - weights[3] * c[1], ours[1, 0] * f[1] + e1 * c[1]
    H[3, at + 3] = ours[2, 0] * f[0] + ours[2, 1] * f[2] + e2 * c[0] + z2 * c[2]
    for j in range(3):
        f, c = seen(A[1 + j], force), seen(A[1 + j], n)
        H[0, 3 + j], H[1, 3 + j] = by_tip(tip, seen(B, mixed(A[1 + j], e, weights[3], z)))
        H[2, 3 + j] = ours[0, 0] * f[1] + e * c[1] - weights[3] * c[0]
        H[3, 3 + j] = ours[1, 0] * f[0] + ours[1, 1] * f[2] + e1 * c[0] + z1 * c[2]
        for i in range(3):
            M[i, j] += force[i] * S[j] + n[i] * C[j]
