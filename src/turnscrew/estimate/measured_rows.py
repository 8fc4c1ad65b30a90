"""Camera and contacts as rows of measurements for the filter, compiled: innovations, derivatives, noise."""

from __future__ import annotations

from math import sqrt

import numpy as np

from turnscrew.estimate.filter_state import HAND, OFFSETS, RADIUS, SIZE, THETA, TIP
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import CONTACT, GAP, NORMAL
from turnscrew.geometry.closest import TIP as TOUCH
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.foot import Triple
from turnscrew.geometry.rotations import log_so3

_THETA, _TIP, _OFFSETS, _HAND = THETA.start, TIP.start, OFFSETS.start, HAND.start


@compiled
def camera(
    seen_p_WT: Array, seen_R_WT: Array, seen_P: Array, p_WT: Array, R_WT: Array, seen_W: Array,
    fresh: float, sharpest: float, carried_tilt: float, carried_yaw: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Innovation (6,) and its noise (6, 6) of a camera pose: of the tip [m], then of the orientation [rad].

    Args:
        seen_p_WT: (3,) the tip as seen, in W [m].
        seen_R_WT: (3, 3) the orientation as seen.
        seen_P: (6, 6) covariance of these.
        p_WT: (3,) the tip as believed [m].
        R_WT: (3, 3) the orientation as believed.
        seen_W: (6,) the camera's lasting error as believed.
        fresh: Share of the covariance that is drawn afresh for this frame.
        sharpest: No frame's position is taken for better than this [m].
        carried_tilt: What carrying the frame to now has added to its orientation's error [rad],
        carried_yaw: and about the tool's axis [rad].
    """
    z, R = np.empty(6), fresh * seen_P
    turn = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            turn[i, j] = seen_R_WT[i, 0] * R_WT[j, 0] + seen_R_WT[i, 1] * R_WT[j, 1] + seen_R_WT[i, 2] * R_WT[j, 2]
            R[3 + i, 3 + j] += (carried_yaw**2 - carried_tilt**2) * R_WT[i, 2] * R_WT[j, 2]
        R[i, i] += sharpest**2
        R[3 + i, 3 + i] += carried_tilt**2
    phi = log_so3(turn)
    for i in range(3):
        z[i] = seen_p_WT[i] - p_WT[i] - seen_W[i]
        z[3 + i] = phi[i] - seen_W[3 + i]
    return z, R


@compiled
def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _way(d: Triple, r: Triple, s: Triple, J: Array, row: Array) -> None:
    """How far errors move handle against fingertip along d, at a contact r from the tool's origin and s from F's."""
    by_turn, of_tip = _cross(r, d), _cross(s, d)
    for i in range(3):
        row[_THETA + i], row[_TIP + i], row[_HAND + i] = by_turn[i], d[i], d[i]
    for k in range(J.shape[1]):
        for i in range(3):
            row[_OFFSETS + k] += d[i] * J[i, k] + of_tip[i] * J[3 + i, k]


@compiled
def _variance(row: Array, P: Array) -> float:
    """Row P row^T."""
    total = 0.0
    for i in range(len(row)):
        if row[i] != 0.0:
            part = 0.0
            for j in range(len(row)):
                part += P[i, j] * row[j]
            total += row[i] * part
    return total


@compiled
def _contact(point: Array, p_WF: Array, J: Array, p_WT: Array, R_WT: Array, P: Array, H: Array) -> float:
    """Fills the row H (37,) of one gap; returns the mean by which it grows as the contact slides around the handle."""
    n = (point[NORMAL], point[NORMAL + 1], point[NORMAL + 2])
    r = (point[CONTACT] - p_WT[0], point[CONTACT + 1] - p_WT[1], point[CONTACT + 2] - p_WT[2])
    s = (point[TOUCH] - p_WF[0], point[TOUCH + 1] - p_WF[1], point[TOUCH + 2] - p_WF[2])
    axis = (R_WT[0, 2], R_WT[1, 2], R_WT[2, 2])
    around = np.zeros(SIZE)
    _way(_cross(axis, n), r, s, J, around)
    _way(n, r, s, J, H)
    for i in range(SIZE):
        H[i] = -H[i]
    H[RADIUS] = -1.0
    height = r[0] * axis[0] + r[1] * axis[1] + r[2] * axis[2]
    handle = sqrt(max(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] - height * height, 0.0))
    fingertip = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2])
    return _variance(around, P) * 0.5 / (handle + fingertip)


@compiled
def contacts(
    points: Array, p_WF: Array, J: Array, force: Array, p_WT: Array, R_WT: Array, P: Array, hand_W: Array,
    radius_error: float, encoder: float, indentation: float, indentation_error: float, contact: float, alike: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Derivatives (k, 37), innovations (k,) and noise (k, k) of the gaps, as `ToolFilter.contact_rows` states them."""
    k = len(points)
    H, z, R = np.zeros((k, SIZE)), np.empty(k), np.zeros((k, k))
    for i in range(k):
        bend = _contact(points[i], p_WF[i], J[i], p_WT, R_WT, P, H[i])
        depth = indentation * force[i]
        z[i] = radius_error - points[i, GAP] - depth - bend
        for j in range(3):
            z[i] -= H[i, _HAND + j] * hand_W[j]
        by_encoders = 0.0
        for j in range(J.shape[2]):
            by_encoders += H[i, _OFFSETS + j] * H[i, _OFFSETS + j]
        R[i, i] = encoder**2 * by_encoders + (indentation_error * depth) ** 2 + contact**2 + 2.0 * alike * bend * bend
    return H, z, R
