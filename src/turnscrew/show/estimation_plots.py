"""Plots of the study of estimation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter

from turnscrew.study.estimation.replay import NEES_95

COLUMNS = (("position_mm", "tip position [mm]"), ("tilt_deg", "tilt [deg]"), ("yaw_deg", "yaw [deg]"))
DPI = 120


def ablation(done: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Bars: rms error of each variant (median over runs; whiskers from best to worst run), on a logarithmic axis."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    names = list(done[0]["pose"])
    for axis, (key, title) in zip(axes, COLUMNS, strict=True):
        rms = [[entry["pose"][name]["held"][key]["rms"] for entry in done] for name in names]
        middle = np.array([median(values) for values in rms])
        reach = np.array([[m - min(v), max(v) - m] for m, v in zip(middle, rms, strict=True)]).T
        axis.barh(names, middle, xerr=reach, color="#4c78a8", error_kw={"ecolor": "#333333", "lw": 1})
        axis.set_xscale("log")
        axis.set_xlim(0.6 * middle.min(), 2.0 * middle.max())
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(NullFormatter())
        for row, value in enumerate(middle):
            axis.annotate(f"{value:.2f}", (value, row), xytext=(12, 0), textcoords="offset points", va="center")
        axis.invert_yaxis()
        axis.set_xlabel(f"{title}, rms")
        axis.grid(axis="x", alpha=0.3)
    figure.suptitle(f"Error of the tool pose while at least two fingers hold ({len(done)} runs)")
    return _save(figure, path)


def over_time(traces: Mapping[str, np.ndarray], names: Sequence[str], path: Path) -> Path:
    """Errors of one run over time, and the tip's two-sigma by the filter's covariance."""
    figure, axes = plt.subplots(3, 1, figsize=(12, 8), sharex=True, layout="constrained")
    shown = [name for name in ("camera", "(1)-(5)", "MAP") if name in names]
    for axis, column, (_, title) in zip(axes, range(3), COLUMNS, strict=True):
        for name in shown:
            scale = 1e3 if column == 0 else np.degrees(1.0)
            style = {"ls": "none", "marker": ".", "ms": 2} if name == "camera" else {"lw": 1}
            axis.plot(traces[f"{name}.time"], np.abs(traces[f"{name}.error"][:, column]) * scale, label=name, **style)
        axis.set_yscale("log")
        axis.set_ylim(bottom=0.01)
        axis.set_ylabel(title)
        axis.grid(alpha=0.3)
    if "MAP" in shown:
        sigma = 2e3 * np.linalg.norm(traces["MAP.sigma"], axis=1)
        axes[0].plot(traces["MAP.time"], sigma, "k--", lw=0.8, label="MAP, two sigma")
    axes[0].legend(loc="upper right")
    axes[-1].set_xlabel("time [s]")
    return _save(figure, path)


def consistency(all_traces: Sequence[Mapping[str, np.ndarray]], path: Path) -> Path:
    """Normalised error squared of the filter's pose: its share below each value against chi-square's."""
    from scipy.stats import chi2

    nees = np.concatenate([traces["MAP.nees"][traces["MAP.held"]] for traces in all_traces])
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    x = np.linspace(0.0, 30.0, 200)
    axis.plot(np.sort(nees), np.linspace(0.0, 1.0, len(nees)), label=f"filter: mean {nees.mean():.1f}")
    axis.plot(x, chi2.cdf(x, 6), "k--", label="consistent: mean 6")
    axis.axvline(NEES_95, color="#999999", lw=0.8)
    axis.set_xlim(0.0, 30.0)
    axis.set_xlabel("normalised error squared of the pose (six degrees of freedom)")
    axis.set_ylabel("share of ticks below")
    axis.legend()
    axis.grid(alpha=0.3)
    return _save(figure, path)


def wrench(traces: Mapping[str, np.ndarray], path: Path) -> Path:
    """Axial force and torque at the tip, true and estimated, and the thread's stiffness as identified."""
    figure, axes = plt.subplots(3, 1, figsize=(12, 8), sharex=True, layout="constrained")
    time, true, found = (traces[f"wrench.{name}"] for name in ("time", "true", "F_s"))
    for axis, column, title in zip(axes, (2, 5), ("axial force [N]", "torque about the axis [N.m]"), strict=False):
        axis.plot(time, true[:, column], "k", lw=1, label="true")
        axis.plot(time, found[:, column], lw=1, label="estimated")
        axis.set_ylabel(title)
        axis.legend(loc="upper right")
        axis.grid(alpha=0.3)
    axes[2].plot(time, traces["wrench.stiffness"], lw=1)
    axes[2].set_ylabel("identified stiffness [N.m/rad]")
    axes[2].set_xlabel("time [s]")
    axes[2].grid(alpha=0.3)
    return _save(figure, path)


def sweep(done: Sequence[Mapping[str, Any]], label: str, path: Path) -> Path:
    """Rms errors against a level, such as camera noise: median over runs."""
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    levels = sorted({entry["level"] for entry in done})
    for axis, (key, title) in zip(axes, COLUMNS, strict=True):
        for name in done[0]["pose"]:
            values = [
                median(entry["pose"][name]["held"][key]["rms"] for entry in done if entry["level"] == level)
                for level in levels
            ]
            axis.plot(levels, values, marker="o", ms=4, label=name)
        axis.set_yscale("log")
        axis.set_xlabel(label)
        axis.set_ylabel(f"{title}, rms")
        axis.grid(which="both", alpha=0.3)
    axes[0].legend(fontsize=7)
    return _save(figure, path)


def _save(figure: Any, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
