"""A recorded run, tick by tick, as far as holding and turning the tool goes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from turnscrew.decide.gait_state import Phase
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import GRIP
from turnscrew.task.signal_table import column


@dataclass(frozen=True)
class Trace:
    """What was so at each of n ticks, and what was wanted.

    Attributes:
        time: (n,) [s].
        round: (n,) rounds that the robot has completed.
        theta: (n,) angle that the screw was turned in by [rad].
        tilt: (n,) of the tool's axis from the vertical [rad].
        tip_slip: (n,) distance of the tip from the drive's centre [m].
        tip_error: (n,) force of the screw on the tip along the tool's axis, less the wanted [N].
        rolling: (n,) whether the tool was being turned in a roll.
        touching: (n, 5) which fingertips touched.
        pressed: (n, 5) force of each fingertip against the handle, along its normal [N].
        asked: (n, 5) the same as the robot wanted it; not a number where a finger does not grip.
        sliding: (n, 5, 3) velocity of the handle's surface past each fingertip, in W [m/s].
    """

    time: Array
    round: Array
    theta: Array
    tilt: Array
    tip_slip: Array
    tip_error: Array
    rolling: Flags
    touching: Flags
    pressed: Array
    asked: Array
    sliding: Array

    @classmethod
    def of(cls, columns: Mapping[str, np.ndarray]) -> Trace:
        """From the signals of a run, as `read_signals` gives them.

        Raises:
            RecordError: a signal is missing.
        """
        k = len(FINGERS)
        R, p = column(columns, "truth.R_WT", 3, 3), column(columns, "truth.p_WT", 3)
        touching = column(columns, "truth.touching", k) > 0
        gripping = (column(columns, "goal.roles", k) == GRIP) & (column(columns, "goal.share", k) > 0)
        asked = _against(column(columns, "effort.f_W", k, 3), column(columns, "estimate.n_W", k, 3))
        c = column(columns, "truth.c_W", k, 3)
        return cls(
            time=column(columns, "time"),
            round=column(columns, "goal.round"),
            theta=column(columns, "truth.theta"),
            tilt=np.arctan2(np.hypot(R[:, 0, 2], R[:, 1, 2]), R[:, 2, 2]),
            tip_slip=np.linalg.norm(p - column(columns, "truth.p_WS", 3), axis=1),
            tip_error=column(columns, "truth.F_s", 6)[:, 2] - column(columns, "goal.tip_force"),
            rolling=columns["goal.phase"] == str(Phase.ROLL),
            touching=touching,
            pressed=np.where(touching, _against(column(columns, "truth.f_W", k, 3), _outward(c, p, R[:, :, 2])), 0.0),
            asked=np.where(gripping, asked, np.nan),
            sliding=np.where(touching[:, :, None], _sliding(columns, c, p), 0.0),
        )

    @property
    def dt(self) -> float:
        """Period of the tick [s]."""
        return float(np.median(np.diff(self.time)))


def _against(f_W: Array, n_W: Array) -> Array:
    """(n, 5) forces along inward normals."""
    return np.asarray(-(f_W * n_W).sum(axis=-1))


def _outward(c_W: Array, p_WT: Array, axis: Array) -> Array:
    """(n, 5, 3) outward normals of a cylindrical handle at contacts; not a number where there is none."""
    arm = c_W - p_WT[:, None]
    across = arm - (arm * axis[:, None]).sum(axis=-1, keepdims=True) * axis[:, None]
    return np.asarray(across / np.linalg.norm(across, axis=-1, keepdims=True))


def _sliding(columns: Mapping[str, np.ndarray], c_W: Array, p_WT: Array) -> Array:
    """(n, 5, 3) left less right side of (13)."""
    k = len(FINGERS)
    V, V_F = column(columns, "truth.V_WT", 6)[:, None], column(columns, "truth.V_WF", k, 6)
    tool = V[..., :3] + np.cross(V[..., 3:], c_W - p_WT[:, None])
    finger = V_F[..., :3] + np.cross(V_F[..., 3:], c_W - column(columns, "truth.p_WF", k, 3))
    return np.asarray(tool - finger)
