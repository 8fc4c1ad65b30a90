"""Joint torques of arm and hand: (17) and (18), with what the paper leaves to the other joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.contact.grasp import grasp_matrix
from turnscrew.contact.rolling_motion import contact_accelerations
from turnscrew.geometry.arrays import Array, Rows
from turnscrew.robot.contact_jacobian import contact_bias, contact_jacobian
from turnscrew.robot.coupling import DRIVE, DRIVEN_INDEX, SELECTION
from turnscrew.robot.joints import ARM, COUPLED, FINGERS, HAND_FINGERS, WRIST
from turnscrew.robot.model import Dynamics, RobotModel
from turnscrew.robot.motors import drive_limits
from turnscrew.signals import Command, Effort, Estimate, Goal, Role

PALM = slice(0, len(ARM) + len(WRIST))
"""Arm and wrist are the first drives."""

FINGER_DRIVES = [
    np.array([DRIVE[joint] for joint in HAND_FINGERS[finger] if joint not in COUPLED]) for finger in FINGERS
]
"""Drives of each finger, palm outwards."""


@dataclass(frozen=True, slots=True)
class TorqueState:
    """What the adapter remembers.

    Attributes:
        q: (24,) postures that arm, wrist and free fingers are held to, in joint angles [rad].
        integral: (6,) of the errors of arm and wrist [rad.s].
    """

    q: Array
    integral: Array


@dataclass(frozen=True)
class TorqueAdapter:
    """Turns wanted accelerations and contact forces into the drives' torques.

    Attributes:
        robot: Kinematics, dynamics and limits.
        arm_gains: Stiffness [1/s2], damping [1/s] and integral gain [1/s3] of the arm.
        wrist_gains: The same of the wrist.
        finger_kp: Stiffness of fingers that move freely or feel for the handle [1/s2].
        finger_kv: Damping [1/s].
        guide_kp: Stiffness to the plan's posture of gripping fingers with a joint to spare [1/s2].
        guide_kv: Damping [1/s].
        follow: Time in which a posture follows what it is told [s].
        push: How far a finger that feels for the handle may be told ahead of itself [m].
        speed: Fastest motion of a free joint [rad/s].
        margin: Distance that postures keep from the joint limits [rad].
    """

    robot: RobotModel
    arm_gains: tuple[float, float, float] = (100.0, 20.0, 200.0)
    wrist_gains: tuple[float, float, float] = (400.0, 10.0, 800.0)
    palm_limit: float = 0.05
    finger_kp: float = 4000.0
    finger_kv: float = 30.0
    guide_kp: float = 100.0
    guide_kv: float = 10.0
    follow: float = 0.02
    push: float = 0.003
    speed: float = 2.5
    margin: float = 0.005

    def init(self, q: Array) -> TorqueState:
        """Postures begin where the joints are: encoder readings (28,) [rad]."""
        return TorqueState(q[DRIVEN_INDEX], np.zeros(6))

    def update(
        self, state: TorqueState, goal: Goal, effort: Effort, estimate: Estimate, dt: float
    ) -> tuple[TorqueState, Command]:
        """One beat."""
        dynamics = self.robot.dynamics(estimate.q, estimate.v)
        q, v = estimate.q[DRIVEN_INDEX], estimate.v[DRIVEN_INDEX]
        state, rate = self._postures(state, goal, estimate, dynamics, q, dt)
        wanted = self._free_accelerations(state, goal, q, v, rate)
        M = SELECTION.T @ dynamics.M @ SELECTION
        rest = SELECTION.T @ dynamics.bias
        damping = SELECTION.T @ self.robot.damping
        rows = np.flatnonzero(goal.roles == Role.GRIP)
        if len(rows):
            J = contact_jacobian(dynamics.tips, rows, estimate.c_W[rows])
            at_contacts, speeds = self._contacts(effort, estimate, dynamics, rows)
            spread = np.linalg.solve(M, J.T)
            inverse = np.linalg.solve((J @ spread).T, spread.T).T
            wanted = wanted + inverse @ (at_contacts - J @ wanted)
            rate = rate + inverse @ (speeds - J @ rate)
            rest = rest + J.T @ effort.f_W[rows].ravel()
        tau = M @ wanted + rest + damping * rate
        limits = drive_limits()
        return state, Command(None, np.abs(tau) > limits, np.minimum(np.maximum(tau, -limits), limits))

    def _contacts(self, effort: Effort, estimate: Estimate, dynamics: Dynamics, rows: Rows) -> tuple[Array, Array]:
        """Accelerations that (17) asks of the contact points less `Jdot qdot`, and their wanted velocities, (3k,)."""
        R, nu = estimate.R_WT, estimate.nu
        c_W = estimate.c_W[rows]
        V = np.concatenate([R @ nu[:3], R @ nu[3:]])
        cdot = (grasp_matrix(c_W, estimate.p_WT).T @ V).reshape(-1, 3)
        a = contact_accelerations(c_W, cdot, estimate.p_WT, R, nu, effort.alpha)
        bias = contact_bias(dynamics, estimate.v, rows, c_W, cdot)
        V_d = np.concatenate([R @ effort.nu_d[:3], R @ effort.nu_d[3:]])
        return a - bias, grasp_matrix(c_W, estimate.p_WT).T @ V_d

    def _postures(
        self, state: TorqueState, goal: Goal, estimate: Estimate, dynamics: Dynamics, q: Array, dt: float
    ) -> tuple[TorqueState, Array]:
        """Moves the postures on; also their rates (24,) [rad/s]."""
        rate = np.zeros(len(q))
        J = self.robot.palm_jacobian(estimate.q)[:, DRIVEN_INDEX[PALM]]
        rate[PALM] = np.linalg.solve(J.T @ J + 1e-6 * np.eye(6), J[:3].T @ goal.v_palm)
        posture = state.q.copy()
        for row, drives in enumerate(FINGER_DRIVES):
            role = goal.roles[row]
            if role == Role.FREE:
                step = (goal.q_free[DRIVEN_INDEX[drives]] - posture[drives]) / self.follow
                rate[drives] = np.minimum(np.maximum(step, -self.speed), self.speed)
            elif role == Role.REACH:
                J_F = (dynamics.tips.J[row, :3] @ SELECTION)[:, drives]
                ahead = J_F @ (posture - q)[drives]
                if ahead @ ahead < self.push**2:
                    regular = J_F @ J_F.T + 0.002**2 * np.eye(3)
                    rate[drives] = J_F.T @ np.linalg.solve(regular, goal.approach[row])
            else:
                posture[drives] = q[drives]
        posture += rate * dt
        low, high = self.robot.limits[DRIVEN_INDEX].T
        posture = np.minimum(np.maximum(posture, low + self.margin), high - self.margin)
        error = (posture - q)[PALM]
        integral = np.minimum(np.maximum(state.integral + error * dt, -self.palm_limit), self.palm_limit)
        return TorqueState(posture, integral), rate

    def _free_accelerations(self, state: TorqueState, goal: Goal, q: Array, v: Array, rate: Array) -> Array:
        """Accelerations (24,) that hold arm, wrist and free fingers to their postures [rad/s2]."""
        wanted = self.finger_kp * (state.q - q) + self.finger_kv * (rate - v)
        kp, kv, ki = np.array([self.arm_gains] * len(ARM) + [self.wrist_gains] * len(WRIST)).T
        wanted[PALM] = kp * (state.q - q)[PALM] + kv * (rate - v)[PALM] + ki * state.integral
        for row, drives in enumerate(FINGER_DRIVES):
            if goal.roles[row] == Role.GRIP:
                guide = goal.q_guide[DRIVEN_INDEX[drives]] - q[drives]
                wanted[drives] = self.guide_kp * guide - self.guide_kv * v[drives]
        return wanted
