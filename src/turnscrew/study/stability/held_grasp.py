"""A grasp that is held: a run stopped somewhere in its gait, where it can be looked at, disturbed and gone on from."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.random import Generator

from turnscrew.control.controller import Controller, ControllerState
from turnscrew.decide.recovery import Decider, DeciderState
from turnscrew.errors import ScenarioError
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.euler import tilt
from turnscrew.plant.snapshot import Plant, Snapshot
from turnscrew.robot.coupling import DRIVEN_INDEX, SELECTION
from turnscrew.robot.joints import ARM
from turnscrew.signals import GRIP, Estimate, Fault, Goal
from turnscrew.study.disturbances.disturbance import idle
from turnscrew.study.stability.dry_friction import DryFriction
from turnscrew.study.stability.held_loop import TORQUE_ONLY, HeldLoop, HeldState
from turnscrew.study.stability.tracking import Tracking
from turnscrew.task.fasten import Run
from turnscrew.task.line import Line
from turnscrew.task.loop import Loop, LoopState
from turnscrew.task.scenario_keys import Scenario

SETTLE = 1.0
"""How long a grasp is held before it counts as resting [s]: three times the slowest of the servo's time constants."""

KICK = 0.3
"""Size of a disturbance: the speed that each of the hand's joints gets, one way or the other [rad/s], a third of a
roll's; a tenth of it in the arm.  Size matters: the joints' dry friction holds small swings that poles show to grow
(`DryFriction`), and large ones make fingertips slide.  A kick is known, so how much it excites a swing is, too."""


@dataclass(frozen=True)
class Holding:
    """In place of the gait: one goal, always."""

    goal: Goal

    def over(self, state: DeciderState) -> Fault | None:
        """Nothing ends it."""
        return None

    def update(
        self, state: DeciderState, estimate: Estimate, faults: Sequence[Fault], dt: float
    ) -> tuple[DeciderState, Goal]:
        """The goal."""
        return state, self.goal


@dataclass(frozen=True, slots=True)
class Reaction:
    """What a held grasp did in some time.

    Attributes:
        speeds: (periods, nv) all speeds after each control period [m/s, rad/s].
        tilt: The largest [rad].
        holding: Fingers that touch at the end.
    """

    speeds: Array
    tilt: float
    holding: int


