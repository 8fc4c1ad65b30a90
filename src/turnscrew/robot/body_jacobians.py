"""Jacobians of points on the robot's bodies, and how they change, from MuJoCo's spatial axes of the joints.

One call for all fingertips and the palm, where the simulator's own routines take one for each body and quantity.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array, Flags, Rows
from turnscrew.geometry.compiled import compiled


@compiled
def tip_frames(xpos: Array, xmat: Array, bodies: Rows, offset: Array) -> tuple[Array, Array]:
    """Points that the robot's motion is told by: some way along the z axes of bodies, and the last one's origin.

    Args:
        xpos: (b, 3) origins of all bodies in W [m].
        xmat: (b, 9) their orientations.
        bodies: (k + 1,) which bodies count.
        offset: (k,) ways along z, of all but the last [m].

    Returns:
        (k + 1, 3) the points in W [m], and (k, 3, 3) the orientations of all bodies but the last.
    """
    k = len(offset)
    p_W, R = np.empty((k + 1, 3)), np.empty((k, 3, 3))
    for i in range(k):
        R[i] = xmat[bodies[i]].reshape(3, 3)
        p_W[i] = xpos[bodies[i]] + offset[i] * R[i, :, 2]
    p_W[k] = xpos[bodies[k]]
    return p_W, R


@compiled
def point_jacobians(p_W: Array, moves: Flags, axes: Array, com: Array) -> Array:
    """How joints move points and turn the bodies they belong to.

    Args:
        p_W: (k, 3) points in W [m].
        moves: (k, n) which joints move the body of each point.
        axes: (n, 6) angular, then linear velocity at `com` in W for a unit speed of each joint (`cdof`).
        com: (3,) where the linear parts of `axes` are taken, in W [m].

    Returns:
        (k, 6, n) linear velocity of the points, then angular velocity of the bodies, in W.
    """
    k, n = moves.shape
    J = np.zeros((k, 6, n))
    for i in range(k):
        x, y, z = p_W[i, 0] - com[0], p_W[i, 1] - com[1], p_W[i, 2] - com[2]
        for j in range(n):
            if moves[i, j]:
                a, b, c = axes[j, 0], axes[j, 1], axes[j, 2]
                J[i, 0, j] = axes[j, 3] + b * z - c * y
                J[i, 1, j] = axes[j, 4] + c * x - a * z
                J[i, 2, j] = axes[j, 5] + a * y - b * x
                J[i, 3, j], J[i, 4, j], J[i, 5, j] = a, b, c
    return J


@compiled
def bias_accelerations(p_W: Array, J: Array, moves: Flags, axes_rate: Array, com: Array, v: Array) -> Array:
    """`Jdot v`: what points accelerate by while no joint does.

    Args:
        p_W: (k, 3) points in W [m].
        J: (k, 6, n) their Jacobians.
        moves: (k, n) which joints move the body of each point.
        axes_rate: (n, 6) time derivative of the joints' axes (`cdof_dot`).
        com: (3,) where these are taken, in W [m].
        v: (n,) joint speeds [rad/s].

    Returns:
        (k, 6) in W, linear first [m/s2, rad/s2].
    """
    k, n = moves.shape
    rates = np.zeros((k, 6))
    for i in range(k):
        V, spatial = np.zeros(6), np.zeros(6)
        for j in range(n):
            if moves[i, j]:
                for row in range(6):
                    V[row] += J[i, row, j] * v[j]
                    spatial[row] += axes_rate[j, row] * v[j]
        x, y, z = p_W[i, 0] - com[0], p_W[i, 1] - com[1], p_W[i, 2] - com[2]
        a, b, c = spatial[0], spatial[1], spatial[2]
        # the body's acceleration carried to the point, and omega x v of the point itself
        rates[i, 0] = spatial[3] + b * z - c * y + V[4] * V[2] - V[5] * V[1]
        rates[i, 1] = spatial[4] + c * x - a * z + V[5] * V[0] - V[3] * V[2]
        rates[i, 2] = spatial[5] + a * y - b * x + V[3] * V[1] - V[4] * V[0]
        rates[i, 3], rates[i, 4], rates[i, 5] = a, b, c
    return rates


@compiled
def contact_rows(J: Array, p_WF: Array, c_W: Array, drive: Rows, drives: int) -> Array:
    """Velocities of the fingertips' material points at the contacts, by the driven joints.

    Args:
        J: (k, 6, n) Jacobians of the fingertips' frames.
        p_WF: (k, 3) their origins in W [m].
        c_W: (k, 3) contacts in W [m].
        drive: (n,) which drive moves each joint.
        drives: How many there are.

    Returns:
        (k, 3, drives) in W.
    """
    k, n = J.shape[0], J.shape[2]
    at = np.zeros((k, 3, drives))
    for i in range(k):
        x, y, z = c_W[i, 0] - p_WF[i, 0], c_W[i, 1] - p_WF[i, 1], c_W[i, 2] - p_WF[i, 2]
        for j in range(n):
            a, b, c, d = J[i, 3, j], J[i, 4, j], J[i, 5, j], drive[j]
            at[i, 0, d] += J[i, 0, j] + b * z - c * y
            at[i, 1, d] += J[i, 1, j] + c * x - a * z
            at[i, 2, d] += J[i, 2, j] + a * y - b * x
    return at


@compiled
def driven_mass(M: Array, drive: Rows, drives: int) -> Array:
    """`S^T M S` (drives, drives): mass matrix M (n, n) of all joints, as the drives feel it [kg.m2]."""
    n = len(M)
    felt = np.zeros((drives, drives))
    for i in range(n):
        for j in range(n):
            felt[drive[i], drive[j]] += M[i, j]
    return felt


@compiled
def motion_table(
    xpos: Array, xmat: Array, bodies: Rows, offset: Array, moves: Flags, axes: Array, axes_rate: Array, com: Array,
    v: Array, M: Array, bias: Array, drive: Rows, drives: int,
) -> tuple[Array, Array, Array, Array, Array, Array]:  # fmt: skip
    """All that (17) and (18) need of the robot, from what MuJoCo has worked out for all joints; arguments as above.

    Args:
        xpos: As for `tip_frames`, and so are `xmat`, `bodies` and `offset`.
        xmat: Orientations.
        bodies: Which count.
        offset: Ways along z [m].
        moves: (k + 1, n) which joints move each body.
        axes: (n, 6) the joints' axes.
        axes_rate: (n, 6) their rates.
        com: (3,) where these are taken, in W [m].
        v: (n,) joint speeds [rad/s].
        M: (n, n) mass matrix of all joints [kg.m2].
        bias: (n,) Coriolis, centrifugal and gravity torques of all joints [N.m].
        drive: (n,) which drive moves each joint.
        drives: How many there are.

    Returns:
        `tip_frames`, `point_jacobians`, `bias_accelerations`, `driven_mass`, and `S^T bias` (drives,).
    """
    p_W, R = tip_frames(xpos, xmat, bodies, offset)
    J = point_jacobians(p_W, moves, axes, com)
    felt = np.zeros(drives)
    for i in range(len(bias)):
        felt[drive[i]] += bias[i]
    return p_W, R, J, bias_accelerations(p_W, J, moves, axes_rate, com, v), driven_mass(M, drive, drives), felt
