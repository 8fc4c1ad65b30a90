"""Readings that are no numbers: each keeps the value of the last tick, so that none ever enters a state.

A sensor that stays silent is for the watch to name; here nothing is counted.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.signals import Measurement, Vision

ORTHOGONAL = 1e-6
"""By how much an orientation's columns may miss being orthonormal: single precision."""


def filled(measurement: Measurement, last: Measurement | None) -> Measurement:
    """The measurement with numbers only.

    Args:
        measurement: Now; entries of q, v, f_F and tau may be infinite or not a number, and so may the frame.
        last: What this function gave at the last tick, None at the first, when zeros must do.

    Returns:
        The same measurement where all is well.  Otherwise each bad entry is the last tick's, and a frame without a
        proper pose or covariance is left out; `blind` says so.
    """
    frame = measurement.vision
    readings = (measurement.q, measurement.v, measurement.f_F, measurement.tau)
    # a sum of finite readings is finite, and cheaper to ask
    if not all(r is None or isfinite(float(r.sum())) for r in readings):
        measurement = replace(
            measurement,
            q=_held(measurement.q, None if last is None else last.q),
            v=_held(measurement.v, None if last is None else last.v),
            f_F=None if measurement.f_F is None else _held(measurement.f_F, None if last is None else last.f_F),
            tau=None if measurement.tau is None else _held(measurement.tau, None if last is None else last.tau),
        )
    if frame is None or is_pose(frame):
        return measurement
    return replace(measurement, vision=None, blind="the camera's pose is no pose")


def is_pose(frame: Vision) -> bool:
    """Whether a frame holds a position, a rotation and a covariance: finite, orthonormal, no variance below zero."""
    return _is_pose(frame.p_WT, np.ascontiguousarray(frame.R_WT), np.ascontiguousarray(frame.P))


@compiled
def _is_pose(p: Array, R: Array, P: Array) -> bool:
    """`is_pose` of its parts."""
    if not (np.isfinite(p).all() and np.isfinite(R).all() and np.isfinite(P).all()):
        return False
    if np.abs(np.dot(R.T, R) - np.eye(3)).max() >= ORTHOGONAL or np.linalg.det(R) <= 0.0:
        return False
    # rounding may leave the least variance of a sharp direction a trifle below zero
    least: bool = np.linalg.eigvalsh(P)[0] >= -1e-9 * np.trace(P)
    return least


def _held(now: Array, then: Array | None) -> Array:
    return np.where(np.isfinite(now), now, 0.0 if then is None else then)
