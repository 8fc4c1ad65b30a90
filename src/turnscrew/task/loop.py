"""The circle: sense, estimate, watch, decide, control, actuate, plant, once a tick."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from turnscrew.control.controller import ControllerState
from turnscrew.decide.recovery import DeciderState
from turnscrew.estimate.between_ticks import JointTrack, TorqueTrack
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.free_tip import HELD, Free
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.plant.cell import Cell
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import DRIVEN, JOINTS
from turnscrew.sense.sensors import SensorState
from turnscrew.signals import GRIP, Command, Effort, Estimate, Fault, FaultKind, Goal, Measurement
from turnscrew.task.line import NO_DELAY, Line, UnderWay
from turnscrew.task.watch import Strain, Watch, WatchState
from turnscrew.task.wiring import Blocks
from turnscrew.values import changed

STILL = np.zeros(len(JOINTS))


@dataclass(frozen=True, slots=True)
class LoopState:
    """States of all blocks between two ticks, and the motion `sent` (28,) that the joints were told to make [rad].

    Of the faults, what the watch has found last is kept, for it is decided on a tick later.

    A robot that takes torques has beats between ticks, and needs for them the joints as read last, the estimate, goal
    and effort that are in force, which drives (24,) a beat has held to their limits, and the torques that the drives
    were sent.  Commands that are under way to the drives are in `under_way`.
    """

    sensors: SensorState
    estimator: EstimatorState
    watch: WatchState
    decider: DeciderState
    controller: ControllerState
    adapter: Any
    sent: Array
    faults: tuple[Fault, ...] = ()
    joints: JointTrack | None = None
    last: tuple[Estimate, Goal, Effort] | None = None
    under_way: UnderWay = ()
    saturated: Flags = field(default_factory=lambda: np.zeros(len(DRIVEN), dtype=bool))
    driven: TorqueTrack | None = None


@dataclass(frozen=True, slots=True)
class Tick:
    """What passed between the rooms in one tick, and the fault that ends the run with it."""

    measurement: Measurement
    estimate: Estimate
    faults: tuple[Fault, ...]
    goal: Goal
    effort: Effort
    command: Command
    over: Fault | None = None


@dataclass(frozen=True)
class Loop:
    """Blocks, closed over a plant.

    Attributes:
        blocks: Sensing to actuation.
        watch: Names trouble.
        dt: Period of the tick [s].
        beats: How often in a tick control and actuation run: more than once for a robot that takes torques.
        line: What commands take to arrive.
    """

    blocks: Blocks
    watch: Watch
    dt: float
    beats: int = 1
    line: Line = NO_DELAY

    def init(self, sensors: SensorState, plant: Cell, p_WT: Array, R_WT: Array) -> LoopState:
        """States before the first tick.

        Args:
            sensors: State of the sensors, their constant errors drawn.
            plant: The plant.
            p_WT: (3,) where the robot believes the tip to be, in W [m].
            R_WT: (3, 3) how it believes the tool to stand.
        """
        # only a look: the first tick reads the very same again, so neither clocks nor random streams may move
        _, measurement = self._sense(deepcopy(sensors), plant)
        estimator = self.blocks.estimator.init(measurement, p_WT, R_WT)
        _, estimate = self.blocks.estimator.update(estimator, measurement, STILL, self.dt)
        return LoopState(
            sensors=sensors,
            estimator=estimator,
            watch=self.watch.init(),
            decider=self.blocks.decider.init(),
            controller=self.blocks.controller.init(estimate),
            adapter=self.blocks.adapter.init(estimate.q + estimate.offset),
            sent=STILL,
            joints=None if self.blocks.between is None else self.blocks.between.init(measurement.q),
        )

    def tick(self, state: LoopState, plant: Cell) -> tuple[LoopState, Tick]:
        """One turn of the loop, up to the command that is written to the plant."""
        blocks, dt, beat = self.blocks, self.dt, self.dt / self.beats
        sensors, measurement = self._sense(state.sensors, plant)
        joints, known, free = state.joints, measurement, _free(state.last)
        if blocks.between is not None and joints is not None:
            joints = blocks.between.read(joints, measurement.q, beat, free.tip)
            tau_sent = None if state.driven is None else state.driven.tau
            known = changed(measurement, q=joints.q, v=joints.v, tau_sent=tau_sent)
        estimator, estimate = blocks.estimator.update(state.estimator, known, state.sent, dt, free)
        if blocks.between is not None and joints is not None:
            estimate = blocks.between.refresh(joints, estimate, 0.0)
        decider, goal = blocks.decider.update(state.decider, estimate, state.faults, dt)
        # while the tip is free, beats leave control alone
        period = dt if goal.tip_free else beat
        controller, effort = blocks.controller.update(state.controller, goal, estimate, period)
        adapter, command = blocks.adapter.update(state.adapter, goal, effort, estimate, beat)
        under_way, driven = self._write(state, plant, command, sensors)
        strain = Strain(effort, state.saturated | command.saturated) if command.tau is not None else None
        watch, faults = self.watch.update(state.watch, measurement, estimate, goal, dt, strain)
        sent = STILL if command.motion is None else command.motion
        following = LoopState(
            sensors, estimator, watch, decider, controller, adapter, sent, faults, joints, (estimate, goal, effort),
            under_way, driven=driven,
        )  # fmt: skip
        begun, over = state.watch.begun(faults), self._over(decider, faults)
        return following, Tick(known, estimate, begun, goal, effort, command, over)

    def _over(self, decider: DeciderState, faults: tuple[Fault, ...]) -> Fault | None:
        """The fault that ends the run now, if one does: nothing can be done with an estimate that is no number."""
        lost = next((fault for fault in faults if fault.kind is FaultKind.DIVERGED), None)
        return lost or self.blocks.decider.over(decider)

    def beat(self, state: LoopState, plant: Cell) -> LoopState:
        """Control and actuation alone, on the tick's goal and what the encoders say since."""
        blocks, dt = self.blocks, self.dt / self.beats
        if blocks.between is None or state.joints is None or state.last is None:
            return state
        estimate, goal, effort = state.last
        sensors, reading = blocks.sensors.joints(state.sensors, plant)
        joints = blocks.between.read(state.joints, reading, dt, goal.tip_free)
        estimate = blocks.between.refresh(joints, estimate, dt)
        controller = state.controller
        if not goal.tip_free:
            # a tool out of its drive is not balanced by forces, but held by springs: these alone see to it meanwhile
            controller, effort = blocks.controller.update(controller, goal, estimate, dt)
        adapter, command = blocks.adapter.update(state.adapter, goal, effort, estimate, dt)
        under_way, driven = self._write(state, plant, command, sensors)
        return LoopState(
            sensors, state.estimator, state.watch, state.decider, controller, adapter, state.sent, state.faults, joints,
            (estimate, goal, effort), under_way, state.saturated | command.saturated, driven,
        )  # fmt: skip

    def _write(
        self, state: LoopState, plant: Cell, command: Command, sensors: SensorState
    ) -> tuple[UnderWay, TorqueTrack | None]:
        """Puts a command on its way and writes the one that arrives.

        Returns:
            What is under way then, and the torques that the drives were sent, that one included.
        """
        values, between = command.tau, self.blocks.between
        if values is None and command.q is not None:
            # the servos close their loops on the encoders, whose zeros are off by what only the plant knows
            values = command.q - sensors.encoders.offset[DRIVEN_INDEX]
        if values is None:
            return state.under_way, state.driven
        under_way, due = self.line.update(state.under_way, values)
        plant.write(due)
        if command.tau is None or between is None:
            return under_way, None
        return under_way, between.sent(state.driven, due, self.dt / self.beats, _free(state.last).tip)

    def _sense(self, state: SensorState, plant: Cell) -> tuple[SensorState, Measurement]:
        return self.blocks.sensors.update(state, plant)


def _free(last: tuple[Estimate, Goal, Effort] | None) -> Free:
    """What the last goal says of the tip."""
    return HELD if last is None else Free(last[1].tip_free, last[1].theta, last[1].tip_moves, last[1].roles == GRIP)
