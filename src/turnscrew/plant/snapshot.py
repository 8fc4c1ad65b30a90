"""The plant's state as a value: taken, put back, and moved along its tangent space."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.robot.joints import JOINTS

WHOLE = mujoco.mjtState.mjSTATE_INTEGRATION
"""All that the next step depends on: positions, speeds, controls, and the contact solver's warm start."""


ITERATIONS = 50
"""Of Newton's method on contacts, which is done in five to ten."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A state of the plant.

    Attributes:
        qpos: (nq,) positions, orientations as quaternions [m, rad].
        qvel: (nv,) speeds [m/s, rad/s].
        twist: Of the thread's stick [rad].
        whole: The simulator's whole state, in which the above are put when it is restored.
    """

    qpos: Array
    qvel: Array
    twist: float
    whole: Array

    @property
    def q(self) -> Array:
        """Joint angles (28,) [rad]."""
        return self.qpos[: len(JOINTS)]


class Plant:
    """A cell whose state is taken and put back.

    Coordinates of a deviation from a state are (2 nv + 1,): of the positions in tangent space, as MuJoCo's `qvel` is,
    of the speeds, and of the thread's twist.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell, self._model, self._data = cell, cell.model, cell.data
        self._tool = int(self._model.joint(self._model.body("tool").jntadr[0]).qposadr[0])
        self._hinge = int(self._model.joint("screw").qposadr[0])

    @property
    def freedoms(self) -> int:
        """Degrees of freedom nv."""
        return int(self._model.nv)

    def take(self) -> Snapshot:
        """The present state."""
        whole = np.empty(mujoco.mj_stateSize(self._model, WHOLE))
        mujoco.mj_getState(self._model, self._data, whole, WHOLE)
        return Snapshot(self._data.qpos.copy(), self._data.qvel.copy(), self._cell.twist, whole)

    def put(self, state: Snapshot) -> None:
        """Puts a state back; the next steps are those that followed it, to the last bit."""
        mujoco.mj_setState(self._model, self._data, state.whole, WHOLE)
        self._data.qpos[:], self._data.qvel[:] = state.qpos, state.qvel
        self._cell.twist = state.twist
        self._cell.forget()
        for warning in self._data.warning:
            warning.number = 0

    def look(self) -> None:
        """Works out contacts and poses of the present state, for the sensors: after `put` they are another state's."""
        mujoco.mj_forward(self._model, self._data)
        self._cell.forget()

    @contextmanager
    def converged(self) -> Iterator[None]:
        """While it lasts, the contact solver runs to the end: for differences of states that are a micrometre apart.

        As it runs otherwise it stops when nothing that matters changes any more, and where it stops depends on where it
        began: by enough to drown a difference.
        """
        option = self._model.opt
        before = option.tolerance, option.iterations, option.noslip_tolerance
        option.tolerance, option.iterations, option.noslip_tolerance = 0.0, ITERATIONS, 0.0
        try:
            yield
        finally:
            option.tolerance, option.iterations, option.noslip_tolerance = before

    @property
    def dry_friction(self) -> Array:
        """Dry friction (28,) of the joints [N.m]."""
        return np.array(self._model.dof_frictionloss[: len(JOINTS)])

    @contextmanager
    def without_dry_friction(self) -> Iterator[None]:
        """While it lasts, the joints have no dry friction: it jumps where a speed changes sign, and has no slope."""
        before = self._model.dof_frictionloss.copy()
        self._model.dof_frictionloss[:] = 0.0
        try:
            yield
        finally:
            self._model.dof_frictionloss[:] = before

    def steps(self, torques: Array, count: int) -> Snapshot:
        """Steps on with torques (24,) [N.m] on the drives; returns the state after."""
        self._cell.write(torques)
        self.go_on(count)
        return self.take()

    def go_on(self, count: int) -> None:
        """Steps on with the torques that are written."""
        for _ in range(count):
            self._cell.prepare()
            self._cell.step()

    def moved(self, state: Snapshot, by: Array) -> Snapshot:
        """A state moved by coordinates (2 nv + 1,)."""
        nv, qpos = self.freedoms, state.qpos.copy()
        mujoco.mj_integratePos(self._model, qpos, by[:nv], 1.0)
        return replace(state, qpos=qpos, qvel=state.qvel + by[nv : 2 * nv], twist=state.twist + float(by[-1]))

    def difference(self, state: Snapshot, other: Snapshot) -> Array:
        """Coordinates (2 nv + 1,) that move one state to the other."""
        tangent = np.empty(self.freedoms)
        mujoco.mj_differentiatePos(self._model, tangent, 1.0, state.qpos, other.qpos)
        return np.concatenate([tangent, other.qvel - state.qvel, [other.twist - state.twist]])

    def tool_pose(self, state: Snapshot) -> tuple[Array, Array]:
        """p_WT (3,) [m] and R_WT (3, 3) in a state."""
        place, R = state.qpos[self._tool : self._tool + 7], np.empty(9)
        mujoco.mju_quat2Mat(R, place[3:])
        return place[:3].copy(), R.reshape(3, 3)

    def turned(self, state: Snapshot) -> float:
        """Angle by which the screw has been turned in, in a state [rad]."""
        return -float(state.qpos[self._hinge])
