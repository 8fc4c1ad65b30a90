"""What a sensor fault does to the estimate and to the run, one event each."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.plant.truth import Truth
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.table import SENSOR_FAULTS
from turnscrew.task.fasten import Run
from turnscrew.task.judge import pose_error
from turnscrew.task.loop import Tick

AFTER = 1.0
"""Time after a fault in which its errors still count [s]."""


@dataclass(frozen=True)
class FaultEvent:
    """One injected fault and what came of it; errors are the largest of the estimate against the truth.

    Attributes:
        kind: As in the table of disturbances.
        seed: Of the run.
        phase: Phase of the gait in which it began.
        turning: Whether the tool was being turned then; otherwise it was being handed over.
        start: When [s].
        length: How long it lasted [s].
        tip_mm: Error of the tip's position from the fault's begin to `AFTER` its end.
        tilt_deg: Of the tilt.
        yaw_deg: Of the yaw.
        tip_mm_during: While the fault lasted.
        tilt_deg_during: Likewise.
        yaw_deg_during: Likewise.
        expected: What should be named; empty if nothing.
        expected_s: Time from the fault's begin until that was named; None if it was not.
        named: All that was named in the time of the errors, in its order.
        named_s: Time until the first of it.
        frames: Spoilt camera frames that arrived.
        refused: How many of them the filter refused.
        healthy_s: Time from the fault's end until nothing was named any more; None if the run ended before.
        outcome: Of the run: "goal", the fault that ended it, or what has no name among the faults.
        rounds: The screw was really turned by.
        time: The run lasted [s].
    """

    kind: str
    seed: int
    phase: str
    turning: bool
    start: float
    length: float
    tip_mm: float
    tilt_deg: float
    yaw_deg: float
    tip_mm_during: float
    tilt_deg_during: float
    yaw_deg_during: float
    expected: str
    expected_s: float | None
    named: str
    named_s: float | None
    frames: int
    refused: int
    healthy_s: float | None
    outcome: str
    rounds: int
    time: float


@dataclass
class FaultWatch:
    """Notes at each tick what a fault does to the estimate.

    Attributes:
        span: When the fault lasts.
        time: Of each tick [s].
        error: Its errors [mm, deg, deg].
        lasting: Whether anything named was not over.
        phase: Phase of the gait.
        turning: Whether the tool was being turned.
        named: Time and name of every fault that was named.
        frames: What became of each camera frame that was exposed while the fault lasted.
    """

    span: Span
    time: list[float] = field(default_factory=list)
    error: list[tuple[float, float, float]] = field(default_factory=list)
    lasting: list[bool] = field(default_factory=list)
    phase: list[str] = field(default_factory=list)
    turning: list[bool] = field(default_factory=list)
    named: list[tuple[float, str]] = field(default_factory=list)
    frames: list[str] = field(default_factory=list)

    def see(self, run: Run, tick: Tick, truth: Truth) -> None:
        """One tick."""
        estimate, frame = tick.estimate, tick.measurement.vision
        tip, tilt, yaw = pose_error(estimate.p_WT, estimate.R_WT, truth.p_WT, truth.R_WT)
        self.time.append(tick.measurement.time)
        self.error.append((1e3 * tip, float(np.degrees(tilt)), float(abs(np.degrees(yaw)))))
        self.lasting.append(bool(run.state.watch.lasting))
        self.phase.append(str(tick.goal.phase))
        self.turning.append(tick.goal.turn_rate != 0.0)
        self.named += [(fault.time, str(fault.kind)) for fault in tick.faults]
        if frame is not None and self.span.holds(frame.stamp):
            self.frames.append(estimate.frame)

    def healthy(self) -> float | None:
        """Time from the fault's end until nothing was named any more [s]."""
        time, lasting = np.array(self.time), np.array(self.lasting)
        last = self.span.end + AFTER
        troubled = np.flatnonzero(lasting & (time >= self.span.start) & (time < last))
        if not len(troubled):
            return 0.0
        sound = np.flatnonzero(~lasting[troubled[-1] :])
        return max(0.0, float(time[troubled[-1] + sound[0]] - self.span.end)) if len(sound) else None


def fault_event(kind: str, seed: int, watch: FaultWatch, outcome: str, rounds: int) -> FaultEvent:
    """What came of a fault in a run that is over."""
    span, disturbance = watch.span, SENSOR_FAULTS[kind]
    end, time = span.end + AFTER, np.array(watch.time)
    begun = min(int(np.searchsorted(time, span.start)), len(time) - 1)
    worst, during = _worst(watch, span.start, end), _worst(watch, span.start, span.end)
    named = [(at, name) for at, name in watch.named if span.start <= at < end]
    expected = "" if disturbance.expected is None else str(disturbance.expected)
    return FaultEvent(
        kind=kind,
        seed=seed,
        phase=watch.phase[begun],
        turning=watch.turning[begun],
        start=span.start,
        length=span.end - span.start,
        tip_mm=worst[0],
        tilt_deg=worst[1],
        yaw_deg=worst[2],
        tip_mm_during=during[0],
        tilt_deg_during=during[1],
        yaw_deg_during=during[2],
        expected=expected,
        expected_s=next((at - span.start for at, name in named if name == expected), None),
        named=" ".join(dict.fromkeys(name for _, name in named)),
        named_s=named[0][0] - span.start if named else None,
        frames=len(watch.frames) if disturbance.refusable else 0,
        refused=watch.frames.count("refused") if disturbance.refusable else 0,
        healthy_s=watch.healthy() if watch.time[-1] >= end else None,
        outcome=outcome,
        rounds=rounds,
        time=watch.time[-1],
    )


def _worst(watch: FaultWatch, start: float, end: float) -> tuple[float, float, float]:
    """Largest errors in a stretch of time; not a number where the run did not get there."""
    time = np.array(watch.time)
    rows = np.array(watch.error)[(time >= start) & (time < end)]
    if not len(rows):
        return np.nan, np.nan, np.nan
    tip, tilt, yaw = rows.max(axis=0)
    return float(tip), float(tilt), float(yaw)
