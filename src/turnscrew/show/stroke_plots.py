"""How long strokes went: angle of the screw, tilt, squeeze and force on the tip over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from turnscrew.decide.plan import ROLLING
from turnscrew.robot.joints import FINGERS
from turnscrew.task.signal_table import column, read_signals

NAMES = ("screw turned [deg]", "tilt [deg]", "squeeze of thumb and middle finger [N]", "force on the tip [N]")


def plot(folders: Sequence[Path], out: Path) -> Path:
    """Draws recorded runs one above the other.

    Args:
        folders: Of the runs.
        out: Where `stroke.png` goes.

    Returns:
        The picture.
    """
    figure, axes = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    for folder in folders:
        columns = read_signals(folder)
        R_WT, f_W = column(columns, "truth.R_WT", 3, 3), column(columns, "truth.f_W", len(FINGERS), 3)
        n_W = column(columns, "estimate.n_W", len(FINGERS), 3)
        pressing = -(f_W * n_W).sum(axis=2)
        rows = [FINGERS.index(finger) for finger in ROLLING]
        lines = (
            np.degrees(columns["truth.theta"]), np.degrees(np.arccos(np.clip(R_WT[:, 2, 2], -1.0, 1.0))),
            pressing[:, rows], columns["truth.F_s.f_z"],
        )  # fmt: skip
        for axis, line, name in zip(axes.flat, lines, NAMES, strict=True):
            axis.plot(columns["measurement.time"], line, linewidth=0.8)
            axis.set_title(name, fontsize=9)
            axis.set_xlabel("time [s]", fontsize=8)
            axis.grid(alpha=0.3)
    path = out / "stroke.png"
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path
