"""The least squares of rolling odometry, compiled: which turn of the tool goes best with what the contacts moved by."""

from __future__ import annotations

import numpy as np

from turnscrew.estimate.filter_state import OFFSET_COLUMNS
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.foot import Triple
from turnscrew.geometry.small import solve_positive


@compiled
def _carried(
    p_then: Array, R_then: Array, p_now: Array, R_now: Array, c_W: Array, p_WT: Array
) -> tuple[Array, Array, Array, Array]:
    """How far each fingertip has moved its contact, and where that was and is.

    Returns:
        All (k, 3) in W [m]: moved by; from the tip then; from the fingertip's origin then, and now.
    """
    moved, lever, then, now = np.empty(c_W.shape), np.empty(c_W.shape), np.empty(c_W.shape), np.zeros(c_W.shape)
    for i in range(len(c_W)):
        for j in range(3):
            lever[i, j], then[i, j] = c_W[i, j] - p_WT[j], c_W[i, j] - p_then[i, j]
        for k in range(3):
            local = 0.0
            for j in range(3):
                local += R_then[i, j, k] * then[i, j]
            for j in range(3):
                now[i, j] += R_now[i, j, k] * local
        for j in range(3):
            moved[i, j] = p_now[i, j] + now[i, j] - c_W[i, j]
    return moved, lever, then, now


@compiled
def _shares(weight: Array, slip_speed: float) -> tuple[Array, int]:
    """What each contact counts (k,), and how many do."""
    w, total, held = weight.copy(), 0.0, 0
    for i in range(len(w)):
        total += w[i]
        held += w[i] != 0.0
    for i in range(len(w)):
        # The mean weight is one, so that the prior does not fade when the grip is strong.
        w[i] *= held / total / slip_speed**2
    return w, held


@compiled
def _normal_matrix(lever: Array, w: Array, tilt_rate: float, yaw_rate: float, R_WT: Array) -> Array:
    """Matrix (3, 3) of the least squares: `sum w_i (|l_i|^2 1 - l_i l_i^T)` and the prior on the rates."""
    A = np.zeros((3, 3))
    for i in range(len(w)):
        square = lever[i, 0] * lever[i, 0] + lever[i, 1] * lever[i, 1] + lever[i, 2] * lever[i, 2]
        for j in range(3):
            A[j, j] += w[i] * square
            for k in range(3):
                A[j, k] -= w[i] * lever[i, j] * lever[i, k]
    tilt, yaw = tilt_rate**-2, yaw_rate**-2
    for j in range(3):
        A[j, j] += tilt
        for k in range(3):
            A[j, k] += (yaw - tilt) * R_WT[j, 2] * R_WT[k, 2]
    return A


@compiled
def _turned(inverse: Array, lever: Array, way: Array) -> Triple:
    """`inverse (lever x way)`: what a way of one contact turns the tool by."""
    x = lever[1] * way[2] - lever[2] * way[1]
    y = lever[2] * way[0] - lever[0] * way[2]
    z = lever[0] * way[1] - lever[1] * way[0]
    return (
        inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2] * z,
        inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2] * z,
        inverse[2, 0] * x + inverse[2, 1] * y + inverse[2, 2] * z,
    )


@compiled
def _missed(moved: Array, lever: Array, dtheta: Array) -> float:
    """Squared way by which one contact moved otherwise than with the tool [m^2]."""
    x: float = moved[0] - (dtheta[1] * lever[2] - dtheta[2] * lever[1])
    y: float = moved[1] - (dtheta[2] * lever[0] - dtheta[0] * lever[2])
    z: float = moved[2] - (dtheta[0] * lever[1] - dtheta[1] * lever[0])
    return x * x + y * y + z * z


@compiled
def _least_squares(
    moved: Array, lever: Array, w: Array, tilt_rate: float, yaw_rate: float, R_WT: Array
) -> tuple[Array, Array]:
    """The rotation (3,) [rad], and the inverse (3, 3) of the least squares' matrix."""
    inverse = solve_positive(_normal_matrix(lever, w, tilt_rate, yaw_rate, R_WT), np.eye(3))
    dtheta = np.zeros(3)
    for i in range(len(w)):
        x, y, z = _turned(inverse, lever[i], moved[i])
        dtheta[0] += w[i] * x
        dtheta[1] += w[i] * y
        dtheta[2] += w[i] * z
    return dtheta, inverse


