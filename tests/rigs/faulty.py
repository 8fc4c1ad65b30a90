"""Measurements with one of many things wrong with them, at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.signals import Measurement
from turnscrew.study.disturbances.camera_faults import flip


def spoilt(measurement: Measurement, rng: Generator) -> Measurement:
    """One of many things that can be wrong with a measurement, at random."""
    kind = rng.integers(10)
    if kind == 0:
        return replace(measurement, q=_somewhere(measurement.q, np.nan, rng))
    if kind == 1:
        return replace(measurement, v=_somewhere(measurement.v, np.inf, rng))
    if kind == 2 and measurement.f_F is not None:
        return replace(measurement, f_F=_somewhere(measurement.f_F, np.nan, rng))
    if kind == 3 and measurement.f_F is not None:
        return replace(measurement, f_F=rng.normal(0.0, 20.0, (5, 3)))
    if kind == 4:
        return replace(measurement, q=measurement.q + rng.normal(0.0, 0.1, 28))
    if kind == 5 and measurement.f_F is not None:
        return replace(measurement, f_F=np.zeros((5, 3)))
    vision = measurement.vision
    if vision is None:
        return measurement
    if kind == 6:
        return replace(measurement, vision=replace(vision, p_WT=_somewhere(vision.p_WT, np.nan, rng)))
    if kind == 7:
        return replace(measurement, vision=flip(vision))
    if kind == 8:
        return replace(measurement, vision=replace(vision, p_WT=vision.p_WT + rng.normal(0.0, 0.5, 3)))
    return replace(measurement, vision=None)


def _somewhere(values: Array, wrong: float, rng: Generator) -> Array:
    out = values.copy()
    out.flat[rng.integers(out.size)] = wrong
    return out
