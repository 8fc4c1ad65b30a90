"""One trial: a run without a record, and what is to be known of it."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field, replace
from zlib import crc32

import numpy as np

from turnscrew.errors import PlanError
from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.plant.truth import Truth
from turnscrew.signals import Fault
from turnscrew.study.disturbances.disturbance import Hook, Span, idle
from turnscrew.study.disturbances.mishaps import MISHAPS, MOMENT
from turnscrew.study.disturbed import GOAL, turn
from turnscrew.task.fasten import Adapt, Run, summarise
from turnscrew.task.loop import Tick
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.summary import Summary

NO_START = "no start"
"""The tool as it was drawn is out of the fingers' reach."""

CRASH = "crash"
"""The program itself failed."""


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
        recoveries: What the robot did about trouble, in its order.
    """

    seed: int
    passed: bool
    outcome: str
    phase: str = ""
    round: int = 0
    evidence: str = ""
    warnings: str = ""
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
    recoveries: str = ""


@dataclass
class Notes:
    """What is noted at each tick.

    Attributes:
        cell: The plant.
        limits: (28, 2) the joints' ranges [rad].
        room: Least distance of a joint from its limits so far [rad].
        mishap_s: When something is to happen [s].
        phase: Phase of the gait.
        round: Rounds completed.
        mishap_phase: Phase in which it happened.
        faults: All that was named.
    """

    cell: Cell
    limits: Array
    room: float = math.inf
    mishap_s: float = math.nan
    phase: str = ""
    round: int = 0
    mishap_phase: str = ""
    faults: list[Fault] = field(default_factory=list)

    def see(self, tick: Tick, truth: Truth) -> None:
        """One tick."""
        self.phase, self.round = str(tick.goal.phase), tick.goal.round
        if tick.measurement.time >= self.mishap_s and not self.mishap_phase:
            self.mishap_phase = self.phase
        self.faults.extend(tick.faults)
        q = self.cell.q
        self.room = min(self.room, float(np.minimum(q - self.limits[:, 0], self.limits[:, 1] - q).min()))


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
    notes = Notes(run.cell, run.loop.blocks.adapter.robot.limits)
    with run.cell:
        hook = _prepare(run, mishap, notes) if mishap else idle
        try:
            outcome = turn(run, hook, notes.see)
        except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
            # one trial that meets a bug must not cost hundreds of others; it counts as failed, and tells why
            evidence = f"{type(error).__name__}: {error}"
            return Trial(scenario.seed, False, CRASH, notes.phase, notes.round, evidence, mishap=mishap)
        trial = _told(scenario.seed, outcome, notes, summarise(run, outcome, notes.faults, 1.0))
        return replace(
            trial, joint_room_deg=math.degrees(notes.room), mishap=mishap, mishap_s=notes.mishap_s,
            mishap_phase=notes.mishap_phase,
        )  # fmt: skip


def _prepare(run: Run, mishap: str, notes: Notes) -> Hook:
    """Draws when the mishap happens, the same moment for all kinds, and how; returns the hook that makes it."""
    disturbance = MISHAPS[mishap]
    notes.mishap_s = float(np.random.default_rng(run.scenario.seed).uniform(*MOMENT))
    span = Span(notes.mishap_s, notes.mishap_s + disturbance.length(run.scenario))
    return disturbance.put(run, span, np.random.default_rng([run.scenario.seed, crc32(mishap.encode())]))


def _told(seed: int, outcome: str, notes: Notes, summary: Summary) -> Trial:
    # what ended the run was named last
    ending = [fault.evidence for fault in notes.faults if fault.ends and str(fault.kind) == outcome]
    lived = Counter(str(fault.kind) for fault in notes.faults if not fault.ends)
    pose, rounds, time = summary.pose_error.refined, summary.rounds, summary.sim_time_s
    return Trial(
        seed=seed,
        passed=outcome == GOAL,
        outcome=outcome,
        phase=notes.phase,
        round=notes.round,
        evidence=ending[-1] if ending else "",
        warnings=", ".join(f"{kind} {count}" for kind, count in sorted(lived.items())),
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


def _rms(value: float | None) -> float:
    return math.nan if value is None else value
