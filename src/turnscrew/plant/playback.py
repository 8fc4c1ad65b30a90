"""A recorded run as a plant that sensors can read again: other cameras and gauges see the same motion."""

from __future__ import annotations

import mujoco
import numpy as np

from turnscrew.plant.cell import Cell
from turnscrew.plant.log import Log
from turnscrew.robot.joints import DRIVEN


class Playback:
    """Takes a cell through the states of a log.

    From one logged state to the next that is asked for, the cell is stepped with the logged controls, so that forces
    are what they were; each stretch begins at the log, so that nothing can drift apart.

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
        self._row = 0
        self._restore(0)
        # the first reading comes before the first command
        cell.data.ctrl[:] = 0.0
        mujoco.mj_forward(cell.model, cell.data)

    def seek(self, time: float) -> Cell:
        """The cell at the logged step nearest to a time [s], which must not lie before the last one asked for."""
        log, data = self._log, self.cell.data
        row = int(np.clip(np.searchsorted(log.time, time - 1e-9), 0, len(log.time) - 1))
        if row > self._row:
            self._restore(self._row)
            self.cell.write(log.ctrl[self._row, : len(DRIVEN)])
        for step in range(self._row, row):
            data.ctrl[:] = log.ctrl[step]
            self.cell.step()
        self._row = row
        return self.cell

    def _restore(self, row: int) -> None:
        log, data = self._log, self.cell.data
        data.time = float(log.time[row])
        data.qpos[:], data.qvel[:], data.ctrl[:] = log.qpos[row], log.qvel[row], log.ctrl[row]
        data.act[:], data.qacc_warmstart[:] = log.act[row], log.qacc_warmstart[row]
