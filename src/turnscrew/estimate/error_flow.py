"""How the filter's errors move on with the tool from one tick to the next: `P' = F P F^T + Q`, compiled.

F differs from one in the three rows of the orientation and on the diagonal of the hand's displacement only, so the
product is taken of these rows alone.
"""

from __future__ import annotations

import numpy as np

from turnscrew.estimate.filter_state import HAND, OFFSETS, SIZE, SLIDE, TIP
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.rotations import exp_so3

_TIP, _OFFSETS, _HAND = TIP.start, OFFSETS.start, HAND.start


@compiled
def _turning(dtheta: Array, G: Array, D: Array, R_WT: Array, hand_W: Array, keep: float) -> tuple[Array, Array]:
    """The turn of the tool (3, 3), and the rows (3, 37) of F that belong to the orientation's error."""
    rows, push = np.zeros((3, SIZE)), dtheta.copy()
    spun = R_WT[0, 2] * dtheta[0] + R_WT[1, 2] * dtheta[1] + R_WT[2, 2] * dtheta[2]
    for i in range(3):
        # G [dtheta]x, row by row
        rows[i, _TIP] = G[i, 1] * dtheta[2] - G[i, 2] * dtheta[1]
        rows[i, _TIP + 1] = G[i, 2] * dtheta[0] - G[i, 0] * dtheta[2]
        rows[i, _TIP + 2] = G[i, 0] * dtheta[1] - G[i, 1] * dtheta[0]
        for j in range(3):
            rows[i, _HAND + j] = (1.0 - keep) * G[i, j] + rows[i, _TIP + j]
            push[i] += rows[i, _HAND + j] * hand_W[j]
        for j in range(D.shape[1]):
            rows[i, _OFFSETS + j] = -D[i, j]
        rows[i, SLIDE] = -spun * R_WT[i, 2]
    turn = exp_so3(push)
    for i in range(3):
        for j in range(3):
            rows[i, j] = turn[i, j]
    return turn, rows


@compiled
def _carried(P: Array, rows: Array, keep: float) -> Array:
    """F P F^T, F being `rows` for the orientation, `keep` for the hand's displacement and one for the others."""
    n = len(P)
    after, moved, fade = P.copy(), np.zeros((3, n)), np.ones(n)
    for j in range(3):
        fade[_HAND + j] = keep
    for i in range(3):
        for k in range(n):
            factor = rows[i, k]
            if factor != 0.0:
                for j in range(n):
                    moved[i, j] += factor * P[k, j]
    for i in range(n):
        for j in range(n):
            after[i, j] *= fade[i] * fade[j]
    for i in range(3):
        for j in range(3, n):
            after[i, j] = after[j, i] = moved[i, j] * fade[j]
        for j in range(3):
            after[i, j] = 0.0
            for k in range(n):
                after[i, j] += moved[i, k] * rows[j, k]
    return after


@compiled
def _sway(P: Array, G: Array, reach: Array, variance: Array) -> None:
    """Adds what fresh noise of arm and wrist does: the hand sways by w, the orientation by -G w."""
    kick = np.zeros((6, len(variance)))
    for k in range(len(variance)):
        for i in range(3):
            kick[3 + i, k] = reach[i, k]
            for j in range(3):
                kick[i, k] -= G[i, j] * reach[j, k]
    for i in range(6):
        row = i if i < 3 else _HAND + i - 3
        for j in range(6):
            column = j if j < 3 else _HAND + j - 3
            for k in range(len(variance)):
                P[row, column] += kick[i, k] * variance[k] * kick[j, k]


@compiled
def flow(
    P: Array, dtheta: Array, G: Array, D: Array, R_WT: Array, hand_W: Array, keep: float,
    reach: Array, sway: Array, walk: Array, spin_walk: float,
) -> tuple[Array, Array]:  # fmt: skip
    """The filter's prediction, as `ToolFilter.predict` states it.

    Args:
        P: (37, 37) covariance before.
        dtheta: (3,) rotation vector of the tool in W [rad].
        G: (3, 3) how it depends on the fingertips' place in W [rad/m].
        D: (3, 17) how it depends on the joints' offsets [rad/rad].
        R_WT: (3, 3) orientation of the tool before.
        hand_W: (3,) the hand's displacement before, in W [m].
        keep: Share of it that is left.
        reach: (3, 6) linear Jacobian of the hand's middle by arm and wrist, in W [m].
        sway: (6,) variance of the fresh noise in the readings of arm and wrist [rad^2].
        walk: (37,) variances that random walks add.
        spin_walk: And one about the tool's axis [rad^2].

    Returns:
        The turn of the tool (3, 3), and the covariance after it.
    """
    turn, rows = _turning(dtheta, G, D, R_WT, hand_W, keep)
    after = _carried(P, rows, keep)
    _sway(after, G, reach, sway)
    for i in range(len(P)):
        after[i, i] += walk[i]
    for i in range(3):
        for j in range(3):
            after[i, j] += spin_walk * R_WT[i, 2] * R_WT[j, 2]
    return turn, after
