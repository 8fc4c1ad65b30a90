"""Cameras that fail: the lens is covered, or the markers are seen flipped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from turnscrew.geometry.rotations import exp_so3
from turnscrew.signals import Measurement, Vision
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.spoilt_sensors import Spoil

COVERED = "the lens is covered"

COLLAR = np.array([0.0, 0.0, 0.185])
"""Where the markers are, in T [m]."""

FLIP = np.radians(30.0)
"""By how much a flipped pose is turned [rad]: a marker at 15 deg to the line of sight mirrors to there."""


def dark(span: Span) -> Spoil:
    """No frame that was exposed in this time arrives."""

    def spoil(now: Measurement, last: Measurement | None) -> Measurement:
        exposed = now.time if now.vision is None else now.vision.stamp
        return replace(now, vision=None, blind=COVERED) if span.holds(exposed) else now

    return spoil


def flipped(span: Span, heading: float = 0.0) -> Spoil:
    """Frames that were exposed in this time show the markers flipped.

    Args:
        span: When.
        heading: Direction of the level axis of the flip, from W's x axis [rad].
    """

    def spoil(now: Measurement, last: Measurement | None) -> Measurement:
        frame = now.vision
        return now if frame is None or not span.holds(frame.stamp) else replace(now, vision=flip(frame, heading))

    return spoil


def flip(frame: Vision, heading: float = 0.0) -> Vision:
    """The frame with the markers turned by `FLIP` about a level axis through them, in the direction `heading` [rad]."""
    turn = exp_so3(FLIP * np.array([np.cos(heading), np.sin(heading), 0.0]))
    collar = frame.p_WT + frame.R_WT @ COLLAR
    R_WT = turn @ frame.R_WT
    return replace(frame, p_WT=collar - R_WT @ COLLAR, R_WT=R_WT)
