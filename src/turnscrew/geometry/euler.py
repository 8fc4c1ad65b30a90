"""The paper's z-y-x Euler angles of an upright tool: gamma = (roll, pitch, yaw), R = Rz(yaw) Ry(pitch) Rx(roll).

The chart is singular at a pitch of 90 deg, where rates of roll and yaw cannot be told apart: no place for
a screwdriver on a horizontal plate, which stands within a few degrees of upright.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin

import numpy as np

from turnscrew.geometry.arrays import Array


def matrix_from_euler(gamma: Array) -> Array:
    """Rotation `R_WT = Rz(yaw) Ry(pitch) Rx(roll)`.

    Args:
        gamma: (3,) angles (roll about x, pitch about y, yaw about z) [rad].

    Returns:
        (3, 3) rotation matrix.

    Paper: IV-A, gamma.
    """
    roll, pitch, yaw_ = gamma.tolist()
    cr, sr, cp, sp, cy, sy = cos(roll), sin(roll), cos(pitch), sin(pitch), cos(yaw_), sin(yaw_)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def euler_from_matrix(R: Array) -> Array:
    """Angles (roll, pitch, yaw) of a rotation, pitch within +-90 deg; the inverse of `matrix_from_euler`.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (3,) gamma [rad].
    """
    (a, _, _), (d, _, _), (g, h, i) = R.tolist()
    return np.array([atan2(h, i), atan2(-g, hypot(a, d)), atan2(d, a)])


def euler_rate_matrix(gamma: Array) -> Array:
    """T(gamma) with `omega_W = T gammadot`: the tool's angular velocity in W from the rates of its Euler angles.

    Args:
        gamma: (3,) angles (roll, pitch, yaw) [rad].

    Returns:
        (3, 3); its columns are the axes of roll, pitch and yaw in W.  Its determinant is cos(pitch).

    Paper: IV-A, T.
    """
    _, pitch, yaw_ = gamma.tolist()
    cp, sp, cy, sy = cos(pitch), sin(pitch), cos(yaw_), sin(yaw_)
    return np.array([[cy * cp, -sy, 0.0], [sy * cp, cy, 0.0], [-sp, 0.0, 1.0]])


def euler_rate_matrix_derivative(gamma: Array, gammadot: Array) -> Array:
    """Time derivative of T(gamma).

    Args:
        gamma: (3,) angles (roll, pitch, yaw) [rad].
        gammadot: (3,) their rates [rad/s].

    Returns:
        (3, 3) dT/dt [1/s].
    """
    _, pitch, yaw_ = gamma.tolist()
    _, dp, dy = gammadot.tolist()
    cp, sp, cy, sy = cos(pitch), sin(pitch), cos(yaw_), sin(yaw_)
    return np.array(
        [
            [-dy * sy * cp - dp * cy * sp, -dy * cy, 0.0],
            [dy * cy * cp - dp * sy * sp, -dy * sy, 0.0],
            [-dp * cp, 0.0, 0.0],
        ]
    )


def body_rate_matrix(gamma: Array) -> Array:
    """`R^T T`, so `omega_T = R^T T gammadot`: the tool's angular velocity in its own frame.

    Args:
        gamma: (3,) angles (roll, pitch, yaw) [rad]; yaw drops out.

    Returns:
        (3, 3).

    Paper: the lower block of Lambda in IV-A.
    """
    roll, pitch, _ = gamma.tolist()
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return np.array([[1.0, 0.0, -sp], [0.0, cr, sr * cp], [0.0, -sr, cr * cp]])


def body_rate_matrix_derivative(gamma: Array, gammadot: Array) -> Array:
    """Time derivative of `R^T T`, for the tool's acceleration: `omegadot_T = R^T T gammaddot + d/dt(R^T T) gammadot`.

    Args:
        gamma: (3,) angles (roll, pitch, yaw) [rad].
        gammadot: (3,) their rates [rad/s].

    Returns:
        (3, 3) [1/s].

    Paper: the exact form of the last term of (9) and (10), where `Lambda-dot xdot` also differentiates the
        linear part, which U has already removed.
    """
    roll, pitch, _ = gamma.tolist()
    dr, dp, _ = gammadot.tolist()
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return np.array(
        [
            [0.0, 0.0, -dp * cp],
            [0.0, -dr * sr, dr * cr * cp - dp * sr * sp],
            [0.0, -dr * cr, -dr * sr * cp - dp * cr * sp],
        ]
    )


def tilt(R: Array) -> float:
    """Angle between the z axis of a frame and that of W, in [0, pi] [rad], accurate near 0 and pi alike.

    Args:
        R: (3, 3) orientation of the frame in W.
    """
    (_, _, c), (_, _, f), (_, _, i) = R.tolist()
    return atan2(hypot(c, f), i)


def yaw(R: Array) -> float:
    """Third Euler angle of R, in (-pi, pi] [rad]; fastening makes it fall.

    Args:
        R: (3, 3) orientation of the frame in W.
    """
    (a, _, _), (d, _, _), _ = R.tolist()
    return atan2(d, a)
