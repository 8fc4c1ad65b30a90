"""A tool whose tip stands nowhere goes with the hand that holds it: how palm and fingertips have carried it in a tick.

While the tip is in its drive the tool turns about it, and rolling odometry needs no more than that.  A tool in the air
moves as a whole: with the palm, and beyond that as the touching fingertips move against the palm,

    min  sum w_i |d + theta x (c_i - c) - r_i|^2  +  lever^2 sum w_i |theta|^2,

r_i how far the contact of fingertip i has moved besides the palm's motion, c the contacts' weighted mean.  The second
term says that what no finger sees turn (two contacts see no turn about the line that joins them) turns with the palm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3, log_so3, skew

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

LEVER = 0.003
"""Lever of the doubt about turns that the fingers do not see [m]: a sixth of the handle's radius, so that a turn that
they do see is taken for 97 % of itself."""


class PalmPose(NamedTuple):
    """Where the palm is: p_WH (3,) in W [m] and R_WH (3, 3)."""

    p_WH: Array
    R_WH: Array


def carried(
    palms: tuple[PalmPose, PalmPose], tips: tuple[Fingertips, Fingertips], c_W: Array, weight: Array, p_WT: Array
) -> tuple[Array, Array]:
    """Motion of the tool in a tick.

    Args:
        palms: The palm before and now.
        tips: The fingertips before and now.
        c_W: (5, 3) contact points before, in W [m].
        weight: (5,) of each fingertip, 0 for those that do not touch.
        p_WT: (3,) the tip before, in W [m].

    Returns:
        The tip's way (3,) in W [m], and the tool's rotation vector (3,) in W [rad].
    """
    (p, R), (p_now, R_now) = palms
    turn = R_now @ R.T
    rows = np.flatnonzero(weight > 0.0)
    if not len(rows):
        return p_now + turn @ (p_WT - p) - p_WT, log_so3(turn)
    before, now = tips
    w, c = weight[rows] / weight[rows].sum(), c_W[rows]
    carry = np.einsum("kij,kgj->kig", now.R_WF[rows], before.R_WF[rows])
    moved = now.p_WF[rows] + np.einsum("kij,kj->ki", carry, c - before.p_WF[rows])
    with_palm = p_now + (c - p) @ turn.T
    r = moved - with_palm
    middle = w @ with_palm
    shift = w @ r
    A, b = LEVER**2 * np.eye(3), np.zeros(3)
    for share, arm, way in zip(w, with_palm - middle, r - shift, strict=True):
        S = skew(arm)
        A -= share * (S @ S)
        b += share * (S @ way)
    theta = np.asarray(np.linalg.solve(A, b), dtype=np.float64)
    tip = p_now + turn @ (p_WT - p)
    tip = middle + shift + exp_so3(theta) @ (tip - middle)
    return tip - p_WT, log_so3(exp_so3(theta) @ turn)
