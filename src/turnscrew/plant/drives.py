"""The cell's drives: what they are told, what they give, and what they do when they hear nothing."""

from __future__ import annotations

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import DRIVEN
from turnscrew.robot.watchdog import holding

ROWS = slice(0, len(DRIVEN))


class Drives:
    """Drives of the joints in the order of `DRIVEN`: position servos, or motors with a watchdog.

    Attributes:
        hears: Whether commands arrive.
    """

    def __init__(self, data: mujoco.MjData, patience: int | None) -> None:
        """Drives that have been told nothing yet.

        Args:
            data: MuJoCo's state.
            patience: Steps without a command after which each holds its joint; None: it goes on as it was told.
        """
        # views of MuJoCo's memory, which every step looks at
        self._ctrl, self._given = data.ctrl[ROWS], data.actuator_force[ROWS]
        self._qpos, self._qvel = data.qpos, data.qvel
        self._sum, self._steps = np.zeros(len(DRIVEN)), 0
        self._patience, self._silent = patience, 0
        self._told, self._stop = np.zeros(len(DRIVEN)), np.zeros(len(DRIVEN))
        self.hears = True

    def write(self, command: Array) -> None:
        """Sends commands (24,): positions [rad] to servos, torques [N.m] to motors."""
        if self.hears:
            self._ctrl[:] = command
            self._told, self._silent = self._ctrl.copy(), 0
        self._sum[:] = 0.0
        self._steps = 0

    def prepare(self) -> None:
        """To be called before each step: drives that have waited long enough hold their joints."""
        if self._patience is not None and self._silent >= self._patience:
            q, v = self._qpos[DRIVEN_INDEX], self._qvel[DRIVEN_INDEX]
            if self._silent == self._patience:
                self._stop = q
            self._ctrl[:] = holding(self._told, self._stop - q, v)
        self._silent += 1

    def note(self) -> None:
        """To be called after each step."""
        self._sum += self._given
        self._steps += 1

    def torques(self) -> Array:
        """Mean torque (24,) of each drive since a command was sent last [N.m].

        Commands come in steps, and the servos answer with a jump that decays within a tick, which a gauge read once a
        tick would take for the whole.
        """
        return self._sum / max(self._steps, 1)
