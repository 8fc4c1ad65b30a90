"""Plots of the study of actuation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from turnscrew.study.actuation.conditions import POSITION, TORQUE
from turnscrew.study.actuation.figures import FIRM
from turnscrew.study.disturbances.pushes import LENGTH

DPI = 110
COLOURS = {TORQUE: "#4c78a8", POSITION: "#f58518"}
REDS = ("#e45756", "#9d2c2c", "#ff9da6", "#7f3c8d")
"""For the fixed forces."""

WINDOW = (-0.1, 0.6)
"""Stretch around a push [s]."""

PANELS = (("tilt_deg", "largest tilt [deg]"), ("tip_error", "rms error of the tip force [N]"),
          ("pressed", "mean pressing force [N]"), ("sliding_mm", "fingers slide in a run [mm]"))  # fmt: skip

Entry = Mapping[str, Any]
Run = tuple[Entry, Mapping[str, np.ndarray]]


def comparison(entries: Sequence[Entry], path: Path) -> Path:
    """A dot for each run, by condition and arm; crosses are runs that were lost."""
    conditions = list(dict.fromkeys(entry["condition"] for entry in entries))
    colours = _colours(entries)
    arms = list(colours)
    figure, axes = plt.subplots(1, len(PANELS), figsize=(4 * len(PANELS), 4), layout="constrained")
    for axis, (key, label) in zip(axes, PANELS, strict=True):
        for entry in entries:
            place = conditions.index(entry["condition"]) + 0.8 / len(arms) * (
                arms.index(entry["arm"]) - 0.5 * (len(arms) - 1)
            )
            mark = "o" if entry["holds"] else "x"
            axis.plot(place, entry[key], mark, color=colours[entry["arm"]], ms=4, alpha=0.6, mew=1.0)
        axis.set_xticks(range(len(conditions)), conditions, rotation=20)
        axis.set_ylabel(label)
        # a tool that falls over would hide all the others
        held = [entry[key] for entry in entries if entry["holds"]]
        axis.set_ylim(0.0, 1.1 * max(held, default=1.0))
        axis.grid(axis="y", alpha=0.3)
    for arm, colour in colours.items():
        axes[0].plot([], [], "o", color=colour, label=arm)
    axes[0].legend()
    return _save(figure, path)


def over_time(runs: Sequence[Run], path: Path) -> Path:
    """Mean pressing force of the fingers that hold, over the runs of the first seed under the first condition."""
    first = min(entry["seed"] for entry, _ in runs)
    condition, colours = runs[0][0]["condition"], _colours([entry for entry, _ in runs])
    figure, axis = plt.subplots(figsize=(11, 3.6), layout="constrained")
    for entry, trace in runs:
        if (entry["seed"], entry["condition"]) == (first, condition):
            # a twentieth of a second, against the noise
            axis.plot(
                trace["time"], _smooth(pressing(trace), 5), color=colours[entry["arm"]], lw=0.9, label=entry["arm"]
            )
    axis.set_xlabel("time [s]")
    axis.set_ylabel("pressing force, mean of the fingers [N]")
    axis.set_title(f"disturbance: {condition}, seed {first}")
    axis.grid(alpha=0.3)
    axis.legend()
    return _save(figure, path)


def around_pushes(runs: Sequence[Run], path: Path) -> Path:
    """Tilt, and change of the pressing force, around the pushes: median and middle nine tenths of an arm's pushes."""
    figure, axes = plt.subplots(2, 1, figsize=(9, 6), sharex=True, layout="constrained")
    for arm, colour in _colours([entry for entry, _ in runs if entry["pushes"]]).items():
        cut = [
            _around(trace, push["start"]) for entry, trace in runs if entry["arm"] == arm for push in entry["pushes"]
        ]
        rows = np.array([window for window in cut if window is not None])
        clock = np.linspace(*WINDOW, rows.shape[1])
        for axis, values in zip(axes, (rows[:, :, 0], rows[:, :, 1]), strict=True):
            low, middle, high = np.nanpercentile(values, (5, 50, 95), axis=0)
            axis.plot(clock, middle, color=colour, label=f"{arm} ({len(rows)} pushes)")
            axis.fill_between(clock, low, high, color=colour, alpha=0.15, lw=0)
    for axis in axes:
        axis.axvspan(0.0, LENGTH, color="#999999", alpha=0.2, lw=0)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("tilt [deg]")
    axes[0].legend()
    axes[1].set_ylabel("pressing force, less that before [N]")
    axes[1].set_xlabel("time from the push's begin [s]")
    return _save(figure, path)


def _colours(entries: Sequence[Entry]) -> dict[str, str]:
    """Of each arm, in the order asked for."""
    arms = dict.fromkeys(entry["arm"] for entry in entries)
    reds = cycle(REDS)
    return {arm: COLOURS.get(arm) or next(reds) for arm in arms}


def pressing(trace: Mapping[str, np.ndarray]) -> np.ndarray:
    """(n,) mean pressing force of the fingers that hold [N]; 0 where none does."""
    holds = trace["pressed"] >= FIRM
    total = np.where(holds, trace["pressed"], 0.0).sum(axis=1)
    return np.asarray(total / np.maximum(holds.sum(axis=1), 1))


def _around(trace: Mapping[str, np.ndarray], start: float) -> np.ndarray | None:
    """(m, 2) tilt [deg] and change of pressing force [N] at ticks around a push; None where the run ends before."""
    dt = float(np.median(np.diff(trace["time"])))
    rows = int(np.searchsorted(trace["time"], start)) + np.arange(round(WINDOW[0] / dt), round(WINDOW[1] / dt) + 1)
    if rows[-1] >= len(trace["time"]):
        return None
    pressed = pressing(trace)[rows]
    return np.stack([np.degrees(trace["tilt"][rows]), pressed - pressed[: -round(WINDOW[0] / dt)].mean()], axis=1)


def _smooth(values: np.ndarray, ticks: int) -> np.ndarray:
    return np.convolve(values, np.full(ticks, 1.0 / ticks), mode="same")


def _save(figure: Any, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
