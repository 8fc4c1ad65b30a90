"""Drives that take torques and hear nothing any more: each holds its joint where it is then.

A torque that goes on when nobody steers it any more turns, pushes and lifts on for as long as nobody comes back.  The
drive knows what is needed to stop: its own encoder, and the torque that it was told last, which carries the load.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import ARM, DRIVEN, WRIST
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.robot.servos import FINGER_STIFFNESS

ARM_INERTIA = {"WAMJ1": 4.0, "WAMJ2": 4.0, "WAMJ3": 0.6, "WAMJ4": 0.3}
"""About the arm's joints, arm and hand beyond them [kg.m2]."""

ARM_RATE = 10.0
"""At which an arm's joint is held, critically damped [rad/s]: as under torque control."""

WRIST_INERTIA, WRIST_RATE, WRIST_DAMPING = 0.015, 40.0, 0.45
"""Of the wrist [kg.m2, rad/s, N.m.s/rad]: with the joint's own .5 N.m.s/rad, .8 of critical."""


def _stiffness(joint: str) -> float:
    if joint in ARM:
        return ARM_RATE**2 * ARM_INERTIA[joint]
    return WRIST_RATE**2 * WRIST_INERTIA if joint in WRIST else FINGER_STIFFNESS


def _damping(joint: str) -> float:
    if joint in ARM:
        return 2.0 * ARM_RATE * ARM_INERTIA[joint]
    # a finger's own .1 N.m.s/rad are .56 of critical; more, at a millisecond a step, shakes its lightest link
    return WRIST_DAMPING if joint in WRIST else 0.0


STIFFNESS: Array = np.array([_stiffness(joint) for joint in DRIVEN])
"""With which joints are held (24,), in the order of `DRIVEN` [N.m/rad]."""

DAMPING: Array = np.array([_damping(joint) for joint in DRIVEN])
"""The same of their speeds [N.m.s/rad]."""


def holding(tau: Array, error: Array, v: Array) -> Array:
    """Torques (24,) with which drives that hear nothing hold their joints, within their limits [N.m].

    Args:
        tau: (24,) told last [N.m].
        error: (24,) from where each joint is to where it was when its drive gave up waiting [rad].
        v: (24,) speeds [rad/s].
    """
    return np.clip(tau + STIFFNESS * error - DAMPING * v, -DRIVE_LIMITS, DRIVE_LIMITS)
