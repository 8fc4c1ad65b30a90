"""A run's traces boiled down to the figures that stand in a table."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.study.estimation.replay import NEES_95, SETTLED, Trace, WrenchTrace

SCALES = {"position_mm": 1e3, "tilt_deg": 180.0 / np.pi, "yaw_deg": 180.0 / np.pi}
"""What the columns of a trace's error are called outside, and their units."""


def spread(values: Array) -> dict[str, float]:
    """Root mean square, 95th percentile and largest of absolute values; nothing of none."""
    if not len(values):
        return {}
    size = np.abs(values)
    return {
        "rms": float(np.sqrt(np.mean(size**2))),
        "p95": float(np.percentile(size, 95.0)),
        "max": float(size.max()),
    }


def pose_figures(trace: Trace) -> dict[str, Any]:
    """Errors while at least two fingers hold, with and without the start; consistency; solver."""
    figures: dict[str, Any] = {}
    for key, rows in (("held", trace.held), ("settled", trace.held & (trace.time >= SETTLED))):
        figures[key] = {
            name: spread(trace.error[rows, column] * scale) for column, (name, scale) in enumerate(SCALES.items())
        }
    nees = trace.nees[trace.held & np.isfinite(trace.nees)]
    if len(nees):
        figures["nees"] = {"mean": float(nees.mean()), "within_95": float(np.mean(nees <= NEES_95))}
    solve = trace.solve_time[np.isfinite(trace.solve_time)]
    if len(solve):
        figures["solve_ms"] = {"median": 1e3 * float(np.median(solve)), "p99": 1e3 * float(np.percentile(solve, 99.0))}
    if any(trace.status):
        figures["status"] = dict(Counter(trace.status))
    return figures


def wrench_figures(trace: WrenchTrace) -> dict[str, Any]:
    """Errors of the tip's axial force and torque while at least two fingers hold, also over the true ones' size."""
    figures: dict[str, Any] = {}
    for name, axis in (("f_z", 2), ("tau_z", 5)):
        error, true = (trace.F_s - trace.true)[trace.held, axis], trace.true[trace.held, axis]
        size = float(np.sqrt(np.mean(true**2)))
        figures[name] = {**spread(error), "true_rms": size, "relative": spread(error)["rms"] / size}
    side = np.linalg.norm((trace.F_s - trace.true)[trace.held, :2], axis=1)
    figures["f_xy"] = spread(side)
    if np.isfinite(trace.stiffness[-1]):
        figures["stiffness"] = float(trace.stiffness[-1])
    return figures
