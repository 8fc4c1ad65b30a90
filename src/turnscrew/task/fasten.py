"""One run: a scenario in, a screw turned, a record and a summary out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from turnscrew.geometry.euler import tilt
from turnscrew.geometry.rotations import exp_so3
from turnscrew.plant.cell import Cell
from turnscrew.plant.truth import Truth
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Fault, FaultKind
from turnscrew.task.judge import Judge
from turnscrew.task.line import Line
from turnscrew.task.loop import Loop, LoopState, Tick
from turnscrew.task.record import Recorder
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.start import draw_start, plan_of
from turnscrew.task.summary import FaultEntry, Progress, RecoveryEntry, Summary, versions
from turnscrew.task.watch import Watch
from turnscrew.task.wiring import Blocks, build_blocks, build_cell, generators

PROGRESS_PERIOD = 0.1
"""Simulated time between two calls of a run's progress callback [s]."""

FEELING = 2.1
"""How many times longer than expected fingers may feel for the handle: the longest of 80 hand-overs took 1.4 times as
long with positions at twice the usual pace and 1.6 times with torques at 2.5 times, of 300 at usual pace 1.4."""

OnProgress = Callable[[Progress], None]
OnPlanning = Callable[[str], None]
Adapt = Callable[[Blocks], Blocks]


@dataclass
class Run:
    """A run under way: plant, loop and judge.

    Attributes:
        scenario: What is run.
        cell: The plant.
        loop: The loop over it.
        state: The loop's state.
        judge: Statistics from the truth.
    """

    scenario: Scenario
    cell: Cell
    loop: Loop
    state: LoopState
    judge: Judge

    @classmethod
    def begin(cls, scenario: Scenario, on_planning: OnPlanning | None = None, *, adapt: Adapt | None = None) -> Run:
        """Plans, draws the start and wires the loop.

        Args:
            scenario: What to run.
            on_planning: Told in a line what the planner is doing, if there is anything to plan.
            adapt: Given the loop's blocks, returns those that are to run: the place for blocks of one's own.

        Raises:
            PlanError: no plan fits the handle, or the start is out of reach.
            CameraError: the camera's calibration or its markers cannot be used.
            RenderError: pictures are wanted, and this machine cannot draw.
        """
        robot = RobotModel()
        streams = generators(scenario.seed)
        plan = plan_of(scenario, on_planning)
        start = draw_start(scenario, plan, robot, streams["start"])
        cell = build_cell(scenario, start, plan)
        if scenario.vision.source == "rendered":
            # a machine that cannot draw is told of now, not when the run is under way
            cell.picture(0, 0, 16, 16)
        blocks = build_blocks(scenario, plan, robot, start.believed_radius)
        if adapt is not None:
            blocks = adapt(blocks)
        beats = scenario.beats_per_tick
        line = Line(scenario.delay_periods)
        watch = Watch(scenario.goal.time_limit, longest_feel=FEELING * blocks.decider.gait.feeling)
        loop = Loop(blocks, watch, 1.0 / scenario.rate.control, beats, line)
        sensors = blocks.sensors.init(streams["encoders"], streams["force"], streams["camera"])
        believed = exp_so3(np.array([0.0, 0.0, scenario.screw.slot_yaw]))
        state = loop.init(sensors, cell, plan.p_WS, believed)
        return cls(scenario, cell, loop, state, Judge(loop.dt))

    def tick(self) -> tuple[Tick, Truth]:
        """One turn of the loop, judged; the plant does not move yet."""
        truth = self.cell.truth()
        self.state, tick = self.loop.tick(self.state, self.cell)
        self.judge.watch(truth, tick)
        return tick, truth

    def advance(self, before: Callable[[], None]) -> bool:
        """Steps the plant to the next tick, with the beats of control between; tells whether it stayed finite.

        Args:
            before: Called before each step, when the controls are set.
        """
        steps = self.scenario.steps_per_tick
        steps_per_beat = steps // self.scenario.beats_per_tick
        for step in range(steps):
            if step and step % steps_per_beat == 0:
                self.state = self.loop.beat(self.state, self.cell)
            self.cell.prepare()
            before()
            self.cell.step()
            if self.cell.diverged:
                return False
        return True

    def reached_goal(self, tick: Tick) -> bool:
        """Whether all that the scenario's goal names is reached, as far as the robot can know."""
        goal, estimate = self.scenario.goal, tick.estimate
        return (
            (goal.rounds is None or tick.goal.round >= goal.rounds)
            and (goal.angle is None or estimate.theta >= goal.angle)
            and (goal.torque is None or estimate.F_s[5] >= goal.torque)
        )


