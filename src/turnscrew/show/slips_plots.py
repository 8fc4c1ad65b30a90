"""Plot of the study of slips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from turnscrew.study.slips.events import IN_TIME, WINDOW

DPI = 110
BIN = 0.01
"""Of the histogram [s]: a tick."""


def delays(slips: Sequence[Mapping[str, Any]], signals: Sequence[tuple[str, np.ndarray]], path: Path) -> Path:
    """Left, when alarms came after a slip's first millimetre; right, the signal around each slip.

    Args:
        slips: Those that count.
        signals: Kind and (k, m) signals of each run with slips.
        path: Where to.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4), layout="constrained")
    kinds = list(dict.fromkeys(slip["kind"] for slip in slips))
    found = [[s["delay"] for s in slips if s["kind"] == kind and s["delay"] is not None] for kind in kinds]
    largest = max((max(values) for values in found if values), default=IN_TIME)
    missed = sum(slip["delay"] is None for slip in slips)
    bins = np.arange(-0.105, max(largest, IN_TIME) + 2 * BIN, BIN)
    left.hist([np.clip(values, bins[0], None) for values in found], bins, stacked=True, label=kinds)
    left.axvline(IN_TIME, color="#555555", ls="--", lw=1)
    left.set_xlabel("alarm after the first millimetre [s]")
    left.set_ylabel(f"slips ({len(slips)}, of which {missed} never raised one)")
    left.legend()
    for index, kind in enumerate(kinds):
        for name, rows in signals:
            if name == kind and len(rows):
                clock = np.linspace(*WINDOW, rows.shape[1])
                right.plot(clock, rows.T, color=f"C{index}", lw=0.6, alpha=0.6)
        right.plot([], [], color=f"C{index}", label=kind)
    right.axhline(1.0, color="k", lw=1)
    right.axvline(IN_TIME, color="#555555", ls="--", lw=1)
    # a slip's signal runs to tens of alarms; what matters is when it crosses one
    right.set_ylim(0.0, 3.0)
    right.set_xlabel("time from the first millimetre [s]")
    right.set_ylabel("slip signal (1 raises the alarm)")
    right.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
