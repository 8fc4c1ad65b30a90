"""Trouble, named as a value: the watch over measurement and estimate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from math import dist, inf, isfinite, isnan
from typing import NamedTuple

import numpy as np

from turnscrew.decide.gait_state import Phase
from turnscrew.geometry.arrays import Flags
from turnscrew.geometry.euler import tilt
from turnscrew.robot.joints import DRIVEN, FINGERS
from turnscrew.signals import GRIP, Effort, Estimate, Fault, FaultKind, Goal, Measurement, Vision
from turnscrew.values import changed

FEELING = (Phase.ADD, Phase.RETURN, Phase.CATCH)
"""Phases that last until fingers have found the handle."""


READINGS = ("encoders", "joint speeds", "fingertip forces", "strain gauges")


@dataclass(frozen=True, slots=True)
class WatchState:
    """What the watch remembers.

    Attributes:
        phase: Phase at the last tick.
        in_phase: Time in it [s].
        unheld: Time with fewer than two fingertips in contact [s].
        unseen: Time since the last camera frame that gave a pose [s].
        seen: Whether there ever was one.
        refused: Camera frames in a row that were refused as outliers, or held no numbers.
        unread: Time for which a reading has not been a number [s].
        lasting: Trouble that the run lives with and that is not over, named when it began, and since when it has not
            been seen any more [s].
        ending: Trouble with which the run cannot go on as it is, likewise.
        recoveries: How often something had been done about trouble at the last tick.
    """

    phase: str = ""
    in_phase: float = 0.0
    unheld: float = 0.0
    unseen: float = 0.0
    seen: bool = False
    refused: int = 0
    unread: float = 0.0
    lasting: dict[FaultKind, float] = field(default_factory=dict)
    ending: frozenset[FaultKind] = frozenset()
    recoveries: int = 0

    def begun(self, faults: Iterable[Fault]) -> tuple[Fault, ...]:
        """Those of the next tick's faults that are new: trouble that the run lives with is named when it begins."""
        return tuple(fault for fault in faults if fault.kind not in self.ending)


class Strain(NamedTuple):
    """How near the robot is to the end of its strength and of its grip.

    Attributes:
        effort: Of this tick: which drives hold the contact forces back, and what of the wrench is lost.
        saturated: (24,) which drives have been held to their limits since the last tick.
    """

    effort: Effort
    saturated: Flags


