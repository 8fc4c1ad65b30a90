"""One trial: a run without a record, and what is to be known of it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from zlib import crc32

import numpy as np

from turnscrew.errors import PlanError
from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.plant.truth import Truth
from turnscrew.signals import Fault, FaultKind
from turnscrew.study.disturbances.disturbance import Hook, Span, idle
from turnscrew.study.disturbances.mishaps import MISHAPS, MOMENT
from turnscrew.study.disturbed import GOAL, turn
from turnscrew.study.trials.witness import Witness
from turnscrew.task.fasten import Adapt, Run, summarise
from turnscrew.task.loop import Tick
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.summary import Summary

NO_START = "no start"
"""The tool as it was drawn is out of the fingers' reach."""

CRASH = "crash"
"""The program itself failed."""

NEVER = Span(math.nan, math.nan)

LATEST = 1.0
"""Time after trouble from which on it is not named any more [s]: the slowest, a camera that is missed, takes .5 s."""


@dataclass(frozen=True)
class Trial:
    """What came of a trial; all of it follows from the scenario, nothing from the machine.

    Attributes:
        seed: Of the run.
        passed: Whether the goal was really reached.
        outcome: "goal", the name of the fault that ended it, "goal only believed", "no start" or "crash".
        phase: Phase of the gait at the end.
        round: Rounds that the robot had counted at the end.
        evidence: Of the fault that ended it.
        warnings: Trouble that the run lived with, each kind with how often it was named.
        false_alarms: Trouble that was named and was not there by the truth, likewise; see `Witness`.
        rounds: Rounds by which the screw was really turned.
        turned_deg: Angle by which it was [deg].
        time_s: Simulated time [s].
        deg_a_round: Of the screw [deg]; not a number without a round.
        seconds_a_round: Simulated [s], the first grip included.
        deg_per_s: Mean turning speed over the whole run [deg/s].
        max_tilt_deg: Largest angle of the tool's axis from the screw's [deg].
        tip_slip_mm: Largest distance of the tip from the drive's centre [mm].
        finger_slip_mm: Largest sliding path of a fingertip in one holding phase [mm].
        tip_error_mm: Error of the estimated tip, rms [mm].
        tilt_error_deg: Of the estimated tilt, rms [deg].
        yaw_error_deg: Of the estimated yaw, rms [deg].
        support_fraction: Share of the turning time with at least two fingers in contact.
        joint_room_deg: Least distance of a joint from its limits, negative beyond them [deg].
        mishap: What happened to it on purpose, if anything.
        mishap_s: When [s].
        mishap_phase: Phase of the gait then; empty if the run was over before.
        trouble_s: When it had led to what should be named [s]; not a number where it never did.
        delay_s: Time from then until that was named [s], negative where it was named before.
        named: "named" or "missed"; "nothing" where there was nothing to name, "run over" where the run ended before it
            could be; empty for a mishap without a name.
        recoveries: What the robot did about trouble, in its order.
    """

    seed: int
    passed: bool
    outcome: str
    phase: str = ""
    round: int = 0
    evidence: str = ""
    warnings: str = ""
    false_alarms: str = ""
    rounds: int = 0
    turned_deg: float = math.nan
    time_s: float = math.nan
    deg_a_round: float = math.nan
    seconds_a_round: float = math.nan
    deg_per_s: float = math.nan
    max_tilt_deg: float = math.nan
    tip_slip_mm: float = math.nan
    finger_slip_mm: float = math.nan
    tip_error_mm: float = math.nan
    tilt_error_deg: float = math.nan
    yaw_error_deg: float = math.nan
    support_fraction: float = math.nan
    joint_room_deg: float = math.nan
    mishap: str = ""
    mishap_s: float = math.nan
    mishap_phase: str = ""
    trouble_s: float = math.nan
    delay_s: float = math.nan
    named: str = ""
    recoveries: str = ""


@dataclass
class Notes:
    """What is noted at each tick.

    Attributes:
        cell: The plant.
        limits: (28, 2) the joints' ranges [rad].
        room: Least distance of a joint from its limits so far [rad].
        witness: Of what is true.
        mishap: When something is to happen, and until when.
        expected: What should be named then.
        phase: Phase of the gait.
        round: Rounds completed.
        mishap_phase: Phase in which it happened.
        faults: All that was named.
        false: What of it was not so.
        trouble_s: When the mishap had led to what should be named [s].
    """

    cell: Cell
    limits: Array
    witness: Witness
    room: float = math.inf
    mishap: Span = NEVER
    expected: FaultKind | None = None
    phase: str = ""
    round: int = 0
    mishap_phase: str = ""
    faults: list[Fault] = field(default_factory=list)
    false: list[Fault] = field(default_factory=list)
    trouble_s: float = math.nan

    def see(self, tick: Tick, truth: Truth) -> None:
        """One tick."""
        time = tick.measurement.time
        self.phase, self.round = str(tick.goal.phase), tick.goal.round
        self.witness.see(tick, truth)
        if time >= self.mishap.start:
            self.mishap_phase = self.mishap_phase or self.phase
            if self.expected is not None and math.isnan(self.trouble_s) and time < self.mishap.end + LATEST:
                self.trouble_s = time if self.witness.trouble(self.expected, self.mishap) else math.nan
        self.faults.extend(tick.faults)
        self.false.extend(fault for fault in tick.faults if self.witness.false(fault, tick, truth))
        q = self.cell.q
        self.room = min(self.room, float(np.minimum(q - self.limits[:, 0], self.limits[:, 1] - q).min()))

    def naming(self) -> tuple[str, float]:
        """What became of the mishap's name, and how long after the trouble it was said [s]."""
        if self.expected is None or not self.mishap_phase:
            return "", math.nan
        if math.isnan(self.trouble_s):
            return "nothing", math.nan
        times = [fault.time for fault in self.faults if fault.kind is self.expected]
        said = [time for time in times if self.mishap.start <= time < self.trouble_s + LATEST]
        if said:
            return "named", said[0] - self.trouble_s
        return ("run over" if self.witness.time[-1] < self.trouble_s + LATEST else "missed"), math.nan


