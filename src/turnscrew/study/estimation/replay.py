"""Estimates a recorded run again, by each variant, and compares with the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.filter_state import pose_covariance
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.rotations import log_so3
from turnscrew.signals import Estimate
from turnscrew.study.estimation.variants import VARIANTS
from turnscrew.study.recording import Recording
from turnscrew.task.judge import pose_error

SETTLED = 1.0
"""Time after which the start is over [s]: thirty frames."""

NEES_95 = 12.59
"""95 % quantile of chi-square with six degrees of freedom."""


@dataclass(frozen=True)
class Trace:
    """One variant's pose over a run, at the ticks where it gave one.

    Attributes:
        name: Of the variant.
        time: (m,) [s].
        error: (m, 3) distance of the tips [m], angle between the axes [rad], rotation about the axis [rad].
        held: (m,) whether at least two fingertips touched.
        sigma: (m, 3) what the covariance says of the tip's coordinates [m]; not a number without one.
        nees: (m,) normalised error squared of the pose; not a number without a covariance.
        status: (m,) what the solver said of the last frame.
        solve_time: (f,) wall time of each frame's solve [s].
    """

    name: str
    time: Array
    error: Array
    held: Flags
    sigma: Array
    nees: Array
    status: tuple[str, ...]
    solve_time: Array


@dataclass(frozen=True)
class WrenchTrace:
    """The tip wrench over a run.

    Attributes:
        time: (n,) [s].
        F_s: (n, 6) estimated, in T, force first [N, N.m].
        true: (n, 6) true.
        held: (n,) whether at least two fingertips touched.
        stiffness: (n,) of the thread, as identified [N.m/rad].
    """

    time: Array
    F_s: Array
    true: Array
    held: Flags
    stiffness: Array


def run(recording: Recording, names: tuple[str, ...]) -> tuple[list[Trace], WrenchTrace]:
    """Estimates a run by the variants of these names.

    Returns:
        Their traces, in the order of `VARIANTS`, and the tip wrench of the estimator as it is.
    """
    asked = [variant for variant in VARIANTS if variant.name in names]
    steps = list(_estimates(recording, recording.estimator))
    traces = [_camera(recording)] if "camera" in names else []
    for variant in asked:
        if variant.change is not None:
            other = _estimates(recording, variant.change(recording.estimator))
            traces.append(_trace(variant.name, recording, list(other)))
        elif variant.name != "camera":
            traces.append(_trace(variant.name, recording, steps))
    estimates = [estimate for _, estimate, _ in steps]
    wrench = WrenchTrace(
        time=recording.truth.time,
        F_s=np.array([estimate.F_s for estimate in estimates]),
        true=recording.truth.F_s,
        held=recording.truth.held,
        stiffness=np.array([estimate.stiffness for estimate in estimates]),
    )
    return traces, wrench


Step = tuple[EstimatorState, Estimate, float]


def _estimates(recording: Recording, estimator: ToolEstimator) -> Iterator[Step]:
    """State and estimate after each tick, and the wall time of the tick."""
    state = estimator.init(recording.measurements[0], recording.p_WT, recording.R_WT)
    for measurement, motion in zip(recording.measurements, recording.sent, strict=True):
        began = perf_counter()
        state, estimate = estimator.update(state, measurement, motion, recording.dt)
        yield state, estimate, perf_counter() - began


def _camera(recording: Recording) -> Trace:
    """The camera's own error: each frame against the tool at its exposure."""
    truth = recording.truth
    frames = [measurement.vision for measurement in recording.measurements if measurement.vision is not None]
    rows = [int(np.argmin(np.abs(truth.time - frame.stamp))) for frame in frames]
    error = [pose_error(f.p_WT, f.R_WT, truth.p_WT[i], truth.R_WT[i]) for f, i in zip(frames, rows, strict=True)]
    nees = [_nees(f.p_WT, f.R_WT, f.P, truth.p_WT[i], truth.R_WT[i]) for f, i in zip(frames, rows, strict=True)]
    return Trace(
        name="camera",
        time=truth.time[rows],
        error=np.array(error).reshape(-1, 3),
        held=truth.held[rows],
        sigma=np.array([np.sqrt(np.diag(frame.P)[:3]) for frame in frames]).reshape(-1, 3),
        nees=np.array(nees),
        status=("",) * len(frames),
        solve_time=np.empty(0),
    )


def _trace(name: str, recording: Recording, steps: list[Step]) -> Trace:
    truth, count = recording.truth, len(steps)
    error, sigma, nees = np.empty((count, 3)), np.full((count, 3), np.nan), np.full(count, np.nan)
    solved = []
    for i, (state, estimate, wall) in enumerate(steps):
        p, R = _pose(name, state, estimate)
        error[i] = pose_error(p, R, truth.p_WT[i], truth.R_WT[i])
        if name == "MAP":
            P = pose_covariance(state.filter.P)
            sigma[i] = np.sqrt(np.diag(P)[:3])
            nees[i] = _nees(p, R, P, truth.p_WT[i], truth.R_WT[i])
        if recording.measurements[i].vision is not None:
            refined = state.refined
            solved.append(wall if name == "MAP" else np.nan if refined is None else refined.pose.wall_time)
    given = ~np.isnan(error[:, 0])
    status = tuple(str(estimate.status) for (_, estimate, _), kept in zip(steps, given, strict=True) if kept)
    return Trace(
        name, truth.time[given], error[given], truth.held[given], sigma[given], nees[given], status, np.array(solved)
    )


def _pose(name: str, state: EstimatorState, estimate: Estimate) -> tuple[Array, Array]:
    """The variant's pose out of what the estimator knows."""
    if name == "(1)":
        return estimate.p_WS, estimate.R_WT_seen
    if name == "MAP":
        return state.filter.p_WT, state.filter.R_WT
    if name == "loop":
        return estimate.p_WT, estimate.R_WT
    return estimate.p_WT_refined, estimate.R_WT_refined


def _nees(p: Array, R: Array, P: Array, p_true: Array, R_true: Array) -> float:
    error = np.concatenate([p_true - p, log_so3(R_true @ R.T)])
    # a camera without noise claims to be exact: there is nothing to normalise by
    return float(error @ np.linalg.solve(P, error)) if np.diag(P).all() else np.nan