@dataclass(frozen=True)
class Watch:
    """Thresholds, all on what the robot can know.

    Attributes:
        time_limit: Of the run [s].
        longest_phase: A phase that lasts longer is stuck [s]: rolling takes 1 s at nominal speed.
        longest_feel: The same for phases in which fingers feel for the handle [s], at usual pace.
        unheld: Longest time with fewer than two fingertips in contact [s]: a free tool tilts by 1 deg in .1 s.
        dropped: Tilt from which on the tool counts as lost [rad]: no grasp of the plan reaches there.
        fallen: The same while its tip is out [rad]: a tool that leans by more lies rather than stands, and twice what
            tools leant by that were brought back.
        off_centre: Distance of the tip from the drive that it cannot have inside the slot [m]: half the blade's width
            and a millimetre of the camera's error.
        vain: Rounds in a row that may fail to turn the screw: a grip that has slid is taken again, firmer.
        unseen: Time without a camera pose after which the camera counts as lost [s]: 15 frames at 30 Hz, more than a
            finger takes to cross the view,
        blind: after which it cannot go on turning [s]: three rounds, of which rolling odometry loses about 1 deg of yaw
            each, within the play of the blade in the slot,
        sightless: and the same before the first pose [s], when the robot has only been told where the tool is.
        refused: Camera frames refused in a row that make the pose suspect: one or two are outliers.
        eased: Time after which trouble that is not seen any more is over [s]: what comes and goes in a stroke is named
            once.
        unread: Longest time without a number from an encoder or force sensor [s]: five ticks.
        slid: Way of a fingertip down the handle from which on it slides [m]: the threshold of its detector.
        spare: Force across its normal that a gripping finger must have to spare before friction gives way [N]: half of
            what contact forces are chosen with,
        recovered: and what it must have again before that is over [N].
    """

    time_limit: float
    longest_phase: float = 8.0
    longest_feel: float = 1.2
    unheld: float = 0.25
    dropped: float = np.radians(15.0)
    fallen: float = np.radians(60.0)
    off_centre: float = 0.004
    vain: int = 2
    unseen: float = 0.5
    blind: float = 10.0
    sightless: float = 2.0
    refused: int = 3
    eased: float = 0.5
    unread: float = 0.05
    slid: float = 4e-4
    spare: float = 0.5
    recovered: float = 0.8

    def init(self) -> WatchState:
        """Nothing seen yet."""
        return WatchState()

    def update(
        self,
        state: WatchState,
        measurement: Measurement,
        estimate: Estimate,
        goal: Goal,
        dt: float,
        strain: Strain | None = None,
    ) -> tuple[WatchState, tuple[Fault, ...]]:
        """One tick: the new state and the faults of this tick, those that end the run first."""
        held = int(estimate.touching.sum()) >= 2
        frame = measurement.vision
        got = frame is not None and legible(frame)
        refused = estimate.frame == "refused" or (frame is not None and not got)
        following = WatchState(
            phase=goal.phase,
            in_phase=state.in_phase + dt if goal.phase == state.phase and goal.recoveries == state.recoveries else 0.0,
            recoveries=goal.recoveries,
            unheld=0.0 if held else state.unheld + dt,
            unseen=0.0 if got else state.unseen + dt,
            seen=state.seen or got,
            refused=0 if estimate.frame == "taken" else state.refused + refused,
            unread=0.0 if not unread(measurement) else state.unread + dt,
        )
        ending = tuple(
            # a camera that has never seen anything is set up wrongly
            Fault(kind, measurement.time, evidence, hopeless=kind is FaultKind.VISION_LOST and not following.seen)
            for kind, evidence in self._ending(following, measurement, estimate, goal)
        )
        seen = dict(self._lasting(following, measurement, estimate))
        seen.update(self._slipping(estimate, goal, strain, state.lasting.get(FaultKind.FINGER_SLIP) == 0.0))
        seen.update(self._strained(strain))
        begun = tuple(
            Fault(kind, measurement.time, evidence, ends=False)
            for kind, evidence in seen.items()
            if kind not in state.lasting
        )
        gone = {kind: since + dt for kind, since in state.lasting.items() if since + dt < self.eased}
        lasting = gone | dict.fromkeys(seen, 0.0)
        kinds = frozenset(fault.kind for fault in ending)
        return changed(following, lasting=lasting, ending=kinds), ending + begun

    def _ending(
        self, state: WatchState, measurement: Measurement, estimate: Estimate, goal: Goal
    ) -> Iterator[tuple[FaultKind, str]]:
        """Trouble after which the run cannot go on, worst first."""
        # a sum is a number only if all are: a fifth of the time of looking at each
        if not isfinite(estimate.p_WT.sum() + estimate.q.sum()):
            yield FaultKind.DIVERGED, "the estimate is not a number"
            return
        if state.unread > self.unread:
            yield FaultKind.DIVERGED, f"no number from {unread(measurement)} for {state.unread:.2f} s"
        if goal.tip_free:
            yield from self._carrying(state, measurement, estimate)
            return
        if estimate.tip_out >= 1.0:
            away = float(np.linalg.norm(estimate.p_WT_seen - estimate.p_WS))
            yield FaultKind.CAM_OUT, f"the tip has left its drive: the last frame has it {away * 1e3:.0f} mm away"
        lean = tilt(estimate.R_WT)
        if lean > self.dropped:
            yield FaultKind.TOOL_DROPPED, f"the tool leans by {np.degrees(lean):.1f} deg"
        off = dist(estimate.p_WT[:2].tolist(), estimate.p_WS[:2].tolist())
        if off > self.off_centre:
            yield FaultKind.TIP_SLIP, f"the tip is {off * 1e3:.1f} mm from the drive's centre"
        if state.unheld > self.unheld and int((goal.roles == GRIP).sum()) >= 2:
            yield FaultKind.CONTACT_LOST, f"fewer than two fingertips touch since {state.unheld:.2f} s"
        if goal.vain > self.vain:
            yield FaultKind.STALLED, f"{goal.vain} rounds in a row have not turned the screw"
        if state.in_phase > (self.longest_feel if goal.phase in FEELING else self.longest_phase):
            yield FaultKind.STALLED, f"phase {state.phase} lasts {state.in_phase:.1f} s"
        if state.unseen > (self.blind if state.seen else self.sightless):
            since = f"for {state.unseen:.1f} s" if state.seen else "since the start"
            yield FaultKind.VISION_LOST, f"no pose from the camera {since}{_because(measurement.blind)}"
        if measurement.time > self.time_limit:
            yield FaultKind.TIMEOUT, f"{measurement.time:.0f} s have passed"

    def _carrying(
        self, state: WatchState, measurement: Measurement, estimate: Estimate
    ) -> Iterator[tuple[FaultKind, str]]:
        """The same while a tool whose tip is out is brought back: where its tip is counts for nothing then."""
        lean = tilt(estimate.R_WT)
        if lean > self.fallen:
            yield FaultKind.TOOL_DROPPED, f"the tool leans by {np.degrees(lean):.1f} deg"
        elif state.unheld > 4.0 * self.unheld:
            yield FaultKind.TOOL_DROPPED, f"fewer than two fingertips touch since {state.unheld:.2f} s"
        if state.unseen > self.unseen:
            blind = _because(measurement.blind)
            yield FaultKind.VISION_LOST, f"no pose from the camera for {state.unseen:.1f} s{blind}"
        if measurement.time > self.time_limit:
            yield FaultKind.TIMEOUT, f"{measurement.time:.0f} s have passed"

    def _lasting(
        self, state: WatchState, measurement: Measurement, estimate: Estimate
    ) -> Iterator[tuple[FaultKind, str]]:
        """Trouble that the estimator bridges: the contacts and the rolling fingers know the pose for a while."""
        if state.unseen > self.unseen:
            yield (
                FaultKind.VISION_LOST,
                f"no pose from the camera for {state.unseen:.1f} s{_because(measurement.blind)}",
            )
        if state.refused >= self.refused:
            yield (
                FaultKind.POSE_SUSPECT,
                f"{state.refused} camera frames in a row fit no contacts or hold no pose",
            )
        elif state.unread > 0.0:
            yield FaultKind.POSE_SUSPECT, f"no number from {unread(measurement)}"
        if estimate.hung.any():
            fingers = " and ".join(name for name, hung in zip(FINGERS, estimate.hung, strict=True) if hung)
            yield FaultKind.FORCE_SUSPECT, f"the force reading of {fingers} repeats itself"
        if estimate.tip_slip >= 1.0:
            yield FaultKind.TIP_SLIP, f"the tip does not stay where it is: signal {estimate.tip_slip:.1f} of 1"

    def _slipping(
        self, estimate: Estimate, goal: Goal, strain: Strain | None, named: bool
    ) -> Iterator[tuple[FaultKind, str]]:
        """Fingers that slide over the handle, or that will if they have to carry any more."""
        gripping = [row for row, role in enumerate(goal.roles.tolist()) if role == GRIP]
        slid, name = max(((float(estimate.finger_slip[row]), FINGERS[row]) for row in gripping), default=(0.0, ""))
        if slid >= self.slid:
            yield FaultKind.FINGER_SLIP, f"{name} slides: {slid * 1e3:.1f} mm down the handle"
        elif strain is not None:
            # no margin is worked out for a finger that does not grip, and less is asked of one that comes or goes
            whole = [row for row in gripping if goal.share[row] >= 1.0]
            margins = [(float(strain.effort.margin[row]), FINGERS[row]) for row in whole]
            margin, name = min((item for item in margins if not isnan(item[0])), default=(inf, ""))
            if margin < (self.recovered if named else self.spare):
                yield FaultKind.FINGER_SLIP, f"{name} is about to slide: {margin:.1f} N to spare"

    def _strained(self, strain: Strain | None) -> Iterator[tuple[FaultKind, str]]:
        """Drives at the end of their torque: what they cannot give is left out of the wrench, or cut off."""
        if strain is None:
            return
        at_limit = strain.saturated | strain.effort.limited
        if at_limit.any():
            drives = " and ".join(name for name, full in zip(DRIVEN, at_limit, strict=True) if full)
            lost = strain.effort.lost
            yield (
                FaultKind.TORQUE_SATURATED,
                f"{drives} at the limit: {np.sqrt(lost[:3] @ lost[:3]):.1f} N and {abs(lost[5]):.3f} N.m are left out",
            )


def unread(measurement: Measurement) -> str:
    """Which readings are not numbers; nothing when all are."""
    readings = measurement.q, measurement.v, measurement.f_F, measurement.tau
    return " and ".join(
        name for name, value in zip(READINGS, readings, strict=True) if value is not None and not isfinite(value.sum())
    )


def legible(frame: Vision) -> bool:
    """Whether a camera frame holds numbers only."""
    return isfinite(frame.p_WT.sum() + frame.R_WT.sum() + frame.P.sum())


def _because(blind: str) -> str:
    return f": {blind}" if blind else ""
