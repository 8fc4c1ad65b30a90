"""Plots of the study of stability."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from turnscrew.study.parts import Done

DPI = 120
STEEPEST = 20.0
"""Growth beyond which the map's colour changes no more [1/s]."""


def gain_map(found: Done, cases: Sequence[Done], path: Path) -> Path:
    """Growth of the largest swing over natural frequency and delay, its edge, the default and the measured edges.

    Args:
        found: The map.
        cases: Edges, of which those are shown that differ from the map's grasp by the servo's frequency alone.
        path: Where it goes.
    """
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    period = 1e3 * found["period"]
    frequencies, delays = np.array(found["frequencies"]), period * np.array(found["delays"])
    growth = np.array(found["growth"]).T
    levels = np.linspace(-STEEPEST, STEEPEST, 21)
    shades = axis.contourf(frequencies, delays, growth, levels, cmap="RdYlGn_r", extend="both")
    figure.colorbar(shades, label="growth of the largest swing [1/s]")
    axis.contour(frequencies, delays, growth, [0.0], colors="k", linewidths=2)
    axis.plot([], [], "k", lw=2, label="predicted edge")
    axis.plot(found["frequency"], 0.0, "*", color="k", ms=16, clip_on=False, label="gains as they are, no delay")
    same = [
        case for case in cases
        if case["moved"] == "delay" and _alike(case["overrides"]) and case["period"] == found["period"]
    ]  # fmt: skip
    shown = axis.plot(
        [case["frequency"] for case in same], [period * case["measured"] for case in same], "o", mfc="w", mec="k",
        label="measured",
    )  # fmt: skip
    shown[0].set_zorder(3)
    axis.set_ylim(bottom=0.0)
    axis.set_xscale("log")
    axis.set_xticks([8, 16, 32, 64, 128], labels=["8", "16", "32", "64", "128"])
    axis.minorticks_off()
    axis.set_xlabel("natural frequency of the servo [rad/s]")
    axis.set_ylabel("delay of commands [ms]")
    axis.legend(loc="upper right")
    return _save(figure, path)


def edges(cases: Sequence[Done], path: Path) -> Path:
    """Measured against predicted edges: delays in control periods, gains as factors."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained")
    for axis, moved, title in zip(
        axes, ("delay", "gain"), ("delay [control periods]", "factor on the gains"), strict=True
    ):
        part = [case for case in cases if case["moved"] == moved]
        axis.plot([case["predicted"] for case in part], [case["measured"] for case in part], "o")
        reach = max((max(case["predicted"], case["measured"]) for case in part), default=1.0) * 1.15
        line = np.array([0.0, reach])
        axis.plot(line, line, "k", lw=1)
        low, high = (line - 1.0, line + 1.0) if moved == "delay" else (0.75 * line, 1.25 * line)
        axis.fill_between(line, low, high, color="#4c78a8", alpha=0.15)
        axis.set_xlim(0.0, reach)
        axis.set_ylim(0.0, reach)
        axis.set_xlabel(f"predicted edge: {title}")
        axis.set_ylabel("measured edge")
        axis.grid(alpha=0.3)
    return _save(figure, path)


def _alike(overrides: Sequence[str]) -> bool:
    """Whether nothing but the servo's natural frequency is another."""
    return all(override.startswith("control.frequency=") for override in overrides)


def _save(figure: Any, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