@dataclass(frozen=True)
class HeldGrasp:
    """A grasp at rest.

    Attributes:
        run: The run that was stopped.
        plant: Its plant.
        snapshot: The plant's state at rest.
        state: The loop's.
        goal: What is held to.
        estimate: The last.
    """

    run: Run
    plant: Plant
    snapshot: Snapshot
    state: LoopState
    goal: Goal
    estimate: Estimate

    @classmethod
    def of(cls, scenario: Scenario, phase: str, angle: float) -> HeldGrasp:
        """Runs a scenario up to a moment and holds the tool from there on.

        Args:
            scenario: A robot that takes torques.
            phase: Phase of the gait.
            angle: How far the first roll has come when phase is "roll" [rad]; other phases are held at their end.

        Raises:
            ScenarioError: the robot takes positions, or a fault comes first.
        """
        if scenario.robot.actuation != "torque":
            raise ScenarioError(TORQUE_ONLY)
        run = Run.begin(scenario)
        goal: Goal | None = None
        while True:
            tick, _ = run.tick()
            if goal is not None and tick.goal.phase != phase:
                break
            goal = tick.goal if tick.goal.phase == phase else goal
            if phase == "roll" and goal is not None and run.state.decider.gait.rolled >= angle:
                break
            if any(fault.ends for fault in tick.faults):
                raise ScenarioError(f"the run ended in {tick.faults[0].kind} before it came to hold in {phase}")
            run.advance(idle)
        goal = replace(goal, turn_rate=0.0, V_palm=np.zeros(6), approach=np.zeros((5, 3)))
        run.loop = replace(run.loop, blocks=replace(run.loop.blocks, decider=cast(Decider, Holding(goal))))
        run.advance(idle)
        for _ in range(round(SETTLE / run.loop.dt)):
            tick, _ = run.tick()
            run.advance(idle)
        plant = Plant(run.cell)
        return cls(run, plant, plant.take(), run.state, goal, tick.estimate)

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.run.loop.dt / self.run.loop.beats

    @property
    def steps(self) -> int:
        """Plant steps in a control period."""
        return self.run.scenario.steps_per_tick // self.run.loop.beats

    @property
    def gripping(self) -> Flags:
        """(5,) which fingers carry the tool."""
        return np.asarray(self.goal.roles == GRIP)

    @property
    def friction(self) -> DryFriction:
        """Of the joints, as the drives feel it: a pair that is coupled rubs in both its joints."""
        return DryFriction(SELECTION.T @ self.plant.dry_friction, self.plant.freedoms + DRIVEN_INDEX)

    def kicked(self, kick: Array) -> Array:
        """Coordinates (2 nv + 1,) in which a kick (24,) of the driven joints moves the plant [rad/s]."""
        nv, by = self.plant.freedoms, np.zeros(2 * self.plant.freedoms + 1)
        by[nv : nv + len(SELECTION)] = SELECTION @ kick
        return by

    def loop(self, gain: float = 1.0) -> tuple[HeldLoop, HeldState]:
        """The loop that is linearised, and its state at rest; the servo's gains multiplied by `gain`."""
        return self._loop(_stiffened(self.run.loop.blocks.controller, gain), gain)

    def placed(self, faster: float) -> tuple[HeldLoop, HeldState]:
        """The same with the servo's natural frequency multiplied, and its gains with it: kp and ki by the square."""
        controller, square = self.run.loop.blocks.controller, faster * faster
        stiffer = _stiffened(controller, square)
        servo = replace(stiffer.servo, kv=controller.servo.kv * faster)
        return self._loop(replace(stiffer, servo=servo), square)

    def _loop(self, controller: Controller, gain: float) -> tuple[HeldLoop, HeldState]:
        state, loop = self.state, self.run.loop
        if state.joints is None:
            raise ScenarioError(TORQUE_ONLY)
        blocks = replace(loop.blocks, controller=controller)
        tracking = Tracking(blocks.estimator, state.estimator, self.estimate, loop.dt)
        held = HeldLoop(self.plant, blocks, self.goal, tracking, self.period, self.steps, loop.beats)
        return held, held.init(state.joints, _integrated(state.controller, gain), state.adapter.posture)

    def react(self, delay: int, kick: Array, seconds: float, gain: float = 1.0) -> Reaction:
        """What the whole loop does from here, estimator and sensors and their noise included.

        Args:
            delay: Of commands [control periods].
            kick: (24,) what is added to the speeds of the driven joints at the start [rad/s].
            seconds: How long.
            gain: Factor on the servo's gains.
        """
        self.plant.put(self.plant.moved(self.snapshot, self.kicked(kick)))
        self.plant.look()
        blocks = self.run.loop.blocks
        loop: Loop = replace(
            self.run.loop, line=Line(delay), blocks=replace(blocks, controller=_stiffened(blocks.controller, gain))
        )
        # the sensors' random streams begin where they stood: two reactions hear the same noise
        state = replace(deepcopy(self.state), under_way=(), controller=_integrated(self.state.controller, gain))
        speeds: list[Array] = []
        lean = 0.0
        for _ in range(round(seconds / loop.dt)):
            for beat in range(loop.beats):
                state = loop.beat(state, self.run.cell) if beat else loop.tick(state, self.run.cell)[0]
                self.plant.go_on(self.steps)
                speeds.append(self.plant.take().qvel)
            lean = max(lean, tilt(self.plant.tool_pose(self.plant.take())[1]))
            if self.run.cell.diverged:
                break
        return Reaction(np.array(speeds), lean, int(self.run.cell.truth().touching.sum()))


def random_kick(rng: Generator) -> Array:
    """Speeds (24,) of the driven joints [rad/s]: `KICK` with random signs."""
    kick: Array = KICK * rng.choice([-1.0, 1.0], size=SELECTION.shape[1])
    kick[: len(ARM)] *= 0.1
    return kick


def _stiffened(controller: Controller, gain: float) -> Controller:
    servo = controller.servo
    # the clamp bounds what the integral gives, not what it has counted
    stiffer = replace(
        servo, kp=gain * servo.kp, kv=gain * servo.kv, ki=gain * servo.ki, integral_limit=servo.integral_limit / gain
    )
    return replace(controller, servo=stiffer)


def _integrated(state: ControllerState, gain: float) -> ControllerState:
    """The servo's integral, so that it gives under other gains what it gave."""
    return replace(state, servo=replace(state.servo, integral=state.servo.integral / gain))
