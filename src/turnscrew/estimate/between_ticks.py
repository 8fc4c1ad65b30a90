"""What is known anew between two ticks of the estimator: joints and speeds, and how the fingers turn the tool.

Torques are worked out several times in a tick.  Pose, contacts and wrench change little meanwhile, and are taken from
the last tick; joint angles and speeds come from the encoders at the faster pace, and so does the tool's rate.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, isfinite

import numpy as np

from turnscrew.geometry.arrays import Array, Flags, Rows
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.rotations import exp_so3
from turnscrew.geometry.small import cross, solve_positive
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import ARM, JOINTS
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate
from turnscrew.values import changed


@dataclass(frozen=True, slots=True)
class JointTrack:
    """Smoothed encoder angles q (28,) [rad] and speeds v (28,) [rad/s]."""

    q: Array
    v: Array


@dataclass(frozen=True, slots=True)
class TorqueTrack:
    """Torques (24,) that the drives are sent, low-passed once, and twice: `tau` [N.m]."""

    once: Array
    tau: Array


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
        arm_time: Time constant of the arm's joints [s], whose noise is a metre from the fingertips,
        free_time: and while the tip is out of its drive [s]: the arm's loop is at 25 rad/s then, and needs to know its
            speed no more than 10 ms late; .65 of .005 deg are left, .06 mm at the fingertips.
    """

    robot: RobotModel
    pitch: float
    time: float = 0.010
    prior: float = 4e-6
    arm_time: float = 0.030
    free_time: float = 0.005
    _times: tuple[Array, Array] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        arm = np.arange(len(JOINTS)) < len(ARM)
        times = tuple(np.where(arm, of_arm, self.time) for of_arm in (self.arm_time, self.free_time))
        object.__setattr__(self, "_times", times)

    def init(self, q: Array) -> JointTrack:
        """At rest at encoder angles q (28,)."""
        return JointTrack(q, np.zeros(len(q)))

    def read(self, state: JointTrack, reading: Array, dt: float, tip_free: bool = False) -> JointTrack:
        """Takes a reading.

        Args:
            state: Of the joints.
            reading: (28,) encoder angles [rad].
            dt: Time since the last [s].
            tip_free: Whether the tip is taken to be out of its drive.
        """
        return JointTrack(*_smoothed(state.q, state.v, reading, self._times[tip_free], dt))

    def sent(self, state: TorqueTrack | None, tau: Array, dt: float, tip_free: bool = False) -> TorqueTrack:
        """Takes what the drives are sent until the next reading, low-passed as the speeds are.

        `read` makes of the mean speed between two readings what two low-passes in a row, x += (1 - a) (input - x), make
        of it.  Torques do not change between two readings, so they are told for the same time as the speeds.

        Args:
            state: Of the torques; None before the first.
            tau: (24,) torques [N.m].
            dt: Time for which they are given [s].
            tip_free: Whether the tip is taken to be out of its drive.
        """
        if state is None:
            return TorqueTrack(tau, tau)
        share = 1.0 - np.exp(-dt / self._times[tip_free][DRIVEN_INDEX])
        once = state.once + share * (tau - state.once)
        return TorqueTrack(once, state.tau + share * (once - state.tau))

    def refresh(self, state: JointTrack, estimate: Estimate, ahead: float) -> Estimate:
        """Brings an estimate up to the joints' last reading.

        Args:
            state: Of the joints.
            estimate: The last there is.
            ahead: Its age [s]: the tool is turned on by so much.
        """
        q, v = state.q - estimate.offset, state.v
        J = self.robot.contact_jacobians(q, v, estimate.c_W)
        R_WT, nu = _carried_on(
            J, estimate.touching, v, DRIVEN_INDEX, estimate.c_W, estimate.p_WT, estimate.R_WT, self.prior, ahead,
            self.pitch,
        )  # fmt: skip
        return changed(estimate, q=q, v=v, nu=nu, R_WT=R_WT)


@compiled
def _smoothed(q: Array, v: Array, reading: Array, times: Array, dt: float) -> tuple[Array, Array]:
    """Angles [rad] and speeds [rad/s] (28,) after a reading, with time constants `times` (28,) [s]."""
    angles, speeds = np.empty(len(q)), np.empty(len(q))
    for i in range(len(q)):
        keep = exp(-dt / times[i])
        predicted = q[i] + dt * v[i]
        # a reading that is no number is taken for what was expected
        error = reading[i] - predicted if isfinite(reading[i]) else 0.0
        angles[i] = predicted + (1.0 - keep * keep) * error
        speeds[i] = v[i] + (1.0 - keep) ** 2 / dt * error
    return angles, speeds


@compiled
def _fitting_rate(J: Array, touching: Flags, v: Array, joint: Rows, c_W: Array, p_WT: Array, prior: float) -> Array:
    """Angular velocity (3,) of the tool in W that fits the speeds of the touching fingertips best, its tip at rest.

    It is least in `sum |omega x r - J v|^2 + prior |omega|^2`, r = c - p, with the contacts' Jacobians J (5, 3, 24) and
    the joint (24,) of each drive.  What one finger alone touches does not turn.
    """
    if touching.sum() < 2:
        return np.zeros(3)
    driven = v[joint]
    A, b = prior * np.eye(3), np.zeros((3, 1))
    for i in range(len(touching)):
        if touching[i]:
            V, r = np.dot(J[i], driven), c_W[i] - p_WT
            b[:, 0] += cross(r, V)
            for row in range(3):
                A[row, row] += r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
                for column in range(3):
                    A[row, column] -= r[row] * r[column]
    return solve_positive(A, b).ravel()


@compiled
def _carried_on(
    J: Array, touching: Flags, v: Array, joint: Rows, c_W: Array, p_WT: Array, R_WT: Array, prior: float, ahead: float,
    pitch: float,
) -> tuple[Array, Array]:  # fmt: skip
    """The orientation after `ahead` seconds, and the tool's velocity (6,) in T, its tip on the thread."""
    omega_W = _fitting_rate(J, touching, v, joint, c_W, p_WT, prior)
    R = np.dot(exp_so3(ahead * omega_W), R_WT)
    nu = np.zeros(6)
    for i in range(3):
        for j in range(3):
            nu[3 + i] += R[j, i] * omega_W[j]
    nu[2] = pitch / (2.0 * np.pi) * nu[5]
    return R, nu