def fasten(
    scenario: Scenario, out: Path, *, on_progress: OnProgress | None = None, on_planning: OnPlanning | None = None
) -> Summary:
    """Drives the screw until the scenario's goal is reached or a fault ends the run, and records it.

    Args:
        scenario: What to run.
        out: Folder of the record.
        on_progress: Called ten times a simulated second.
        on_planning: Told in a line what the planner is doing, when the handle's gait has to be planned.

    Returns:
        The summary, which is also in the folder.

    Raises:
        PlanError: no plan fits the handle.
        CameraError: the camera's calibration or its markers cannot be used.
        RenderError: pictures are wanted, and this machine cannot draw.
        RecordError: the folder cannot be written.
    """
    with Recorder(out, scenario) as recorder:
        run = Run.begin(scenario, on_planning)
        recorder.model(run.cell.xml)
        began = perf_counter()
        outcome, faults = "interrupted", list[Fault]()
        try:
            outcome = _turn(run, recorder, faults, began, on_progress)
        finally:
            recorder.step(run.cell.data)
            summary = summarise(run, outcome, faults, perf_counter() - began)
            recorder.finish(summary)
            run.cell.close()
    return summary


def _turn(run: Run, recorder: Recorder, faults: list[Fault], began: float, on_progress: OnProgress | None) -> str:
    """Turns the loop until it is over; returns the outcome."""
    due = 0.0
    while True:
        tick, truth = run.tick()
        recorder.tick(run.cell.time, **signals(tick, truth))
        if on_progress is not None and run.cell.time >= due:
            due += PROGRESS_PERIOD
            on_progress(progress(tick, run.cell.time / (perf_counter() - began)))
        faults.extend(tick.faults)
        if tick.over is not None:
            return str(tick.over.kind)
        if run.reached_goal(tick):
            return "goal"
        if not run.advance(lambda: recorder.step(run.cell.data)):
            faults.append(Fault(FaultKind.DIVERGED, run.cell.time, "the simulation met a number that is not finite"))
            return str(FaultKind.DIVERGED)


def signals(tick: Tick, truth: Truth) -> dict[str, object]:
    """What is recorded of a tick: every message that passed between the rooms, and the truth beside them."""
    return {
        "measurement": tick.measurement,
        "estimate": tick.estimate,
        "goal": tick.goal,
        "effort": tick.effort,
        "command": tick.command,
        "truth": truth,
    }


def progress(tick: Tick, real_time_factor: float) -> Progress:
    """What somebody who watches wants to see of a tick."""
    estimate = tick.estimate
    return Progress(
        time=tick.measurement.time,
        phase=tick.goal.phase,
        round=tick.goal.round,
        screw_angle=estimate.theta,
        torque=float(estimate.F_s[5]),
        tip_force=float(estimate.F_s[2]),
        tilt=tilt(estimate.R_WT),
        real_time_factor=real_time_factor,
    )


def summarise(run: Run, outcome: str, faults: list[Fault], wall_time: float) -> Summary:
    """The summary of a run that has ended."""
    judge, truth, time = run.judge, run.cell.truth(), run.cell.time
    return Summary(
        outcome=outcome,
        rounds=judge.rounds,
        turned_deg=float(np.degrees(truth.theta)),
        advance_mm=truth.advance * 1e3,
        final_torque_nm=truth.thread_torque,
        max_tilt_deg=float(np.degrees(judge.max_tilt)),
        tip_slip_mm=judge.tip_slip * 1e3,
        finger_slip_mm=judge.finger_slip * 1e3,
        sim_time_s=time,
        wall_time_s=wall_time,
        real_time_factor=time / wall_time,
        pose_error=judge.pose_error(),
        wrench_error=judge.wrench_error(),
        force_error=judge.force_error(),
        support_fraction=judge.support_fraction,
        faults=[FaultEntry(kind=str(f.kind), time_s=f.time, evidence=f.evidence) for f in faults],
        recoveries=[
            RecoveryEntry(fault=str(done.kind), time_s=done.time, action=str(done.action))
            for done in run.state.decider.made
        ],
        seed=run.scenario.seed,
        versions=versions(),
    )
