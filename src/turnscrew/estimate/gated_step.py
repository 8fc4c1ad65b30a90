"""A Kalman update that judges its measurements first: blocks beyond a gate are left out and reported."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dposv, dpotrf

from turnscrew.geometry.arrays import Array

GATE = {1: 25.0, 3: 31.8, 6: 39.5}
"""Squared Mahalanobis distance of a 5-sigma outlier: as improbable (6e-7) in three and six dimensions as in one."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Measurements stacked, each block gated as a whole.

    Attributes:
        H: (m, n) derivative of the prediction by the errors.
        z: (m,) innovation: measured less predicted.
        R: (m, m) covariance of the measurement noise.
        blocks: Sizes of the blocks, 1, 3 or 6, in order.
    """

    H: Array
    z: Array
    R: Array
    blocks: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the gates said of each block: accepted or not, and its normalised innovation squared."""

    accepted: tuple[bool, ...]
    nis: tuple[float, ...]


class Step(NamedTuple):
    """Estimated errors (n,), their covariance (n, n) afterwards, and what the gates said."""

    error: Array
    P: Array
    verdict: Verdict


def gated_step(P: Array, rows: Rows) -> Step:
    """What measurements say of a state's errors.

    Args:
        P: (n, n) covariance of the errors before.
        rows: The measurements.

    Returns:
        The step; nothing moves where no block passes its gate, or where P has lost its definiteness to rounding.
    """
    HP = rows.H @ P
    S, z = HP @ rows.H.T + rows.R, rows.z
    if len(rows.blocks) == len(z):
        nis = (z * z / S.flat[:: len(S) + 1]).tolist()
        accepted = tuple(x <= GATE[1] for x in nis)
    else:
        nis = [_distance(S[block, block], z[block]) for block in _blocks(rows.blocks)]
        accepted = tuple(x <= GATE[size] for x, size in zip(nis, rows.blocks, strict=True))
    if not all(accepted):
        keep = np.repeat(accepted, rows.blocks)
        HP, S, z = HP[keep], S[np.ix_(keep, keep)], z[keep]
    verdict = Verdict(accepted, tuple(nis))
    if not len(z):
        return Step(np.zeros(len(P)), P, verdict)
    # With S = L L^T and W = L^-1 H P, K z = W^T L^-1 z and K H P = W^T W, symmetric to the last bit.
    L, status = dpotrf(S, lower=1)
    if status:
        return Step(np.zeros(len(P)), P, Verdict((False,) * len(accepted), tuple(nis)))
    W = dtrsm(1.0, L, HP, lower=1)
    w = dtrsm(1.0, L, z[:, None], lower=1)[:, 0]
    return Step(W.T @ w, P - W.T @ W, verdict)


def _blocks(sizes: tuple[int, ...]) -> list[slice]:
    stops = list(accumulate(sizes))
    return [slice(stop - size, stop) for stop, size in zip(stops, sizes, strict=True)]


def _distance(S: Array, z: Array) -> float:
    """Squared Mahalanobis distance of an innovation, endless where its covariance is none."""
    _, x, status = dposv(S, z)
    return inf if status else float(z @ x)


def stacked(*parts: Rows) -> Rows:
    """Several measurements as one, their noises independent."""
    m = sum(len(part.z) for part in parts)
    R, start = np.zeros((m, m)), 0
    for part in parts:
        stop = start + len(part.z)
        R[start:stop, start:stop] = part.R
        start = stop
    return Rows(
        np.vstack([part.H for part in parts]),
        np.concatenate([part.z for part in parts]),
        R,
        sum((part.blocks for part in parts), ()),
    )
