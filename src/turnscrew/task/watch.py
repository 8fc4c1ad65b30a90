"""Trouble, named as a value: the watch over measurement and estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.euler import tilt
from turnscrew.signals import Estimate, Fault, FaultKind, Goal, Measurement, Role


@dataclass(frozen=True, slots=True)
class WatchState:
    """What the watch remembers.

    Attributes:
        phase: Phase at the last tick.
        in_phase: Time in it [s].
        unheld: Time with fewer than two fingertips in contact [s].
        unseen: Time since the last camera frame [s].
        round: Rounds at the last tick.
        theta: Screw angle when the last round ended [rad].
    """

    phase: str
    in_phase: float
    unheld: float
    unseen: float
    round: int
    theta: float


@dataclass(frozen=True)
class Watch:
    """Thresholds, all on what the robot can know.

    Attributes:
        time_limit: Of the run [s].
        longest_phase: A phase that lasts longer is stuck [s]: feeling for the handle takes .3 s, rolling 1 s at nominal
            speed; this is several times the longest.
        unheld: Longest time with fewer than two fingertips in contact [s]: a free tool tilts by 1 deg in .1 s.
        dropped: Tilt from which on the tool counts as lost [rad]: no grasp of the plan reaches there.
        off_centre: Distance of the tip from the drive that it cannot have inside the slot [m]: half the blade's width
            and a millimetre of the camera's error.
        least_turn: A round that turns the screw by less has failed [rad]: half of what counts as a round's worth.
        unseen: Longest time without a camera frame [s].
    """

    time_limit: float
    longest_phase: float = 8.0
    unheld: float = 0.25
    dropped: float = np.radians(15.0)
    off_centre: float = 0.004
    least_turn: float = np.radians(10.0)
    unseen: float = 2.0

    def init(self) -> WatchState:
        """Nothing seen yet."""
        return WatchState("", 0.0, 0.0, 0.0, 0, 0.0)

    def update(
        self, state: WatchState, measurement: Measurement, estimate: Estimate, goal: Goal, dt: float
    ) -> tuple[WatchState, tuple[Fault, ...]]:
        """One tick: the new state and the faults of this tick, worst first."""
        held = int(estimate.touching.sum()) >= 2
        new_round = goal.round != state.round
        following = WatchState(
            phase=goal.phase,
            in_phase=state.in_phase + dt if goal.phase == state.phase else 0.0,
            unheld=0.0 if held else state.unheld + dt,
            unseen=0.0 if measurement.vision is not None else state.unseen + dt,
            round=goal.round,
            theta=estimate.theta if new_round else state.theta,
        )
        turned = estimate.theta - state.theta
        return following, tuple(self._faults(following, measurement, estimate, goal, turned if new_round else np.inf))

    def _faults(
        self, state: WatchState, measurement: Measurement, estimate: Estimate, goal: Goal, turned: float
    ) -> list[Fault]:
        time, found = measurement.time, list[Fault]()

        def name(kind: FaultKind, evidence: str) -> None:
            found.append(Fault(kind, time, evidence))

        if not (np.isfinite(measurement.q).all() and np.isfinite(estimate.p_WT).all()):
            name(FaultKind.DIVERGED, "a reading or the estimate is not a number")
            return found
        lean = tilt(estimate.R_WT)
        if lean > self.dropped:
            name(FaultKind.TOOL_DROPPED, f"the tool leans by {np.degrees(lean):.1f} deg")
        off = float(np.hypot(*(estimate.p_WT - estimate.p_WS)[:2]))
        if off > self.off_centre:
            name(FaultKind.TIP_SLIP, f"the tip is {off * 1e3:.1f} mm from the drive's centre")
        gripping = int((goal.roles == Role.GRIP).sum())
        if state.unheld > self.unheld and gripping >= 2:
            name(FaultKind.CONTACT_LOST, f"fewer than two fingertips touch since {state.unheld:.2f} s")
        if turned < self.least_turn:
            name(FaultKind.STALLED, f"a round turned the screw by {np.degrees(turned):.1f} deg only")
        if state.in_phase > self.longest_phase:
            name(FaultKind.STALLED, f"phase {state.phase} lasts {state.in_phase:.1f} s")
        if state.unseen > self.unseen:
            name(FaultKind.VISION_LOST, f"no camera frame for {state.unseen:.1f} s")
        if time > self.time_limit:
            name(FaultKind.TIMEOUT, f"{time:.0f} s have passed")
        return found
