"""What the drives did in a recorded run: torques and speeds at every step of the plant."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.log import read_log
from turnscrew.plant.replay import load_model
from turnscrew.robot.joints import DRIVEN


@dataclass(frozen=True, slots=True)
class DriveWork:
    """Torques and speeds of the drives in the order of `DRIVEN`, one row a step.

    Attributes:
        dt: Length of a step [s].
        tau: (n, 24) torques [N.m].
        v: (n, 24) speeds of the joints that they drive [rad/s].
    """

    dt: float
    tau: Array
    v: Array

    @property
    def work(self) -> Array:
        """(24,) mechanical work that each drive has put in [J], the integral of max(tau v, 0).

        Gears and tendons give nothing back to the motor, so braking does not count against it.
        """
        return np.asarray(np.maximum(self.tau * self.v, 0.0).sum(axis=0) * self.dt)

    @property
    def heat(self) -> Array:
        """(24,) integral of tau^2 [N2.m2.s]: what each winding heats by, but for its resistance and torque constant."""
        return np.asarray((self.tau * self.tau).sum(axis=0) * self.dt)


def read_drives(folder: Path) -> DriveWork:
    """Torques and speeds of the drives of a run.

    Motors give the torque they are told, servos `kp (q_c - q) - kv v`, both within the drive's limit, as MuJoCo works
    them out at the beginning of a step.

    Args:
        folder: Of the run's record.

    Raises:
        RecordError: the folder holds no readable model or log.
    """
    log, model, drives = read_log(folder), load_model(folder), range(len(DRIVEN))
    joints = model.actuator_trnid[drives, 0]
    q, v = log.qpos[:, model.jnt_qposadr[joints]], log.qvel[:, model.jnt_dofadr[joints]]
    gain, bias = model.actuator_gainprm[drives], model.actuator_biasprm[drives]
    tau = gain[:, 0] * log.ctrl[:, drives] + bias[:, 0] + bias[:, 1] * q + bias[:, 2] * v
    low, high = model.actuator_forcerange[drives].T
    return DriveWork(float(model.opt.timestep), np.clip(tau, low, high)[:-1], v[:-1])
