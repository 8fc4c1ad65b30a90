"""Reading a run's log: state and controls at every plant step, whether or not the run came to its end."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from turnscrew.errors import RecordError
from turnscrew.geometry.arrays import Array

MODEL = Path("model") / "model.xml"
LOG = "log.npz"
SEGMENTS = "segments"
STEP_FIELDS = ("time", "qpos", "qvel", "ctrl", "act", "qacc_warmstart")
"""All that `mj_step` starts from: row i holds the state before step i and the controls during it."""


@dataclass(frozen=True, slots=True)
class Log:
    """One row for each plant step, and a last one for the state after the last step.

    Attributes:
        time: (n,) simulated time [s].
        qpos: (n, nq) positions, as MuJoCo orders them.
        qvel: (n, nv) velocities.
        ctrl: (n, nu) controls in force during the step that starts here.
        act: (n, na) states of the actuators.
        qacc_warmstart: (n, nv) the accelerations that the constraint solver starts from.
    """

    time: Array
    qpos: Array
    qvel: Array
    ctrl: Array
    act: Array
    qacc_warmstart: Array


def segments(folder: Path) -> list[Path]:
    """The pieces of a record that has not been put together, in order of time."""
    return sorted((folder / SEGMENTS).glob("*.npz"))


def read_log(folder: Path) -> Log:
    """The log of a run's folder, from `log.npz` or, where the run was killed, from its segments.

    Raises:
        RecordError: The folder holds no readable log.
    """
    whole = folder / LOG
    pieces = [whole] if whole.is_file() else segments(folder)
    if not pieces:
        raise RecordError(f"{folder}: holds no run: neither {LOG} nor {SEGMENTS}/*.npz is there")
    prefix = "" if whole.is_file() else "log."
    parts: dict[str, list[Array]] = {name: [] for name in STEP_FIELDS}
    for piece in pieces:
        try:
            with np.load(piece) as arrays:
                for name in STEP_FIELDS:
                    parts[name].append(arrays[prefix + name])
        except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise RecordError(f"{piece}: cannot be read as a log: {' '.join(str(error).split())}") from None
    return Log(**{name: np.concatenate(arrays) for name, arrays in parts.items()})
