"""The circle: sense, estimate, watch, decide, control, actuate, plant, once a tick."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from turnscrew.actuate.position import DRIVEN_INDEX
from turnscrew.control.controller import ControllerState
from turnscrew.decide.gait import GaitState
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.robot.joints import JOINTS
from turnscrew.sense.sensors import SensorState
from turnscrew.signals import Command, Effort, Estimate, Fault, Goal, Measurement
from turnscrew.task.watch import Watch, WatchState
from turnscrew.task.wiring import Blocks

STILL = np.zeros(len(JOINTS))


@dataclass(frozen=True, slots=True)
class LoopState:
    """States of all blocks between two ticks; and `sent` (28,), the motion that the joints were told to make [rad]."""

    sensors: SensorState
    estimator: EstimatorState
    watch: WatchState
    gait: GaitState
    controller: ControllerState
    adapter: Array
    sent: Array


@dataclass(frozen=True, slots=True)
class Tick:
    """What passed between the rooms in one tick."""

    measurement: Measurement
    estimate: Estimate
    faults: tuple[Fault, ...]
    goal: Goal
    effort: Effort
    command: Command


@dataclass(frozen=True)
class Loop:
    """Blocks, closed over a plant.

    Attributes:
        blocks: Sensing to actuation.
        watch: Names trouble.
        dt: Period of the tick [s].
    """

    blocks: Blocks
    watch: Watch
    dt: float

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
            gait=self.blocks.gait.init(),
            controller=self.blocks.controller.init(estimate),
            adapter=self.blocks.adapter.init(estimate.q + estimate.offset),
            sent=STILL,
        )

    def tick(self, state: LoopState, plant: Cell) -> tuple[LoopState, Tick]:
        """One turn of the loop, up to the command that is written to the plant."""
        blocks, dt = self.blocks, self.dt
        sensors, measurement = self._sense(state.sensors, plant)
        estimator, estimate = blocks.estimator.update(state.estimator, measurement, state.sent, dt)
        gait, goal = blocks.gait.update(state.gait, estimate, dt)
        watch, faults = self.watch.update(state.watch, measurement, estimate, goal, dt)
        controller, effort = blocks.controller.update(state.controller, goal, estimate, dt)
        adapter, command = blocks.adapter.update(state.adapter, goal, effort, estimate, dt)
        # the servos close their loops on the encoders, whose zeros are off by what only the plant knows
        plant.write(command.q - sensors.encoders.offset[DRIVEN_INDEX])
        following = LoopState(sensors, estimator, watch, gait, controller, adapter, command.motion)
        return following, Tick(measurement, estimate, faults, goal, effort, command)

    def _sense(self, state: SensorState, plant: Cell) -> tuple[SensorState, Measurement]:
        return self.blocks.sensors.update(state, plant)
