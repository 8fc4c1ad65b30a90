"""Plot of the study of what makes the gait robust."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from turnscrew.study.ablation.measures import ALL
from turnscrew.study.rates import wilson

DPI = 110
WHOLE, LESS = "#2a7f62", "#3b6ea5"

Groups = Sequence[tuple[str, Sequence[Mapping[str, Any]]]]


def worth(groups: Groups, path: Path) -> Path:
    """Left, the share of trials that pass without each measure; right, how far each trial tilts the tool.

    Args:
        groups: Measure and the trials without it.
        path: Where to.
    """
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(11, 0.55 * len(groups) + 1.4), layout="constrained", sharey=True
    )
    rows = np.arange(len(groups))
    for row, (name, trials) in zip(rows, groups, strict=True):
        _share(left, int(row), trials, WHOLE if name == ALL.name else LESS)
        for passed, mark in ((True, "o"), (False, "x")):
            tilts = [trial["max_tilt_deg"] for trial in trials if trial["passed"] is passed]
            right.plot(tilts, np.full(len(tilts), row), mark, ms=4, alpha=0.6, color=WHOLE if passed else "#c8401f")
    left.set_yticks(rows, [name if name == ALL.name else f"without {name}" for name, _ in groups])
    left.invert_yaxis()
    left.set_xlim(0.0, 100.0)
    left.set_xlabel("trials that pass [%], 95 % interval")
    right.set_xscale("log")
    right.xaxis.set_major_formatter("{x:g}")
    right.set_xlabel("largest tilt of the tool in a trial [deg]; crossed: not passed")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    return path


def _share(axes: Axes, row: int, trials: Sequence[Mapping[str, Any]], color: str) -> None:
    count = sum(trial["passed"] for trial in trials)
    low, high = (100.0 * bound for bound in wilson(count, len(trials)))
    share = 100.0 * count / len(trials)
    axes.barh(row, share, color=color, height=0.6)
    # of a share of all the interval ends below it by rounding
    axes.errorbar(share, row, xerr=[[max(share - low, 0.0)], [max(high - share, 0.0)]], color="k", lw=1, capsize=3)
    # within its bar, or behind its interval where the bar is too short for it
    place, ink = (2.0, "w") if share > 20.0 else (high + 2.0, "k")
    axes.annotate(f"{count} of {len(trials)}", (place, row), va="center", color=ink, fontsize=9)
