"""The robot's own joint servos: position loops with the drives' torque limits, as the real hand runs at 1 kHz."""

from __future__ import annotations

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import DRIVEN, WRIST
from turnscrew.robot.motors import drive_limit

ARM_STIFFNESS = {"WAMJ1": 8000.0, "WAMJ2": 8000.0, "WAMJ3": 4000.0, "WAMJ4": 2000.0}
"""Proportional gains of the arm's joints [N.m/rad]: 5 N at the hand move it by less than 1 mm; with about 4 kg.m2
at the shoulder the loop is at 45 rad/s, a tenth of its sampling rate."""

ARM_DAMPING = {"WAMJ1": 350.0, "WAMJ2": 350.0, "WAMJ3": 100.0, "WAMJ4": 50.0}
"""Critical damping for the arm's inertia: `2 sqrt(kp I)` with I = 4, 4, .6, .3 kg.m2 [N.m.s/rad]."""

WRIST_STIFFNESS, WRIST_DAMPING = 100.0, 1.5
"""Wrist loop [N.m/rad, N.m.s/rad]: critical with the joint's own damping for .01 kg.m2."""

FINGER_STIFFNESS, FINGER_DAMPING = 8.0, 0.09
"""Finger loops [N.m/rad, N.m.s/rad]: 1.6 N/mm at a 70 mm long finger's tip, soft enough to grip with, and critical
with the joint's own damping for its drive's inertia of .001 kg.m2.  4 to 15 N.m/rad work."""


def stiffness(joint: str) -> float:
    """Proportional gain of a driven joint's servo [N.m/rad]."""
    return ARM_STIFFNESS.get(joint, WRIST_STIFFNESS if joint in WRIST else FINGER_STIFFNESS)


def _damping(joint: str) -> float:
    return ARM_DAMPING.get(joint, WRIST_DAMPING if joint in WRIST else FINGER_DAMPING)


def add_servos(spec: mujoco.MjSpec) -> None:
    """Adds a position servo for each joint of `DRIVEN`, in order.

    A coupled pair is driven through its J2: the tendon shares the torque between both joints, which the joint
    equality does here.
    """
    for joint in DRIVEN:
        servo = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=stiffness(joint), kv=_damping(joint))
        limit = drive_limit(joint)
        servo.forcelimited, servo.forcerange = True, [-limit, limit]


STIFFNESSES: Array = np.array([stiffness(joint) for joint in DRIVEN])
"""Proportional gains (24,) in the order of `DRIVEN` [N.m/rad]."""