def attempt(scenario: Scenario, mishap: str = "", adapt: Adapt | None = None) -> Trial:
    """Runs a trial to its end; whatever goes wrong in it is its outcome.

    Args:
        scenario: What is run.
        mishap: Name of what happens to the robot once, at a moment that the seed tells; nothing without.
        adapt: What is done to the loop's blocks before, if anything.

    Raises:
        CameraError: the camera's calibration or its markers cannot be used.
        RenderError: pictures are wanted, and this machine cannot draw.
    """
    try:
        run = Run.begin(scenario, adapt=adapt)
    except PlanError as error:
        return Trial(scenario.seed, False, NO_START, evidence=str(error), mishap=mishap)
    witness = Witness(run.loop.dt, scenario.contact.finger_friction)
    notes = Notes(run.cell, run.loop.blocks.adapter.robot.limits, witness)
    with run.cell:
        hook = _prepare(run, mishap, notes) if mishap else idle
        try:
            outcome = turn(run, hook, notes.see)
        except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
            # one trial that meets a bug must not cost hundreds of others; it counts as failed, and tells why
            evidence = f"{type(error).__name__}: {error}"
            return Trial(scenario.seed, False, CRASH, notes.phase, notes.round, evidence, mishap=mishap)
        trial = _told(scenario.seed, outcome, notes, summarise(run, outcome, notes.faults, 1.0))
        named, delay = notes.naming()
        return replace(
            trial, joint_room_deg=math.degrees(notes.room), mishap=mishap, mishap_s=notes.mishap.start,
            mishap_phase=notes.mishap_phase, trouble_s=notes.trouble_s, delay_s=delay, named=named,
        )  # fmt: skip


def _prepare(run: Run, mishap: str, notes: Notes) -> Hook:
    """Draws when the mishap happens, the same moment for all kinds, and how; returns the hook that makes it."""
    disturbance = MISHAPS[mishap]
    start = float(np.random.default_rng(run.scenario.seed).uniform(*MOMENT))
    span = Span(start, start + disturbance.length(run.scenario))
    notes.mishap, notes.expected = span, disturbance.expected
    notes.witness.hung = span if disturbance.expected is FaultKind.FORCE_SUSPECT else None
    return disturbance.put(run, span, np.random.default_rng([run.scenario.seed, crc32(mishap.encode())]))


def _told(seed: int, outcome: str, notes: Notes, summary: Summary) -> Trial:
    # what ended the run was named last
    ending = [fault.evidence for fault in notes.faults if fault.ends and str(fault.kind) == outcome]
    pose, rounds, time = summary.pose_error.refined, summary.rounds, summary.sim_time_s
    return Trial(
        seed=seed,
        passed=outcome == GOAL,
        outcome=outcome,
        phase=notes.phase,
        round=notes.round,
        evidence=ending[-1] if ending else "",
        warnings=_counted(fault for fault in notes.faults if not fault.ends),
        false_alarms=_counted(notes.false),
        rounds=rounds,
        turned_deg=summary.turned_deg,
        time_s=time,
        deg_a_round=summary.turned_deg / rounds if rounds else math.nan,
        seconds_a_round=time / rounds if rounds else math.nan,
        deg_per_s=summary.turned_deg / time if time else math.nan,
        max_tilt_deg=summary.max_tilt_deg,
        tip_slip_mm=summary.tip_slip_mm,
        finger_slip_mm=summary.finger_slip_mm,
        tip_error_mm=_rms(pose.position_mm.rms),
        tilt_error_deg=_rms(pose.tilt_deg.rms),
        yaw_error_deg=_rms(pose.yaw_deg.rms),
        support_fraction=summary.support_fraction,
        recoveries=", ".join(f"{entry.action} ({entry.fault})" for entry in summary.recoveries),
    )


def _counted(faults: Iterable[Fault]) -> str:
    counts = Counter(str(fault.kind) for fault in faults)
    return ", ".join(f"{kind} {count}" for kind, count in sorted(counts.items()))


def _rms(value: float | None) -> float:
    return math.nan if value is None else value
