"""Torque motors in the joints, held to the drives' published limits, for a robot that takes torques."""

from __future__ import annotations

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.arm import LINKS
from turnscrew.robot.hand import torque_limit
from turnscrew.robot.joints import ARM, DRIVEN


def drive_limit(joint: str) -> float:
    """Peak torque of a driven joint [N.m], as published for arm and hand."""
    return LINKS[ARM.index(joint)].torque if joint in ARM else torque_limit(joint)


DRIVE_LIMITS: Array = np.array([drive_limit(joint) for joint in DRIVEN])
"""Peak torques (24,) in the order of `DRIVEN` [N.m]."""


def add_motors(spec: mujoco.MjSpec) -> None:
    """Adds a torque motor for each joint of `DRIVEN`, in order; what is beyond its limit it does not give.

    A coupled pair is driven through its J2: the tendon shares the torque between both joints, which the joint
    equality does here.
    """
    for joint in DRIVEN:
        motor = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
        limit = drive_limit(joint)
        motor.ctrllimited, motor.ctrlrange = True, [-limit, limit]
        motor.forcelimited, motor.forcerange = True, [-limit, limit]
