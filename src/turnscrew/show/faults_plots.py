"""Plot of the study of sensor faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from turnscrew.study.disturbances.table import SENSOR_FAULTS
from turnscrew.study.faults.events import AFTER

DPI = 110
BEFORE = 0.5
"""How much is shown of the time before a fault [s]."""


def over_time(runs: Sequence[tuple[Mapping[str, Any], Mapping[str, np.ndarray]]], path: Path) -> Path:
    """Errors around the fault: a row a kind, each run thin, the median bold, the fault shaded, 1 mm and 1 deg dashed.

    Args:
        runs: Events with their errors over time.
        path: Where to.
    """
    kinds = list(dict.fromkeys(event["kind"] for event, _ in runs))
    figure, axes = plt.subplots(
        len(kinds), 3, figsize=(13, 1.9 * len(kinds) + 0.6), sharex="row", squeeze=False, layout="constrained"
    )
    for row, kind in zip(axes, kinds, strict=True):
        of_kind = [(event, trace) for event, trace in runs if event["kind"] == kind]
        length = of_kind[0][0]["length"]
        clock = np.arange(-BEFORE, length + AFTER, 0.01)
        for column, axis in enumerate(row):
            axis.axvspan(0.0, length, color="#e45756", alpha=0.15, lw=0)
            axis.axhline(1.0, color="#555555", lw=0.8, ls="--")
            curves = np.array([_resampled(clock, trace, column) for _, trace in of_kind])
            axis.plot(clock, curves.T, color="#4c78a8", lw=0.6, alpha=0.5)
            # the median ends with the first run that does: what is left is not the same runs any more
            axis.plot(clock, np.median(curves, axis=0), color="k", lw=1.8)
            axis.set_ylim(0.0, max(1.3, 1.05 * float(np.nanmax(curves))))
            axis.grid(alpha=0.3)
        row[0].set_title(SENSOR_FAULTS[kind].meaning, fontsize=9, loc="left")
    for axis, title in zip(axes[0], ("tip [mm]", "tilt [deg]", "yaw [deg]"), strict=True):
        axis.set_title(title, fontsize=10, loc="right")
    for axis in axes[-1]:
        axis.set_xlabel("time from the fault's begin [s]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path


def _resampled(clock: np.ndarray, trace: Mapping[str, np.ndarray], column: int) -> np.ndarray:
    """A run's error at these times; not a number beyond its ends."""
    values: np.ndarray = np.interp(clock, trace["time"], trace["error"][:, column], left=np.nan, right=np.nan)
    return values
