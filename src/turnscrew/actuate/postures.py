"""Where joints that do not carry the tool are held: arm and wrist, free fingers, fingers that feel for the handle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array, Rows
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import solve_positive
from turnscrew.robot.coupling import DRIVE, DRIVE_OF_JOINT, DRIVEN_INDEX
from turnscrew.robot.joints import ARM, COUPLED, FINGERS, HAND_FINGERS, WRIST
from turnscrew.robot.model import Dynamics
from turnscrew.signals import FREE, GRIP, REACH, Goal

CARRIERS = len(ARM) + len(WRIST)
"""Drives of arm and wrist, which carry the palm: the first ones."""

PALM = slice(0, CARRIERS)

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
        wrist: 20 rad/s, critical with the joint's own 30/s (.5 N.m.s/rad on .015 kg.m2).  No integral: a hand that
            weighs a tenth more than believed sags by half a degree, which the fingers, whose encoders know of it, make
            up; an integral that one pair of fingers resists lets go with a jerk when the other takes over (found by
            trial: it moved the palm by 1.8 deg, until the middle finger met its limit).
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
    wrist: Gains = Gains(400.0, 10.0)
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
    _paces: tuple[float, float, float, float, float] = field(init=False, repr=False, compare=False)
    _gains: tuple[Array, tuple[float, float], tuple[float, float]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        low, high = self.limits[DRIVEN_INDEX].T
        object.__setattr__(self, "_low", low + self.margin)
        object.__setattr__(self, "_high", high - self.margin)
        paces = (self.follow, self.speed, self.acceleration, self.push, self.integral_limit)
        object.__setattr__(self, "_paces", tuple(map(float, paces)))
        palm = [self.arm] * len(ARM) + [self.wrist] * len(WRIST)
        gains = (np.array([[part.kp, part.kv, part.ki] for part in palm]), *map(_two, (self.finger, self.guide)))
        object.__setattr__(self, "_gains", gains)

    def init(self, q: Array) -> Posture:
        """Postures begin where the joints are: angles (28,) [rad]."""
        return Posture(q[DRIVEN_INDEX], np.zeros(len(DRIVEN_INDEX)), np.zeros(CARRIERS))

    def update(
        self, state: Posture, goal: Goal, dynamics: Dynamics, q: Array, v: Array, dt: float
    ) -> tuple[Posture, Array]:
        """Moves the postures on.

        Args:
            state: Of the last beat.
            goal: Roles, free postures, approach and the palm's twist.
            dynamics: Jacobians.
            q: (28,) joint angles [rad].
            v: (28,) joint speeds [rad/s].
            dt: Time since the last beat [s].

        Returns:
            The new state, and the accelerations (24,) that hold the joints to their postures [rad/s2].
        """
        posture, rate, integral, qddot = _held(
            state.q, state.rate, state.integral, goal.roles, goal.q_free, goal.q_guide, goal.V_palm, goal.approach,
            dynamics.J_palm, dynamics.tips.J, q, v, self._low, self._high, self._paces, self._gains, dt,
        )  # fmt: skip
        return Posture(posture, rate, integral), qddot


def _two(gains: Gains) -> tuple[float, float]:
    return float(gains.kp), float(gains.kv)


@compiled
def _held(
    posture: Array, rate: Array, integral: Array, roles: Rows, q_free: Array, q_guide: Array, V_palm: Array,
    approach: Array, J_palm: Array, J_tips: Array, q: Array, v: Array, low: Array, high: Array,
    paces: tuple[float, float, float, float, float],
    gains: tuple[Array, tuple[float, float], tuple[float, float]], dt: float,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """`Postures.update` at once: postures, rates, integrals and accelerations."""
    follow, speed, acceleration, push, most = paces
    role, driven = roles[FINGER_OF_DRIVE], q[DRIVEN_INDEX]
    role[:CARRIERS] = PALM_ROLE
    rate = _follow(q_free[DRIVEN_INDEX] - posture, rate, role, follow, speed, acceleration, dt)
    if V_palm.any():
        rate[:CARRIERS] = _shift(J_palm, V_palm)
    for finger in range(len(roles)):
        if roles[finger] == REACH:
            drives = _drives_of(finger)
            ahead = (posture - driven)[drives]
            rate[drives] = _feel(J_tips[finger], drives, ahead, approach[finger], push)
    posture, integral = _advance(posture, driven, rate, role, integral, most, low, high, dt)
    speeds = v[DRIVEN_INDEX]
    guided = q_guide[DRIVEN_INDEX] - driven
    qddot = _accelerate(posture - driven, rate - speeds, guided, speeds, integral, role, *gains)
    return posture, rate, integral, qddot


@compiled
def _drives_of(finger: int) -> Rows:
    """Drives of a finger, palm outwards."""
    return CARRIERS + np.flatnonzero(FINGER_OF_DRIVE[CARRIERS:] == finger)


@compiled
def _shift(J: Array, V: Array) -> Array:
    """Rates (6,) of arm and wrist that move the palm, its Jacobian J (6, 28), at the twist V (6,) [rad/s]."""
    J = np.ascontiguousarray(J[:, :CARRIERS])
    wanted = np.dot(J.T, V.copy().reshape(6, 1))
    return solve_positive(np.dot(J.T, J) + PALM_DAMPING * np.eye(CARRIERS), wanted).ravel()


@compiled
def _feel(J_tip: Array, drives: Rows, ahead: Array, approach: Array, push: float) -> Array:
    """Rates (n,) of a finger that moves its tip at `approach` (3,), until it is told too far ahead of itself [rad/s].

    J_tip (6, 28) is the tip's Jacobian, and `ahead` (n,) what the finger's drives (n,) are told ahead of themselves
    [rad].
    """
    J = np.zeros((3, len(drives)))
    for column in range(len(drives)):
        for joint in range(len(DRIVE_OF_JOINT)):
            if DRIVE_OF_JOINT[joint] == drives[column]:
                J[:, column] += J_tip[:3, joint]
    lead = np.dot(J, ahead)
    if np.dot(lead, lead) >= push * push:
        return np.zeros(len(ahead))
    spread = np.dot(J, J.T) + LEAST_LEVER * LEAST_LEVER * np.eye(3)
    rates: Array = np.dot(J.T, solve_positive(spread, approach.copy().reshape(3, 1))).ravel()
    return rates


@compiled
def _follow(
    left: Array, rate: Array, roles: Rows, follow: float, speed: float, acceleration: float, dt: float
) -> Array:
    """Rates (24,) of the free fingers' postures [rad/s], `left` (24,) from where they are to be [rad]."""
    following = np.zeros(len(left))
    change = acceleration * dt
    for i in range(len(left)):
        if roles[i] == FREE:
            # no faster than from where it can still brake
            brake = np.sqrt(2.0 * acceleration * abs(left[i]))
            step = min(max(left[i] / follow, -brake), brake)
            step = min(max(step, max(rate[i] - change, -speed)), min(rate[i] + change, speed))
            following[i] = step
    return following


