"""Encoders and force sensors that fail: a reading that is no number, a finger whose sensor hangs or falls silent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import DRIVEN, FINGERS, HAND_FINGERS
from turnscrew.signals import Measurement
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.spoilt_sensors import Spoil

HOLDING = ("TH", "FF", "MF", "RF")
"""Fingers that ever hold the tool."""


def no_number(span: Span, rng: Generator) -> Spoil:
    """One reading of one sensor is not a number in this time: a joint's angle or speed, or a force."""
    sensor, place = int(rng.integers(3)), float(rng.uniform())

    def spoil(now: Measurement, last: Measurement | None) -> Measurement:
        if not span.holds(now.time):
            return now
        if sensor == 0:
            return replace(now, q=_without(now.q, place))
        if sensor == 1:
            return replace(now, v=_without(now.v, place))
        if now.f_F is not None:
            return replace(now, f_F=_without(now.f_F, place))
        return now if now.tau is None else replace(now, tau=_without(now.tau, place))

    return spoil


def frozen(span: Span, rng: Generator) -> Spoil:
    """One finger's force readings stay as they were when this time began."""
    finger = str(rng.choice(HOLDING))

    def spoil(now: Measurement, last: Measurement | None) -> Measurement:
        return now if last is None or not span.holds(now.time) else _with_force(now, finger, last)

    return spoil


def silent(span: Span, rng: Generator) -> Spoil:
    """One finger's force readings are zero in this time."""
    finger = str(rng.choice(HOLDING))

    def spoil(now: Measurement, last: Measurement | None) -> Measurement:
        return _with_force(now, finger, None) if span.holds(now.time) else now

    return spoil


def _without(values: Array, place: float) -> Array:
    """The array with not-a-number at this share of its length."""
    out = values.copy()
    out.flat[int(place * out.size)] = np.nan
    return out


def _with_force(now: Measurement, finger: str, source: Measurement | None) -> Measurement:
    """A finger's fingertip force and drive torques as they are in another measurement, or zero."""
    if now.f_F is not None:
        f_F, row = now.f_F.copy(), FINGERS.index(finger)
        f_F[row] = 0.0 if source is None or source.f_F is None else source.f_F[row]
        now = replace(now, f_F=f_F)
    if now.tau is not None:
        tau, drives = now.tau.copy(), [DRIVEN.index(name) for name in HAND_FINGERS[finger] if name in DRIVEN]
        tau[drives] = 0.0 if source is None or source.tau is None else source.tau[drives]
        now = replace(now, tau=tau)
    return now
