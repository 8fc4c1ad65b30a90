"""One tick of the test for a slip of the tip by motion, compiled: how far fingertips have strayed, and the best fit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import cross, solve_positive


class Strayed(NamedTuple):
    """How the fingertips have moved otherwise than a tool on a tip at rest.

    Attributes:
        way: (5, 3) by how much, forgotten slowly, in W [m]; zero for fingers that do not hold.  A finger that joins
            others begins with what they have strayed by alike.
        held: (5,) time for which each has held [s].
        slow: (5,) slowly smoothed size of each force [N].
    """

    way: Array
    held: Array
    slow: Array


class Displaced(NamedTuple):
    """What the fingertips say of the tip.

    Attributes:
        d: (2,) displacement along x and y of W [m].
        S: (2, 2) its covariance by the encoders' noise.
        misfit: Squared normalised residual of the fit, over its degrees of freedom.
        number: How many fingers tell.
    """

    d: Array
    S: Array
    misfit: float
    number: int


@compiled
def strayed(
    way: Array, held: Array, slow: Array, f_F: Array, moved: Array, firm: float, going: float, keep: float,
    slow_time: float, dt: float,
) -> Strayed:  # fmt: skip
    """Adds a tick's motion to what the fingers that hold have strayed by.

    Args:
        way: (5, 3) before [m], `held` (5,) [s] and `slow` (5,) [N] likewise.
        held: As `way`.
        slow: As `way`.
        f_F: (5, 3) forces now [N].
        moved: (5, 3) by how much each fingertip moved otherwise than with the tool in this tick, in W [m].
        firm: Force from which on a finger holds [N].
        going: Share of `slow` below which it lets go.
        keep: Share of the way that is left after a tick.
        slow_time: Time constant of `slow` [s].
        dt: [s].
    """
    way, held, slow = way.copy(), held.copy(), slow.copy()
    for i in range(len(held)):
        size = np.sqrt(f_F[i, 0] ** 2 + f_F[i, 1] ** 2 + f_F[i, 2] ** 2)
        holds = size > max(firm, going * slow[i])
        slow[i] += dt / (slow_time + dt) * (size - slow[i])
        for j in range(3):
            way[i, j] = keep * way[i, j] + moved[i, j] if holds and held[i] > 0.0 else 0.0
        held[i] = held[i] + dt if holds else 0.0
    # what the hand as a whole is read to have moved by, those that hold know, and a finger that joins them does not
    alike, number = np.zeros(3), 0
    for i in range(len(held)):
        if held[i] > 1.5 * dt:
            alike, number = alike + way[i], number + 1
    for i in range(len(held)):
        if number and 0.0 < held[i] <= 1.5 * dt:
            way[i] = alike / number
    return Strayed(way, held, slow)


@compiled
def _noise(J: Array, arm: Array, first: int, encoder: float, floor: float) -> Array:
    """(3, 3) covariance of one contact's place by its finger's joints, from J (6, 28) at F and the arm (3,) from F."""
    S, way = np.zeros((3, 3)), np.empty(3)
    for k in range(first, J.shape[1]):
        turn = cross(J[3:, k], arm)
        for j in range(3):
            way[j] = J[j, k] + turn[j]
        for i in range(3):
            for j in range(3):
                S[i, j] += encoder * encoder * way[i] * way[j]
    for i in range(3):
        S[i, i] += floor * floor
    return S


@compiled
def _rows(lever: Array) -> Array:
    """(3, 6): how a displacement t of the tip and a turn u about it, `t + u x lever`, move a contact."""
    B = np.zeros((3, 6))
    for j in range(3):
        B[j, j] = 1.0
    B[0, 4], B[0, 5], B[1, 5] = lever[2], -lever[1], lever[0]
    B[1, 3], B[2, 3], B[2, 4] = -lever[2], lever[1], -lever[0]
    return B


@compiled
def displaced(
    way: Array, held: Array, c_W: Array, p_WF: Array, J: Array, p_WT: Array, first: int, encoder: float, floor: float,
    slid: Array, axis: Array, lift: float, turn: float, fresh: float, dt: float,
) -> Displaced:  # fmt: skip
    """Displacement of the tip that fits best what the fingertips have strayed by, whatever the tool turned by.

    Args:
        way: (5, 3) what they have strayed by, in W [m].
        held: (5,) time for which each has held [s].
        c_W: (5, 3) contact points, in W [m].
        p_WF: (5, 3) origins of the fingertips' frames.
        J: (5, 6, 28) their Jacobians.
        p_WT: (3,) tip, in W [m].
        first: First joint of the hand's fingers.
        encoder: Noise of a finger's joint as smoothed [rad].
        floor: What a contact moves by that no encoder tells [m].
        slid: (5,) by how much each may have slid along the handle [m],
        axis: (3,) and the handle's axis, in W.
        lift: Standard deviation along z of what all have moved by alike [m].
        turn: Of what the tool may have turned by beside what odometry has told, about any axis [rad].
        fresh: Time for which a finger that has just begun to hold does not tell [s].
        dt: [s].
    """
    N, g, square, number = np.zeros((6, 6)), np.zeros((6, 1)), 0.0, 0
    N[2, 2] = lift**-2
    for j in range(3):
        N[3 + j, 3 + j] = turn**-2
    for i in range(len(held)):
        if held[i] <= fresh:
            continue
        # the first reading, from which the way counts, is noisy as well, and is forgotten with time
        S = _noise(J[i], c_W[i] - p_WF[i], first, encoder * np.sqrt(1.0 + dt / held[i]), floor)
        for j in range(3):
            for k in range(3):
                S[j, k] += slid[i] * slid[i] * axis[j] * axis[k]
        B, d = _rows(c_W[i] - p_WT), way[i].copy().reshape(3, 1)
        weighed = solve_positive(S, np.hstack((B, d)))
        N += B.T @ weighed[:, :6].copy()
        told = weighed[:, 6:].copy()
        g += B.T @ told
        square += (d.T @ told)[0, 0]
        number += 1
    if number < 2:
        return Displaced(np.zeros(2), np.eye(2), 0.0, number)
    C = solve_positive(N, np.eye(6))
    x = C @ g
    rest = square - (g.T @ x)[0, 0]
    return Displaced(x[:2, 0].copy(), C[:2, :2].copy(), max(rest, 0.0) / (3 * number - 5), number)


@compiled
def evidence(d: Array, S: Array, along: Array, far: float, near: float) -> float:
    """Log-likelihood ratio of a displacement d (2,) with covariance S (2, 2) if the tip slips, against noise alone.

    Args:
        d: [m].
        S: [m2].
        along: (2,) direction in which a tip slips.
        far: Standard deviation of a slip's way in that direction [m],
        near: and across it [m].
    """
    T, size = S.copy(), along[0] ** 2 + along[1] ** 2
    for i in range(2):
        T[i, i] += near * near
        for j in range(2):
            T[i, j] += (far * far - near * near) * along[i] * along[j] / size
    det_S, det_T = S[0, 0] * S[1, 1] - S[0, 1] ** 2, T[0, 0] * T[1, 1] - T[0, 1] ** 2
    by_S = (d[0] ** 2 * S[1, 1] - 2.0 * d[0] * d[1] * S[0, 1] + d[1] ** 2 * S[0, 0]) / det_S
    by_T = (d[0] ** 2 * T[1, 1] - 2.0 * d[0] * d[1] * T[0, 1] + d[1] ** 2 * T[0, 0]) / det_T
    ratio: float = 0.5 * (by_S - by_T - np.log(det_T / det_S))
    return ratio
