"""Where joints that do not carry the tool are held: arm and wrist, free fingers, fingers that feel for the handle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array, Rows
from turnscrew.robot.coupling import DRIVE, DRIVEN_INDEX, SELECTION
from turnscrew.robot.joints import ARM, COUPLED, FINGERS, HAND_FINGERS, WRIST
from turnscrew.robot.model import Dynamics
from turnscrew.signals import FREE, GRIP, REACH, Goal

PALM = slice(0, len(ARM) + len(WRIST))
"""Arm and wrist are the first drives."""

ARM_DRIVES, WRIST_DRIVES = slice(0, len(ARM)), slice(len(ARM), PALM.stop)

FINGER_DRIVES = [
    np.array([DRIVE[joint] for joint in HAND_FINGERS[finger] if joint not in COUPLED]) for finger in FINGERS
]
"""Drives of each finger, palm outwards."""

FINGER_OF_DRIVE = np.zeros(len(DRIVEN_INDEX), dtype=np.intp)
"""Row of the finger that a drive moves; arm and wrist, which move none alone, have 0 and are set apart."""
for _row, _drives in enumerate(FINGER_DRIVES):
    FINGER_OF_DRIVE[_drives] = _row

PALM_ROLE = -1

PALM_DAMPING = 1e-6
"""Of the palm's inverse Jacobian [m2, rad2]: a millimetre and a milliradian; the plan's postures are far from it."""

LEAST_LEVER = 0.002
"""Of a finger's inverse Jacobian [m/rad]: a tenth of the least lever that the plan's postures have."""


@dataclass(frozen=True, slots=True)
class Posture:
    """What is remembered.

    Attributes:
        q: (24,) postures that are held to, in joint angles [rad]; of a gripping finger, where it is.
        rate: (24,) their rates [rad/s].
        integral: (6,) of the errors of arm and wrist [rad.s].
    """

    q: Array
    rate: Array
    integral: Array


@dataclass(frozen=True)
class Gains:
    """Of a second-order loop over accelerations: stiffness [1/s2], damping [1/s], integral [1/s3]."""

    kp: float
    kv: float
    ki: float = 0.0


@dataclass(frozen=True)
class Postures:
    """Impedances, all placed by natural frequency and damping ratio, with what the joints' own damping adds.

    Attributes:
        limits: (28, 2) joint ranges [rad].
        arm: 10 rad/s, critical, on 4 kg.m2 whose own damping is .1/s: the encoders' noise at the shoulder then makes
            .4 N.m.  The integral makes up within .5 s for a weight that is wrong.
        wrist: 20 rad/s, critical with the joint's own 30/s (.5 N.m.s/rad on .015 kg.m2).
        finger: Free or feeling: 63 rad/s, critical with the joint's own 100/s; a fingertip, .2 kg, then is 800 N/m
            stiff, and 3 mm of `push` are 2.4 N.
        guide: A gripping finger with a joint to spare (the thumb), towards the plan's posture: 10 rad/s, overdamped.
        integral_limit: Of arm and wrist [rad.s]: 10 rad/s2 of the arm, 40 N.m at the shoulder.
        follow: Time in which a posture follows what it is told [s]: goals come in steps, ten times as seldom.
        push: How far a finger that feels for the handle may be told ahead of itself [m].
        speed: Fastest motion of a free joint [rad/s]: Shadow's joints reach 2-4 rad/s; at 2.5 the coupled joints'
            damping takes .5 of their .72 N.m.
        acceleration: Largest of a free joint's posture [rad/s2]: .15 N.m for the .0025 kg.m2 of a coupled pair.
        margin: Distance that postures keep from the joint limits [rad].
    """

    limits: Array
    arm: Gains = Gains(100.0, 20.0, 200.0)
    wrist: Gains = Gains(400.0, 10.0, 800.0)
    finger: Gains = Gains(4000.0, 30.0)
    guide: Gains = Gains(100.0, 10.0)
    integral_limit: float = 0.05
    follow: float = 0.02
    push: float = 0.003
    speed: float = 2.5
    acceleration: float = 60.0
    margin: float = 0.005
    _low: Array = field(init=False, repr=False, compare=False)
    _high: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        low, high = self.limits[DRIVEN_INDEX].T
        object.__setattr__(self, "_low", low + self.margin)
        object.__setattr__(self, "_high", high - self.margin)

    def init(self, q: Array) -> Posture:
        """Postures begin where the joints are: angles (28,) [rad]."""
        return Posture(q[DRIVEN_INDEX], np.zeros(len(DRIVEN_INDEX)), np.zeros(PALM.stop))

    def update(self, state: Posture, goal: Goal, dynamics: Dynamics, q: Array, dt: float) -> tuple[Posture, Array]:
        """Moves the postures on.

        Args:
            state: Of the last beat.
            goal: Roles, free postures, approach and the palm's velocity.
            dynamics: Jacobians.
            q: (24,) joint angles [rad].
            dt: Time since the last beat [s].

        Returns:
            The new state, and the postures' rates (24,) [rad/s].
        """
        roles = goal.roles[FINGER_OF_DRIVE]
        roles[PALM] = PALM_ROLE
        left = goal.q_free[DRIVEN_INDEX] - state.q
        # no faster than from where it can still brake
        brake = np.sqrt(2.0 * self.acceleration * np.abs(left))
        step = np.minimum(np.maximum(left / self.follow, -brake), brake)
        change = self.acceleration * dt
        low, high = np.maximum(state.rate - change, -self.speed), np.minimum(state.rate + change, self.speed)
        rate = np.where(roles == FREE, np.minimum(np.maximum(step, low), high), 0.0)
        rate[PALM] = self._shift(dynamics.J_palm[:, PALM], goal.v_palm)
        for row in np.flatnonzero(goal.roles == REACH).tolist():
            drives = FINGER_DRIVES[row]
            rate[drives] = self._feel(dynamics.tips.J[row, :3], drives, state.q - q, goal.approach[row])
        posture = np.where(roles == GRIP, q, state.q) + rate * dt
        posture = np.minimum(np.maximum(posture, self._low), self._high)
        error = (posture - q)[PALM]
        integral = np.minimum(np.maximum(state.integral + error * dt, -self.integral_limit), self.integral_limit)
        return Posture(posture, rate, integral), rate

    def _shift(self, J: Array, v: Array) -> Array:
        """Rates (6,) of arm and wrist that move the palm at v (3,) and do not turn it."""
        if not v.any():
            return np.zeros(PALM.stop)
        return np.asarray(np.linalg.solve(J.T @ J + PALM_DAMPING * np.eye(PALM.stop), J[:3].T @ v))

    def _feel(self, J: Array, drives: Rows, ahead: Array, approach: Array) -> Array:
        """Rates of a finger that moves its tip at `approach`, until it is told too far ahead of itself."""
        J = (J @ SELECTION)[:, drives]
        lead = J @ ahead[drives]
        if lead @ lead >= self.push**2:
            return np.zeros(len(drives))
        return np.asarray(J.T @ np.linalg.solve(J @ J.T + LEAST_LEVER**2 * np.eye(3), approach))

    def accelerations(self, state: Posture, goal: Goal, q: Array, v: Array, rate: Array) -> Array:
        """Accelerations (24,) that hold the joints to their postures [rad/s2]; arguments as for `update`."""
        error, slower = state.q - q, rate - v
        away = self.guide.kp * (goal.q_guide[DRIVEN_INDEX] - q) - self.guide.kv * v
        held = self.finger.kp * error + self.finger.kv * slower
        wanted = np.where(goal.roles[FINGER_OF_DRIVE] == GRIP, away, held)
        for gains, part in ((self.arm, ARM_DRIVES), (self.wrist, WRIST_DRIVES)):
            wanted[part] = gains.kp * error[part] + gains.kv * slower[part] + gains.ki * state.integral[part]
        return wanted
