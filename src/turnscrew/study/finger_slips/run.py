"""One run with fingers that become slick, or with none."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.study.disturbances.disturbance import idle
from turnscrew.study.disturbances.finger_slips import FingerMoment, SlickFingers
from turnscrew.study.disturbed import turn
from turnscrew.study.finger_slips.events import (
    COUNTED,
    FingerAlarm,
    FingerSlipEvent,
    FingerWatch,
    around,
    quiet_alarms,
    slip_event,
)
from turnscrew.task.fasten import Run
from turnscrew.task.scenario_keys import Scenario

REACTS, ONLY_WATCHES, QUIET = "reacts", "only watches", "quiet"
"""Kinds of runs: fingers become slick, and the robot squeezes more or goes on as before; or nothing happens."""

STREAM = 5
"""Of the moments' random numbers, the same for a seed whether the robot reacts or not."""


@dataclass(frozen=True)
class FingerRun:
    """A run that is over.

    Attributes:
        outcome: How it ended.
        rounds: The screw was really turned by.
        time: It lasted [s].
        slid_mm: Farthest that a finger slid while it touched.
        tilt_deg: Largest tilt of the tool.
        slips: Moments in which a finger rubbed less.
        alarms: Of a quiet run.
        signals: (k, m) signal around each slip that counts, against its millimetre, at the ticks of `WINDOW`.
    """

    outcome: str
    rounds: int
    time: float
    slid_mm: float
    tilt_deg: float
    slips: tuple[FingerSlipEvent, ...]
    alarms: tuple[FingerAlarm, ...]
    signals: Array


def slide(scenario: Scenario, kind: str, factor: float) -> FingerRun:
    """Runs a scenario; in a run that is not quiet, one finger's friction is multiplied by `factor` now and then.

    Raises:
        PlanError: no plan fits the handle.
        CameraError: the camera's calibration or its markers cannot be used.
        RenderError: pictures are wanted, and this machine cannot draw.
    """
    run, seed = Run.begin(scenario), scenario.seed
    if kind == ONLY_WATCHES:
        deaf(run)
    watch = FingerWatch(run.loop.blocks.estimator.slips.fingers.threshold)
    made: list[FingerMoment] = []
    with run.cell:
        if kind == QUIET:
            outcome = turn(run, idle, watch.see)
        else:
            slick = SlickFingers(run.cell, np.random.default_rng([seed, STREAM]), factor)
            made = slick.made
            outcome = turn(run, slick.step, watch.see)
    events = tuple(slip_event(moment, kind, seed, watch) for moment in made)
    dt = 1.0 / scenario.rate.control
    counted = [moment for moment, event in zip(made, events, strict=True) if event.verdict in COUNTED]
    return FingerRun(
        outcome=outcome,
        rounds=run.judge.rounds,
        time=watch.time[-1],
        slid_mm=1e3 * run.judge.finger_slip,
        tilt_deg=float(np.degrees(run.judge.max_tilt)),
        slips=events,
        alarms=tuple(quiet_alarms(seed, watch, dt)) if kind == QUIET else (),
        signals=np.array([around(moment, watch, dt) for moment in counted]),
    )


def deaf(run: Run) -> None:
    """Lets the robot trust a finger that slides as much as before."""
    blocks = run.loop.blocks
    slips = blocks.estimator.slips
    trusting = replace(slips, fingers=replace(slips.fingers, lowered=1.0))
    run.loop = replace(run.loop, blocks=replace(blocks, estimator=replace(blocks.estimator, slips=trusting)))