@compiled
def _advance(
    posture: Array, q: Array, rate: Array, roles: Rows, integral: Array, most: float, low: Array, high: Array, dt: float
) -> tuple[Array, Array]:
    """Postures (24,) after a beat [rad], and integrals (6,) of the errors of arm and wrist, within `most` [rad.s]."""
    advanced, summed = np.empty(len(q)), np.empty(len(integral))
    for i in range(len(q)):
        start = q[i] if roles[i] == GRIP else posture[i]
        advanced[i] = min(max(start + rate[i] * dt, low[i]), high[i])
    for i in range(len(integral)):
        summed[i] = min(max(integral[i] + (advanced[i] - q[i]) * dt, -most), most)
    return advanced, summed


@compiled
def _accelerate(
    error: Array, slower: Array, guided: Array, v: Array, integral: Array, roles: Rows,
    palm: Array, finger: tuple[float, float], guide: tuple[float, float],
) -> Array:  # fmt: skip
    """Accelerations (24,) [rad/s2]; `palm` (6, 3) has kp, kv and ki of arm and wrist, the others kp and kv."""
    wanted = np.empty(len(error))
    for i in range(len(error)):
        if i < len(palm):
            wanted[i] = palm[i, 0] * error[i] + palm[i, 1] * slower[i] + palm[i, 2] * integral[i]
        elif roles[i] == GRIP:
            wanted[i] = guide[0] * guided[i] - guide[1] * v[i]
        else:
            wanted[i] = finger[0] * error[i] + finger[1] * slower[i]
    return wanted
