"""The filter's correction: how long it takes, and whether its covariance is honest.

Honest is an estimator whose errors x, true less estimated, are as large as its covariance P says: x P^-1 x, the
normalised error squared (NEES), then is chi-squared with as many degrees of freedom as x has components.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import thread_time
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.stats import chi2

from turnscrew.estimate.correction import Correction, Corrector
from turnscrew.estimate.filter_state import Prior
from turnscrew.estimate.handle_contacts import capsules_of
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import log_so3
from turnscrew.robot.model import RobotModel
from turnscrew.study.recording import Recording
from turnscrew.study.solvers.comparison import Row, middle_and_tail
from turnscrew.study.solvers.instances import Replay
from turnscrew.study.solvers.random_corrections import Instance, drawn_corrections, planned_grip
from turnscrew.task.scenario import load
from turnscrew.task.start import plan_of

POSE, LASTING = 6, 27
"""States of the filter that are the tool's pose (rotation and tip), and all that say what is so: also the screw's
place, the handle's radius and 17 encoder offsets."""

ONE_FRAME = ToolFilter(alike=1.0)
"""The filter's noise for a single correction: its default counts a contact's bend for the thirty frames that a run
repeats it."""

FREE_TENDONS = Prior(coupling=None)
"""What beliefs are drawn from: each joint's offset by itself."""

WARM_UP = 10
"""Corrections before the clock counts."""


def drawn_rows(k: int, n: int, rng: Generator) -> Iterator[Row]:
    """One correction each of n robots with k fingers on the handle, from 3 deg and 5 mm of doubt."""
    robot = RobotModel()
    grip = planned_grip(plan_of(load()), k)
    for i, drawn in enumerate(drawn_corrections(grip, robot, rng, ONE_FRAME, FREE_TENDONS, n + WARM_UP)):
        done, took = _corrected(drawn)
        if i < WARM_UP:
            continue
        x = drawn.missed(done.state)
        yield {
            "k": k,
            "taken": bool(done.vision) and done.tip and len(done.contacts) == k,
            "steps": done.steps,
            "time": took,
            "nees_pose": _nees(x[:POSE], done.state.P),
            "nees": _nees(x, done.state.P),
        }


def _corrected(drawn: Instance) -> tuple[Correction, float]:
    """The correction, and its processor time [s]."""
    capsules = capsules_of(drawn.tips)
    began = thread_time()
    corrector = Corrector(drawn.handle, ONE_FRAME, FREE_TENDONS)
    done = corrector.apply(
        drawn.state, drawn.seen, drawn.p_WS, drawn.tips, capsules, drawn.touching, drawn.force, refused=0
    )
    return done, thread_time() - began


def recorded_rows(recording: Recording, replay: Replay) -> Iterator[Row]:
    """The corrections of a run at its camera frames, by the number of fingers whose contact was believed."""
    truth = recording.truth
    for state, row in replay.corrections:
        done = state.correction
        if done is None or done.vision is None:
            continue
        after = done.state
        x = np.concatenate([log_so3(truth.R_WT[row] @ after.R_WT.T), truth.p_WT[row] - after.p_WT])
        yield {
            "k": len(done.contacts),
            "taken": done.vision and done.tip,
            "steps": done.steps,
            "time": state.correction_time,
            "nees_pose": _nees(x, after.P),
            "nees": np.nan,
        }


def _nees(x: Array, P: Array) -> float:
    n = len(x)
    return float(x @ np.linalg.solve(P[:n, :n], x))


def correction_figures(rows: Sequence[Row]) -> dict[str, Any]:
    """The figures of some corrections, one at least.

    Returns:
        n: Corrections.
        taken: In how many camera, tip and all contacts passed their gates.
        ms, steps: Median and 99 %.
        pose, lasting: NEES of the pose and of all lasting states, where known: `consistency`.
    """
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    figures: dict[str, Any] = {
        "n": len(rows),
        "taken": int(columns["taken"].sum()),
        "ms": middle_and_tail(1e3 * columns["time"]),
        "steps": middle_and_tail(columns["steps"]),
        "pose": consistency(columns["nees_pose"], POSE),
    }
    if np.isfinite(columns["nees"]).all():
        figures["lasting"] = consistency(columns["nees"], LASTING)
    return figures


def consistency(nees: Array, freedom: int) -> dict[str, Any]:
    """How normalised errors squared compare with chi-squared of `freedom` degrees.

    Returns:
        freedom: As given.
        mean: Of the errors; `freedom` is expected.
        band: Where the mean of as many independent ones lies in 95 % of tries.
        within: Share below the 95 % quantile.
        within_band: Where that share lies in 95 % of tries.
    """
    n = len(nees)
    spread = 1.96 * np.sqrt(0.95 * 0.05 / n)
    return {
        "freedom": freedom,
        "mean": float(nees.mean()),
        "band": [float(chi2.ppf(share, n * freedom) / n) for share in (0.025, 0.975)],
        "within": float((nees <= chi2.ppf(0.95, freedom)).mean()),
        "within_band": [0.95 - spread, min(0.95 + spread, 1.0)],
    }
