"""The paper's z-y-x Euler angles of an upright tool: gamma = (roll, pitch, yaw), R = Rz(yaw) Ry(pitch) Rx(roll).

The chart is singular at a pitch of 90 deg, where rates of roll and yaw cannot be told apart: no place for
a screwdriver on a horizontal plate, which stands within a few degrees of upright.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled


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


@compiled
def euler_from_matrix(R: Array) -> Array:
    """Angles (roll, pitch, yaw) of a rotation, pitch within +-90 deg; the inverse of `matrix_from_euler`.

    Args:
        R: (3, 3) rotation matrix.

    Returns:
        (3,) gamma [rad].
    """
    return np.array([atan2(R[2, 1], R[2, 2]), atan2(-R[2, 0], hypot(R[0, 0], R[1, 0])), atan2(R[1, 0], R[0, 0])])


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


@compiled
def body_rate_matrix(gamma: Array) -> Array:
    """`R^T T`, so `omega_T = R^T T gammadot`: the tool's angular velocity in its own frame.

    Args:
        gamma: (3,) angles (roll, pitch, yaw) [rad]; yaw drops out.

    Returns:
        (3, 3).

    Paper: the lower block of Lambda in IV-A.
    """
    roll, pitch = gamma[0], gamma[1]
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return np.array([[1.0, 0.0, -sp], [0.0, cr, sr * cp], [0.0, -sr, cr * cp]])


@compiled
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
    roll, pitch = gamma[0], gamma[1]
    dr, dp = gammadot[0], gammadot[1]
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return np.array(
        [
            [0.0, 0.0, -dp * cp],
            [0.0, -dr * sr, dr * cr * cp - dp * sr * sp],
            [0.0, -dr * cr, -dr * sr * cp - dp * cr * sp],
        ]
    )


@compiled
def euler_rates(gamma: Array, omega_T: Array) -> Array:
    """Rates of the Euler angles from the tool's angular velocity: `gammadot = (R^T T)^-1 omega_T`.

    Args:
        gamma: (3,) angles (roll, pitch, yaw) [rad], pitch off 90 deg.
        omega_T: (3,) angular velocity of the tool in W, expressed in T [rad/s].

    Returns:
        (3,) gammadot [rad/s].
    """
    cr, sr = cos(gamma[0]), sin(gamma[0])
    yaw_rate = (sr * omega_T[1] + cr * omega_T[2]) / cos(gamma[1])
    return np.array([omega_T[0] + sin(gamma[1]) * yaw_rate, cr * omega_T[1] - sr * omega_T[2], yaw_rate])


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
