"""The Barrett WAM with four joints, as MuJoCo bodies built from its published parameters.

Source: Barrett Technology, "WAM Arm User's Guide" and "WAM ARM Inertial Specifications" (Denavit-Hartenberg
parameters, masses, centres of mass, inertias, joint ranges and peak torques).
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from turnscrew.robot.joints import ARM


@dataclass(frozen=True)
class Link:
    """One link of the arm.

    Attributes:
        twist: Denavit-Hartenberg alpha [rad].
        length: Denavit-Hartenberg a [m].
        offset: Denavit-Hartenberg d [m].
        mass: [kg].
        centre: (3,) centre of mass in the link's DH frame [m].
        inertia: (3,) principal inertias about it, along the DH axes [kg.m2].
        limits: Joint range [rad].
        torque: Peak torque of the joint [N.m].
    """

    twist: float
    length: float
    offset: float
    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float]
    limits: tuple[float, float]
    torque: float


HALF = np.pi / 2
LINKS = (
    Link(-HALF, 0, 0, 10.7677, (-0.00443, 0.12189, -0.00066), (0.13488, 0.11328, 0.09046), (-2.6, 2.6), 77.3),
    Link(HALF, 0, 0, 3.8749, (-0.00237, 0.03106, 0.01542), (0.02141, 0.01378, 0.01559), (-1.985, 1.985), 160.6),
    Link(-HALF, 0.045, 0.55, 1.8023, (-0.03826, 0.20751, 0.00003), (0.05911, 0.00325, 0.05927), (-2.8, 2.8), 95.6),
    Link(HALF, -0.045, 0, 1.0651, (0.01095, -0.00003, 0.14054), (0.01849, 0.01892, 0.00198), (-0.9, np.pi), 29.4),
)

DAMPING = 0.5
"""Viscous damping of each joint [N.m.s/rad]: the cable drives' friction is not published; found to be harmless
between 0 and 5."""

FLANGE = 0.06
"""Distance of the hand's mounting plate from the elbow along the forearm [m] (the elbow plate without wrist)."""

SKIN = (0.75, 0.76, 0.78, 1.0)


def link_transform(link: Link) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Constant part of a link's DH transform, `Tz(d) Tx(a) Rx(alpha)`: position (3,) [m] and quaternion (4,)."""
    half = link.twist / 2
    return np.array([link.length, 0.0, link.offset]), np.array([np.cos(half), np.sin(half), 0.0, 0.0])


def _draw(body: mujoco.MjsBody, start: NDArray[np.float64], end: NDArray[np.float64], radius: float) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*start, *end], size=[radius, 0, 0],
        rgba=SKIN, contype=0, conaffinity=0, mass=0, group=1,
    )  # fmt: skip


def add_arm(base: mujoco.MjsBody) -> mujoco.MjsBody:
    """Adds the arm to a body whose frame is B and returns a body whose frame is the hand's mounting plate.

    The joint `i` turns about the z axis of DH frame `i - 1`; a body's frame is that frame, so the inertial sits
    behind the link's constant transform.  The capsules are drawn only: nothing comes near the arm.
    """
    parent, position, quaternion = base, np.zeros(3), np.array([1.0, 0, 0, 0])
    for name, link in zip(ARM, LINKS, strict=True):
        body = parent.add_body(name=name.replace("J", "_link"), pos=position, quat=quaternion)
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], range=link.limits, damping=DAMPING)
        position, quaternion = link_transform(link)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, quaternion)
        body.mass, body.inertia, body.explicitinertial = link.mass, link.inertia, True
        body.ipos, body.iquat = position + rotation.reshape(3, 3) @ link.centre, quaternion
        parent = body
        _dress(body, name)
    return parent.add_body(name="plate", pos=position + np.array([0, -FLANGE, 0]), quat=quaternion)


def _dress(body: mujoco.MjsBody, name: str) -> None:
    shapes = {
        "WAMJ1": ([0, 0, -0.2], [0, 0, 0.02], 0.09),
        "WAMJ2": ([0, 0, -0.09], [0, 0, 0.09], 0.075),
        "WAMJ3": ([0, 0, 0.1], [0.02, 0, 0.5], 0.055),
        "WAMJ4": ([0, 0, -0.04], [0, 0, 0.04], 0.05),
    }
    start, end, radius = shapes[name]
    _draw(body, np.array(start), np.array(end), radius)
