"""What is known anew between two ticks of the estimator: joints and speeds, and how the fingers turn the tool.

Torques are worked out several times in a tick.  Pose, contacts and wrench change little meanwhile, and are taken from
the last tick; joint angles and speeds come from the encoders at the faster pace, and so does the tool's rate.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import ARM, JOINTS
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate

EYE = np.eye(3)


@dataclass(frozen=True, slots=True)
class JointTrack:
    """Smoothed encoder angles q (28,) [rad] and speeds v (28,) [rad/s]."""

    q: Array
    v: Array


@dataclass(frozen=True)
class BetweenTicks:
    """A critically damped g-h filter of all joints, and the tool's rate from the fingers that hold it.

    With a = exp(-dt / time) and the innovation e = reading - (q + v dt): q += v dt + (1 - a^2) e,
    v += (1 - a)^2 e / dt.  It does not lag at constant speed, and tells a speed two time constants late.

    Attributes:
        robot: Kinematics.
        pitch: Of the thread [m].
        time: Time constant [s]: at 500 Hz, 10 ms leave half of the encoders' noise in q, and in v .05 deg / 10 ms times
            .3, 1.5 deg/s; the 20 ms by which v is late are .2 rad at the 10 rad/s of the arm's loop.
        prior: Weight of "it does not turn" against a contact's speed [m2]: (2 mm)^2 beside levers of 18 mm and more.
        arm_time: Time constant of the arm's joints [s], whose noise is a metre from the fingertips.
    """

    robot: RobotModel
    pitch: float
    time: float = 0.010
    prior: float = 4e-6
    arm_time: float = 0.030
    _times: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        times = np.where(np.arange(len(JOINTS)) < len(ARM), self.arm_time, self.time)
        object.__setattr__(self, "_times", times)

    def init(self, q: Array) -> JointTrack:
        """At rest at encoder angles q (28,)."""
        return JointTrack(q, np.zeros(len(q)))

    def read(self, state: JointTrack, reading: Array, dt: float) -> JointTrack:
        """Takes a reading: encoder angles (28,) [rad], dt [s] after the last."""
        keep = np.exp(-dt / self._times)
        predicted = state.q + dt * state.v
        # a reading that is no number is taken for what was expected
        error = np.where(np.isfinite(reading), reading - predicted, 0.0)
        return JointTrack(predicted + (1.0 - keep * keep) * error, state.v + (1.0 - keep) ** 2 / dt * error)

    def refresh(self, state: JointTrack, estimate: Estimate, ahead: float) -> Estimate:
        """Brings an estimate up to the joints' last reading.

        Args:
            state: Of the joints.
            estimate: The last there is.
            ahead: Its age [s]: the tool is turned on by so much.
        """
        q, v = state.q - estimate.offset, state.v
        omega_W = self._rate(q, v, estimate)
        R_WT = exp_so3(omega_W * ahead) @ estimate.R_WT if ahead else estimate.R_WT
        omega_T = R_WT.T @ omega_W
        nu = np.array([0.0, 0.0, self.pitch / (2 * np.pi) * omega_T[2], *omega_T])
        return replace(estimate, q=q, v=v, nu=nu, R_WT=R_WT)

    def _rate(self, q: Array, v: Array, estimate: Estimate) -> Array:
        """Angular velocity (3,) of the tool in W that fits the gripping fingertips' speeds best, its tip at rest."""
        rows = np.flatnonzero(estimate.touching)
        if len(rows) < 2:
            return np.zeros(3)
        V = self.robot.contact_jacobians(q, v, estimate.c_W)[rows] @ v[DRIVEN_INDEX]
        r = estimate.c_W[rows] - estimate.p_WT
        L, S = r.T @ r, r.T @ V
        A = (L[0, 0] + L[1, 1] + L[2, 2] + self.prior) * EYE - L
        b = np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])
        return np.asarray(np.linalg.solve(A, b))
