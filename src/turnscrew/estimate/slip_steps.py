"""One tick of the tests for a slip of the tip, compiled: how fingers press, the net force, the held forces."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.compiled import compiled


class Press(NamedTuple):
    """How the fingers press.

    Attributes:
        since: (5,) time for which each has pressed [s]; zero of those that do not.
        f_W: (5, 3) forces of those, in W [N]; zero of the others.
        size: (5,) size of each force, pressing or not [N].
        same: Whether the same ones as at the last tick.
        firm: (5,) which hold firm.
        loose: What the others press with or have pressed with lately, all together [N]: no more can the tool's jerk be
            that they let go.
    """

    since: Array
    f_W: Array
    size: Array
    same: bool
    firm: Flags
    loose: float


@compiled
def pressed(
    level: Array, slow: Array, since: Array, f_W: Array, press: float, firm: float, letting_go: float, quiet: float,
    dt: float,
) -> Press:  # fmt: skip
    """How the fingers press now.

    Args:
        level: (5, 3) smoothed forces at the last tick, in W [N].
        slow: (5,) slowly smoothed sizes of the forces then [N].
        since: (5,) time for which each had pressed [s].
        f_W: (5, 3) forces now, in W [N].
        press: Force above which a finger presses [N].
        firm: Force below which it does not hold firm [N].
        letting_go: Share of `slow` below which it is letting go.
        quiet: Time for which a finger that has landed is not firm yet [s].
        dt: Time since the last tick [s].
    """
    since, holds, force, same = since.copy(), since > quiet, np.zeros(f_W.shape), True
    size, loose = np.empty(len(slow)), 0.0
    for i in range(len(slow)):
        size[i] = sqrt(f_W[i, 0] ** 2 + f_W[i, 1] ** 2 + f_W[i, 2] ** 2)
        same = same and (size[i] > press) == (since[i] > 0.0)
        since[i] = since[i] + dt if size[i] > press else 0.0
        held = sqrt(level[i, 0] ** 2 + level[i, 1] ** 2 + level[i, 2] ** 2)
        holds[i] = holds[i] and since[i] > 0.0 and held > max(firm, letting_go * slow[i])
        if not holds[i]:
            loose += max(size[i], held, slow[i])
        if since[i] > 0.0:
            for j in range(3):
                force[i, j] = f_W[i, j]
    return Press(since, force, size, same, holds, loose)


@compiled
def _load(f_W: Array, arm: Array) -> Array:
    """(5,) net force [N], and torque about x and y [N.m], of forces (k, 3) at arms (k, 3)."""
    y = np.zeros(5)
    for i in range(len(f_W)):
        for j in range(3):
            y[j] += f_W[i, j]
        y[3] += arm[i, 1] * f_W[i, 2] - arm[i, 2] * f_W[i, 1]
        y[4] += arm[i, 2] * f_W[i, 0] - arm[i, 0] * f_W[i, 2]
    return y


@compiled
def _told(x: Array, P: Array, H: Array, y: float, noise: float) -> float:
    """One Kalman filter takes in y = H x + noise, in place; its squared normalised innovation."""
    n = len(x)
    PH, innovation, S = np.zeros(n), y, noise
    for i in range(n):
        innovation -= H[i] * x[i]
        for j in range(n):
            PH[i] += P[i, j] * H[j]
        S += H[i] * PH[i]
    for i in range(n):
        x[i] += PH[i] / S * innovation
        for j in range(n):
            P[i, j] -= PH[i] / S * PH[j]
    return innovation * innovation / S


@compiled
def net_force(
    x: Array, P: Array, f_W: Array, arm: Array, n_W: Array, level: Array, height: float, jump_share: float,
    sigma: float, noise: float, keep: float, force_walk: float, torque_walk: float,
) -> tuple[Array, Array, float]:  # fmt: skip
    """Five Kalman filters at once, of hand force x, y, z and hand torque x, y: the load and the readings' errors.

    Args:
        x: (5, 6) load, and errors of the five fingers' readings over their squeeze.
        P: (5, 6, 6) their covariances.
        f_W: (5, 3) forces of the pressing fingers, in W [N].
        arm: (5, 3) from the tip to the contacts, in W [m].
        n_W: (5, 3) the handle's outward unit normals there.
        level: (5, 3) smoothed forces before, in W [N].
        height: Of the contacts above the tip [m].
        jump_share: Variance that a jump of the squeezes adds, over its square.
        sigma: Standard deviation of a reading's error over the squeeze.
        noise: White noise of a reading [N].
        keep: Share of that error that is left after a tick.
        force_walk: What a force may change by in a tick [N].
        torque_walk: What a torque may change by [N.m].

    Returns:
        x and P after the reading, and the sum of the squared normalised innovations.
    """
    x, P, y, H = x.copy(), P.copy(), _load(f_W, arm), np.ones(x.shape[1])
    k, count, jumped, total = len(f_W), 0, 0.0, 0.0
    squeeze = np.zeros(k)
    for i in range(k):
        squeeze[i] = max(-(f_W[i, 0] * n_W[i, 0] + f_W[i, 1] * n_W[i, 1] + f_W[i, 2] * n_W[i, 2]), 0.0)
        count += squeeze[i] != 0.0
        before = -(level[i, 0] * n_W[i, 0] + level[i, 1] * n_W[i, 1] + level[i, 2] * n_W[i, 2])
        jumped += jump_share * (squeeze[i] - before) ** 2
    for c in range(len(x)):
        scale, walk = (1.0, force_walk) if c < 3 else (height, torque_walk)
        for i in range(k):
            H[1 + i] = scale * squeeze[i]
            x[c, 1 + i] *= keep
            for j in range(k):
                P[c, 1 + i, 1 + j] *= keep * keep
            P[c, 1 + i, 1 + i] += sigma * sigma * (1.0 - keep * keep)
            P[c, 0, 1 + i] *= keep
            P[c, 1 + i, 0] *= keep
        P[c, 0, 0] += walk * walk
        # the last term keeps S off zero while nothing presses
        total += _told(x[c], P[c], H, y[c], scale * scale * (count * noise * noise + jumped) + 1e-9)
    return x, P, total


@compiled
def held_force(
    level: Array, slope: Array, f_W: Array, firm: Flags, ripple: float, a: float, b: float
) -> tuple[Array, Array, float]:  # fmt: skip
    """Trend of each finger's force.

    Args:
        level: (5, 3) smoothed forces before, in W [N].
        slope: (5, 3) their change a tick [N].
        f_W: (5, 3) forces now [N].
        firm: (5,) which fingers hold firm.
        ripple: Standard deviation of a held finger's force about its trend [N].
        a: Gain of the level,
        b: and of the slope.

    Returns:
        Level and slope now, and the sum of the firm ones' squared normalised innovations.
    """
    level, slope, total = level.copy(), slope.copy(), 0.0
    for i in range(len(f_W)):
        for j in range(3):
            level[i, j] += slope[i, j]
            innovation = f_W[i, j] - level[i, j]
            if firm[i]:
                total += (innovation / ripple) ** 2
            level[i, j] += a * innovation
            slope[i, j] += b * innovation
    return level, slope, total


@compiled
def axial_torque(f_W: Array, arm: Array, axis: Array) -> tuple[float, Array]:
    """Torque of the fingertips about the tool's axis, and (5, 3) each finger's force times its distance from it [N.m].

    Args:
        f_W: (5, 3) forces of the fingertips, in W [N].
        arm: (5, 3) from the tip to the contacts, in W [m].
        axis: (3,) the tool's axis.
    """
    torque, moment = 0.0, np.empty(f_W.shape)
    for i in range(len(f_W)):
        r, f = arm[i], f_W[i]
        height = r[0] * axis[0] + r[1] * axis[1] + r[2] * axis[2]
        x, y, z = r[0] - height * axis[0], r[1] - height * axis[1], r[2] - height * axis[2]
        torque += axis[0] * (y * f[2] - z * f[1]) + axis[1] * (z * f[0] - x * f[2]) + axis[2] * (x * f[1] - y * f[0])
        far = sqrt(x * x + y * y + z * z)
        for j in range(3):
            moment[i, j] = far * f[j]
    return torque, moment
