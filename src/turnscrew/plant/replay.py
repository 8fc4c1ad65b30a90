"""Replay: a run simulated again from its model, first state and controls alone, and compared with its log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from turnscrew.errors import RecordError
from turnscrew.plant.log import MODEL, Log, read_log

TOLERANCE = 1e-9
"""Largest deviation that counts as the same run: m, rad, m/s, rad/s.  On the machine that made the record it is 0."""


@dataclass(frozen=True, slots=True)
class Replay:
    """How far a replay strays from its log.

    Attributes:
        steps: Steps that were simulated again.
        qpos: Largest deviation of a position [m, rad].
        qvel: Largest deviation of a velocity [m/s, rad/s].
        step: First step at which it was largest.
    """

    steps: int
    qpos: float
    qvel: float
    step: int

    @property
    def deviation(self) -> float:
        """The larger of both."""
        return max(self.qpos, self.qvel)

    @property
    def agrees(self) -> bool:
        """Whether the replay is the same run."""
        return self.deviation <= TOLERANCE


def load_model(folder: Path) -> mujoco.MjModel:
    """The model of a run's folder.

    Raises:
        RecordError: It is missing or MuJoCo cannot load it.
    """
    path = folder / MODEL
    if not path.is_file():
        raise RecordError(f"{folder}: holds no run: {MODEL} is missing")
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise RecordError(f"{path}: MuJoCo cannot load it: {' '.join(str(error).split())}") from None


def replay(folder: Path) -> Replay:
    """Steps a record's model through its controls with plain `mj_step` and compares every state.

    Raises:
        RecordError: The folder holds no record, or model and log do not belong together.
    """
    log = read_log(folder)
    model = load_model(folder)
    sizes = (log.qpos.shape[1], log.qvel.shape[1], log.ctrl.shape[1], log.act.shape[1])
    if sizes != (model.nq, model.nv, model.nu, model.na):
        raise RecordError(f"{folder}: its model and its log do not belong together: their sizes differ")
    return _compare(model, log)


def _compare(model: mujoco.MjModel, log: Log) -> Replay:
    data = mujoco.MjData(model)
    data.time = log.time[0]
    data.qpos[:], data.qvel[:], data.act[:] = log.qpos[0], log.qvel[0], log.act[0]
    data.qacc_warmstart[:] = log.qacc_warmstart[0]
    steps = len(log.time) - 1
    deviation = np.zeros((steps + 1, 2))
    for step in range(steps):
        data.ctrl[:] = log.ctrl[step]
        mujoco.mj_step(model, data)
        deviation[step + 1] = _distance(data.qpos, log.qpos[step + 1]), _distance(data.qvel, log.qvel[step + 1])
    worst = np.max(deviation, axis=1)
    return Replay(steps, float(deviation[:, 0].max()), float(deviation[:, 1].max()), int(np.argmax(worst)))


def _distance(mine: np.ndarray, logged: np.ndarray) -> float:
    """Largest difference; what is not a number on one side only is infinitely far."""
    difference = np.abs(mine - logged)
    if np.isnan(difference).any():
        difference[np.isnan(mine) & np.isnan(logged)] = 0.0
        difference[np.isnan(difference)] = np.inf
    return float(difference.max(initial=0.0))
