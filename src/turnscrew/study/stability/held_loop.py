"""The loop of a held tool, linearised: the very code that runs, differenced about where the grasp rests.

The loop's rhythm is a tick's: at its first control period the estimator listens, at all the others only the encoders
are.  So there are two maps of the controller, one of the plant, and a tick is their product.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from turnscrew.actuate.postures import Posture
from turnscrew.actuate.sprung import SprungAdapter
from turnscrew.actuate.torque import TorqueAdapter
from turnscrew.control.controller import ControllerState
from turnscrew.errors import ScenarioError
from turnscrew.estimate.between_ticks import BetweenTicks, JointTrack
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.plant.snapshot import Plant, Snapshot
from turnscrew.signals import Command, Estimate, Goal
from turnscrew.study.stability.linearise import jacobian, pack, smoothed_jacobian, unpack
from turnscrew.study.stability.poles import ControlStep, SampledLoop
from turnscrew.study.stability.tracking import Tracked, Tracking
from turnscrew.task.wiring import Blocks

POSITION_STEP, SPEED_STEP, TORQUE_STEP, STATE_STEP = 3e-6, 3e-4, 1e-3, 1e-6
"""Steps of the differences [m and rad, m/s and rad/s, N.m, SI]: a fiftieth of how deep contacts press, and torques
a hundredth of what holds them.  A third of the first two meets single kinks: of three grasps of one seed it put two
edges 1.7 periods from the measured ones and found one nowhere; these steps are .1, 1.1 and .2 off (found by trial)."""

POINTS = 21
"""About which the plant is differenced.  Found by trial: about the resting state alone, one grasp of four shows a swing
that grows by 20 / s and is not there; about nine points one of eight does, about twenty-one one of twenty."""

TORQUE_ONLY = 'robot.actuation = "position": poles are worked out of a robot that takes torques; set "torque"'


@dataclass(frozen=True, slots=True)
class Last:
    """What the last tick's estimate has of what changes: (3,) tip, (3,) turn, (5, 3) contacts and normals."""

    p_WT: Array
    turn: Array
    c_W: Array
    n_W: Array


@dataclass(frozen=True, slots=True)
class HeldState:
    """What is remembered from period to period: joints, controller, postures, and of the estimator."""

    joints: JointTrack
    controller: ControllerState
    adapter: Posture
    tracked: Tracked
    last: Last


@dataclass(frozen=True)
class HeldLoop:
    """Blocks closed over a plant.

    Attributes:
        plant: The plant.
        blocks: As the loop has them.
        goal: What is held to.
        tracking: The estimator.
        period: Between two commands [s].
        steps: Plant steps in a period.
        beats: Periods in a tick.
    """

    plant: Plant
    blocks: Blocks
    goal: Goal
    tracking: Tracking
    period: float
    steps: int
    beats: int

    def init(self, joints: JointTrack, controller: ControllerState, adapter: Posture) -> HeldState:
        """The state at rest."""
        known = self.tracking.known
        last = Last(known.p_WT, np.zeros(3), known.c_W, known.n_W)
        return HeldState(joints, controller, adapter, self.tracking.init(), last)

    def control(self, state: HeldState, plant: Snapshot, *, tick: bool) -> tuple[HeldState, Array]:
        """One period.

        Args:
            state: Of the last.
            plant: Where the plant is.
            tick: Whether the estimator listens.

        Returns:
            The new state, and the torques (24,) [N.m] that are sent.
        """
        between, adapter, tracked = self._between, self._adapter, state.tracked
        joints = between.read(state.joints, plant.q + self.tracking.known.offset, self.period)
        if tick:
            tracked, estimate = self.tracking.update(tracked, joints.q, joints.v)
            estimate = between.refresh(joints, estimate, 0.0)
        else:
            estimate = between.refresh(joints, self._estimate(state.last), self.period)
        controller, effort = self.blocks.controller.update(state.controller, self.goal, estimate, self.period)
        posture, command = adapter.update(state.adapter, self.goal, effort, estimate, self.period)
        turn = log_so3(estimate.R_WT @ self.tracking.known.R_WT.T)
        last = Last(estimate.p_WT, turn, estimate.c_W, estimate.n_W)
        return HeldState(joints, controller, posture, tracked, last), _torques(command)

    @property
    def _between(self) -> BetweenTicks:
        if self.blocks.between is None:
            raise ScenarioError(TORQUE_ONLY)
        return self.blocks.between

    @property
    def _adapter(self) -> TorqueAdapter:
        if not isinstance(self.blocks.adapter, SprungAdapter):
            raise ScenarioError(TORQUE_ONLY)
        return self.blocks.adapter.seated

    def _estimate(self, last: Last) -> Estimate:
        known = self.tracking.known
        R_WT = exp_so3(last.turn) @ known.R_WT
        return replace(known, p_WT=last.p_WT, R_WT=R_WT, c_W=last.c_W, n_W=last.n_W)

    def linearised(self, state: HeldState, plant: Snapshot) -> SampledLoop:
        """Both halves of the loop at a state that it rests in, without the joints' dry friction: see `DryFriction`."""
        _, torques = self.control(state, plant, tick=True)
        n, m = len(self._moves()), len(torques)
        with self.plant.converged(), self.plant.without_dry_friction():
            after = self._stepped(plant, torques)

            def step(d: Array) -> Array:
                return self.plant.difference(after, self._stepped(self.plant.moved(plant, d[:n]), torques + d[n:]))

            steps = np.concatenate([self._moves(), np.full(m, TORQUE_STEP)])
            J = smoothed_jacobian(step, steps, POINTS, np.random.default_rng(0))
        A, B = J[:, :n], J[:, n:]
        return SampledLoop(A, B, self.controls(state, plant), self.period)

    def controls(self, state: HeldState, plant: Snapshot) -> tuple[ControlStep, ...]:
        """The controller's part alone, one step for each period of a tick: what changes with the gains."""
        return (self._controls(state, plant, tick=True), *[self._controls(state, plant, tick=False)] * (self.beats - 1))

    def _controls(self, state: HeldState, plant: Snapshot, *, tick: bool) -> ControlStep:
        numbers, moves = pack(state), self._moves()
        k, n = len(numbers), len(moves)

        def step(d: Array) -> Array:
            moved = self.plant.moved(plant, d[:n])
            following, tau = self.control(unpack(state, numbers + d[n:]), moved, tick=tick)
            return np.concatenate([pack(following), tau])

        J = jacobian(step, np.concatenate([moves, np.full(k, STATE_STEP)]))
        return ControlStep(J[:k, n:], J[:k, :n], J[k:, n:], J[k:, :n])

    def _moves(self) -> Array:
        nv = self.plant.freedoms
        return np.repeat([POSITION_STEP, SPEED_STEP, POSITION_STEP], [nv, nv, 1])

    def _stepped(self, plant: Snapshot, torques: Array) -> Snapshot:
        self.plant.put(plant)
        return self.plant.steps(torques, self.steps)


def _torques(command: Command) -> Array:
    if command.tau is None:
        raise ScenarioError(TORQUE_ONLY)
    return command.tau
