"""A recorded run as a plant that sensors can read again: other cameras and gauges see the same motion."""

from __future__ import annotations

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.cell import Cell
from turnscrew.plant.log import Log


class Playback:
    """Puts a cell into the states of a log, one after the other.

    The forces are worked out anew at each state, so that sensors read what they would have read then.

    Attributes:
        cell: Shows the state last sought.
    """

    def __init__(self, cell: Cell, log: Log) -> None:
        """Takes the cell over.

        Args:
            cell: Built as the recorded one was, but perhaps with other cameras; its robot, tool and screw must be the
                same.
            log: Of the run.
        """
        self.cell = cell
        self._log = log

    def seek(self, time: float) -> Cell:
        """The cell at the logged step nearest to a time [s]."""
        log, data = self._log, self.cell.data
        row = int(np.clip(np.searchsorted(log.time, time - 1e-9), 0, len(log.time) - 1))
        data.time = float(log.time[row])
        data.qpos[:], data.qvel[:], data.ctrl[:] = log.qpos[row], log.qvel[row], log.ctrl[row]
        data.act[:], data.qacc_warmstart[:] = log.act[row], log.qacc_warmstart[row]
        mujoco.mj_forward(self.cell.model, data)
        return self.cell

    @property
    def times(self) -> Array:
        """(n,) times of the logged steps [s]."""
        return self._log.time
