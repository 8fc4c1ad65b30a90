"""Plot of the study of slipping fingers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from turnscrew.study.finger_slips.events import IN_TIME, WINDOW
from turnscrew.study.finger_slips.run import ONLY_WATCHES, REACTS

DPI = 110
TICKS = (1, 2, 5, 10, 20, 50)


def ways(slips: Sequence[Mapping[str, Any]], signals: Sequence[tuple[str, np.ndarray]], path: Path) -> Path:
    """Left, the share of slips that went farther than so; right, the signal around each slip's millimetre.

    Args:
        slips: Those of a millimetre and more.
        signals: Kind and (k, m) signals of each run.
        path: Where to.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4), layout="constrained")
    for index, kind in enumerate((REACTS, ONLY_WATCHES)):
        found = np.sort([slip["travel_mm"] for slip in slips if slip["kind"] == kind])
        if len(found):
            left.step([1.0, *found], 1.0 - np.arange(len(found) + 1) / len(found), where="post",
                      label=f"{kind}: {len(found)} slips")  # fmt: skip
        for name, rows in signals:
            if name == kind and len(rows):
                clock = np.linspace(*WINDOW, rows.shape[1])
                right.plot(clock, rows.T, color=f"C{index}", lw=0.6, alpha=0.6)
        right.plot([], [], color=f"C{index}", label=kind)
    left.set_xscale("log")
    left.set_xticks(TICKS, [str(tick) for tick in TICKS])
    left.minorticks_off()
    left.set_xlabel("way of the finger over the handle [mm]")
    left.set_ylabel("share of slips that went farther")
    left.legend()
    right.axhline(1.0, color="k", lw=1)
    right.axvline(IN_TIME, color="#555555", ls="--", lw=1)
    right.set_ylim(0.0, 8.0)
    right.set_xlabel("time from the first millimetre [s]")
    right.set_ylabel("slip signal (1 raises the alarm)")
    right.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path
