"""Plots of what grasps can give, and of when they give way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from turnscrew.robot.joints import FINGERS
from turnscrew.task.envelope import Envelope, Grip
from turnscrew.task.seating import SIZES

DPI = 120
COLOURS = {Grip.ROLLING: "#4c78a8", Grip.HOLDING: "#f58518", Grip.ALL: "#54a24b"}
MARKERS = {"friction": "o", "squeeze": "s", "drive": "^", "tip": "x"}


def kind(limit: str) -> str:
    """What kind of limit a name stands for: "friction", "squeeze", "tip" or "drive"."""
    who, _, what = limit.partition(" ")
    return who if who == "tip" else what or "drive"


def over_stroke(envelopes: Sequence[Envelope], path: Path) -> Path:
    """Torque over the stroke, a panel for each handle; markers tell what binds most, dotted lines what seats."""
    radii = sorted({found.radius for found in envelopes})
    figure, panels = plt.subplots(
        1, len(radii), figsize=(5.5 * len(radii), 4.5), sharey=True, squeeze=False, layout="constrained"
    )
    largest = max(moment.steady.torque for found in envelopes for moment in found.moments)
    for axis, radius in zip(panels[0], radii, strict=True):
        for found in (found for found in envelopes if found.radius == radius):
            _draw(axis, found, label=len(envelopes) > len(radii))
        for size in SIZES:
            if size.seating_torque < 1.15 * largest:
                axis.axhline(size.seating_torque, color="#777777", lw=0.8, ls=":")
                axis.annotate(f"seats {size.name}", (0.0, size.seating_torque), fontsize=8, color="#555555")
        axis.set_ylim(0.0, 1.15 * largest)
        axis.set_xlabel("angle of the stroke [deg]")
        axis.set_title(f"handle of {radius * 1e3:g} mm")
        axis.grid(alpha=0.3)
    panels[0][0].set_ylabel("largest steady torque [N.m]")
    marks = [Line2D([], [], color="#333333", ls="", marker=mark, label=name) for name, mark in MARKERS.items()]
    lines = [Line2D([], [], color=colour, label=str(grip)) for grip, colour in COLOURS.items()]
    figure.legend(handles=[*lines, *marks], loc="outside lower center", ncols=7, fontsize=8)
    return _save(figure, path)


def _draw(axis: Any, found: Envelope, *, label: bool) -> None:
    for grip, colour in COLOURS.items():
        moments = found.of(grip)
        angle = np.degrees([moment.angle for moment in moments])
        torque = np.array([moment.steady.torque for moment in moments])
        axis.plot(angle, torque, color=colour, lw=1.2)
        for x, y, moment in zip(angle, torque, moments, strict=True):
            if moment.limits:
                axis.plot(x, y, color=colour, ls="", ms=5, marker=MARKERS[kind(moment.limits[0].name)])
        if label:
            axis.annotate(f"{found.friction:g}", (angle[-1], torque[-1]), xytext=(4, 0), textcoords="offset points",
                          fontsize=7, va="center", color=colour)  # fmt: skip


def agreement(done: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Torque at which grasps gave way over the torque predicted, one panel for each choice of forces."""
    choices = list(dict.fromkeys(entry["forces"] for entry in done))
    figure, panels = plt.subplots(1, len(choices), figsize=(5.5 * len(choices), 5), squeeze=False, layout="constrained")
    for axis, who in zip(panels[0], choices, strict=True):
        for grip, colour in COLOURS.items():
            own = [entry for entry in done if entry["forces"] == who and entry["grasp"] == grip]
            pairs = np.array([(entry["predicted_nm"], entry["gave_way_nm"]) for entry in own]).reshape(-1, 2)
            axis.plot(pairs[:, 0], pairs[:, 1], ls="", marker="o", ms=4, color=colour, label=str(grip))
        top = 1.1 * max(entry["predicted_nm"] for entry in done)
        for slope, style in ((0.9, ":"), (1.0, "-"), (1.1, ":")):
            axis.plot([0.0, top], [0.0, slope * top], color="#777777", lw=0.8, ls=style)
        axis.set_xlabel("predicted [N.m]")
        axis.set_ylabel("gave way at [N.m]; dotted: 10 % off")
        axis.set_title(f"contact forces: {who}")
        axis.legend()
        axis.grid(alpha=0.3)
    return _save(figure, path)


def giving_way(traces: Mapping[str, np.ndarray], title: str, path: Path) -> Path:
    """One grasp under a rising torque: torques, slips and squeezes over time."""
    figure, axes = plt.subplots(3, 1, figsize=(9, 7), sharex=True, layout="constrained")
    axes[0].plot(traces["time"], traces["asked"], "k--", lw=1, label="asked for")
    axes[0].plot(traces["time"], traces["got"], lw=1, label="on the screw")
    axes[0].set_ylabel("torque [N.m]")
    for axis, name, scale, unit in ((axes[1], "slip", 1e3, "slip [mm]"), (axes[2], "pressing", 1.0, "squeeze [N]")):
        for row, finger in enumerate(FINGERS):
            if traces["pressing"][:, row].max() > 0.5:
                axis.plot(traces["time"], scale * traces[name][:, row], lw=1, label=finger)
        axis.set_ylabel(unit)
    axes[2].set_xlabel("time [s]")
    for axis in axes:
        axis.legend(fontsize=8)
        axis.grid(alpha=0.3)
    figure.suptitle(title)
    return _save(figure, path)


def _save(figure: Any, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
