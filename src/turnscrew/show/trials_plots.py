"""Plot of many trials: how each fared against each of the values that were drawn for it."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path

import duckdb
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from turnscrew.geometry.arrays import Array, Flags

DPI = 110
ACROSS = 4
PASSED, FAILED = "#2a7f62", "#c8401f"


def trials_figure(table: Path, keys: Sequence[str], path: Path) -> Path:
    """One panel a drawn value: turning speed of each trial against it, the failed ones crossed out.

    The last panel has the rounds that trials reached.

    Args:
        table: Of the trials.
        keys: That were varied; what is a word or the same in all trials gets no panel.
        path: Where to.
    """
    with duckdb.connect() as connection:
        quoted = str(table).replace("'", "''")
        columns = connection.execute(f"SELECT * FROM '{quoted}'").fetchnumpy()
    numbers = {
        key: np.ma.filled(columns[key], np.nan) for key in keys if key in columns and columns[key].dtype.kind == "f"
    }
    drawn = {key: values for key, values in numbers.items() if np.unique(values[np.isfinite(values)]).size > 1}
    passed, speed = columns["passed"].astype(bool), np.ma.filled(columns["deg_per_s"], 0.0)
    down = ceil((len(drawn) + 1) / ACROSS)
    figure, grid = plt.subplots(down, ACROSS, figsize=(3.6 * ACROSS, 2.7 * down), layout="constrained", squeeze=False)
    panels = list(grid.flat)
    for axes, (key, values) in zip(panels, drawn.items(), strict=False):
        _against(axes, values, speed, passed)
        axes.set_ylim(min(float(speed.min(initial=0.0)), 0.0) - 0.5, 1.1 * float(speed.max(initial=1.0)))
        axes.locator_params(axis="x", nbins=4)
        axes.set_xlabel(key)
    for row in grid:
        row[0].set_ylabel("turning speed, whole run [deg/s]")
    _rounds(panels[len(drawn)], columns["rounds"], passed)
    for axes in panels[len(drawn) + 1 :]:
        axes.set_axis_off()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path


def _against(axes: Axes, values: Array, speed: Array, passed: Flags) -> None:
    axes.plot(values[passed], speed[passed], "o", ms=4, color=PASSED, label="passed")
    axes.plot(values[~passed], speed[~passed], "x", ms=6, mew=1.6, color=FAILED, label="failed")


def _rounds(axes: Axes, rounds: Array, passed: Flags) -> None:
    bins = [number - 0.5 for number in range(max(int(rounds.max(initial=0)), 1) + 2)]
    axes.hist([rounds[passed], rounds[~passed]], bins, stacked=True, color=[PASSED, FAILED], label=["passed", "failed"])
    axes.set_xlabel("rounds by which the screw was turned")
    axes.set_ylabel("trials")
    axes.legend()