@compiled
def _stray(moved: Array, lever: Array, dtheta: Array, weight: Array, stray: float) -> int:
    """Which contact strays farthest from the tool, and by more than `stray`; -1 if none does."""
    worst, farthest = -1, stray * stray
    for i in range(len(weight)):
        if weight[i] != 0.0:
            square = _missed(moved[i], lever[i], dtheta)
            if square > farthest:
                worst, farthest = i, square
    return worst


@compiled
def _by_shift(lever: Array, w: float, inverse: Array, sums: Array) -> None:
    """Adds to sums (3, 3) what a shift of one fingertip along each axis turns the tool by."""
    shift = np.zeros(3)
    for j in range(3):
        shift[j] = w
        x, y, z = _turned(inverse, lever, shift)
        sums[0, j] += x
        sums[1, j] += y
        sums[2, j] += z
        shift[j] = 0.0


@compiled
def _point_way(J: Array, column: int, arm: Array, way: Array) -> None:
    """Fills in by how much (3,) a joint moves a point at `arm` from the origin that J (6, 28) is of."""
    way[0] = J[0, column] + J[4, column] * arm[2] - J[5, column] * arm[1]
    way[1] = J[1, column] + J[5, column] * arm[0] - J[3, column] * arm[2]
    way[2] = J[2, column] + J[3, column] * arm[1] - J[4, column] * arm[0]


@compiled
def _by_offsets(
    J_then: Array, J_now: Array, then: Array, now: Array, lever: Array, w: float,
    dtheta: Array, inverse: Array, sums: Array,
) -> None:  # fmt: skip
    """Adds to sums (3, 17) what one finger's offsets do to the rotation, its contact `then` and `now` away from F."""
    before, way = np.empty(3), np.empty(3)
    for k in range(len(OFFSET_COLUMNS)):
        _point_way(J_then, OFFSET_COLUMNS[k], then, before)
        _point_way(J_now, OFFSET_COLUMNS[k], now, way)
        way[0] -= before[0] + dtheta[1] * before[2] - dtheta[2] * before[1]
        way[1] -= before[1] + dtheta[2] * before[0] - dtheta[0] * before[2]
        way[2] -= before[2] + dtheta[0] * before[1] - dtheta[1] * before[0]
        x, y, z = _turned(inverse, lever, way)
        sums[0, k] += w * x
        sums[1, k] += w * y
        sums[2, k] += w * z


@compiled
def least_turn(
    p_then: Array, R_then: Array, J_then: Array, p_now: Array, R_now: Array, J_now: Array, c_W: Array, weight: Array,
    p_WT: Array, R_WT: Array, slip_speed: float, tilt_rate: float, yaw_rate: float, stray: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """`RollingOdometry.increment`: dtheta (3,), per_shift (3, 3) and per_offset (3, 17) of `Rolled`.

    Args:
        p_then: (5, 3) origins of the fingertips at the last tick, in W [m], `p_now` those now,
        R_then: (5, 3, 3) their orientations,
        J_then: (5, 6, 28) and their Jacobians.
        p_now: As `p_then`.
        R_now: As `R_then`.
        J_now: As `J_then`.
        c_W: (5, 3) contact points at the last tick, in W [m].
        weight: (5,) contact forces [N], 0 for fingers that do not touch.
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        slip_speed: As of `RollingOdometry`, and so are the others.
        tilt_rate: [rad/s].
        yaw_rate: [rad/s].
        stray: [m].
    """
    per_shift, per_offset, weight = np.zeros((3, 3)), np.zeros((3, len(OFFSET_COLUMNS))), weight.copy()
    moved, lever, then, now = _carried(p_then, R_then, p_now, R_now, c_W, p_WT)
    while True:
        w, held = _shares(weight, slip_speed)
        if held == 0:
            return np.zeros(3), per_shift, per_offset
        dtheta, inverse = _least_squares(moved, lever, w, tilt_rate, yaw_rate, R_WT)
        worst = _stray(moved, lever, dtheta, weight, stray) if held > 2 else -1
        if worst < 0:
            break
        weight[worst] = 0.0
    for i in range(len(w)):
        if w[i] != 0.0:
            _by_shift(lever[i], w[i], inverse, per_shift)
            _by_offsets(J_then[i], J_now[i], then[i], now[i], lever[i], w[i], dtheta, inverse, per_offset)
    return dtheta, per_shift, per_offset
