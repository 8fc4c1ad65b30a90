"""The screw: a slotted head that turns and sinks along its thread, in a substrate that only resists."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.contact import STEEL, Friction, rub

INERTIA = 1e-5
"""Inertia that turns with the screw [kg.m2].  A lone M4 screw has 3e-8; the tool that turns it has 1e-5.  This
value keeps the thread's elasticity (see `thread`) well sampled at 1 kHz, and costs 2e-4 N.m at 20 rad/s2."""

DAMPING = 5e-3
"""Viscous friction of the thread [N.m.s/rad]: half critical for thread elasticity and inertia."""

LINEAR_INERTIA = 0.05
"""Inertia that moves with the screw along its thread [kg]; with STIFF it keeps the helix within 1 um under 10 N."""

STIFF = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""Impedance of the thread's helix: steel in steel."""


@dataclass(frozen=True)
class Screw:
    """A slotted machine screw, M4 by default (ISO 1207: slot 1.2 mm wide, at least 1.1 mm deep, head 7-8 mm).

    The slot's ends are closed, as in a recessed drive: an open slot lets the tip slide out along itself.

    Attributes:
        pitch: Advance a turn [m].
        slot_width: [m].
        slot_length: [m].
        slot_depth: [m].
        head_radius: [m].
    """

    pitch: float = 0.0007
    slot_width: float = 0.0012
    slot_length: float = 0.0064
    slot_depth: float = 0.0013
    head_radius: float = 0.0045


def add_screw(spec: mujoco.MjSpec, screw: Screw, friction: Friction, p_WS: Array, yaw: float) -> None:
    """Adds body `screw`, hinge `screw`, slide `screw_advance` and the thread's torque motor `thread`.

    A right-hand thread: the slide follows the hinge by `pitch / 2 pi`, so fastening (negative yaw) sinks it.

    Args:
        spec: What to add to.
        screw: Dimensions.
        friction: Of the drive's walls.
        p_WS: (3,) centre of the slot's floor, the origin of S, in W [m].
        yaw: Slot's initial direction about z [rad].
    """
    body = spec.worldbody.add_body(name="screw", pos=p_WS, quat=[np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
    body.add_joint(name="screw_advance", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], armature=LINEAR_INERTIA)
    body.add_joint(name="screw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], armature=INERTIA, damping=DAMPING)
    # a tendon's length, not the joints' own equality: that one weighs metres and radians alike, and gives way
    helix = spec.add_tendon(name="helix")
    helix.wrap_joint("screw_advance", 1.0)
    helix.wrap_joint("screw", -screw.pitch / (2 * np.pi))
    spec.add_equality(
        name="helix", type=mujoco.mjtEq.mjEQ_TENDON, objtype=mujoco.mjtObj.mjOBJ_TENDON, name1="helix",
        data=[0.0] * 12, solref=[0.004, 1], solimp=STIFF,
    )  # fmt: skip
    thread = spec.add_actuator(name="thread", target="screw", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    thread.set_to_motor()
    _add_head(body, screw, friction)
    # drawn only: the shank that vanishes into the substrate
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0, 0, -FLOOR - 0.005], size=[0.002, 0.005, 0], contype=0,
        conaffinity=0, mass=0, rgba=[0.5, 0.5, 0.53, 1],
    )  # fmt: skip
    top = float(p_WS[2]) - FLOOR - screw.pitch * 4
    spec.worldbody.add_geom(
        name="substrate", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[p_WS[0], p_WS[1], top / 2],
        size=[0.15, 0.15, top / 2], rgba=[0.55, 0.45, 0.35, 1],
    )  # fmt: skip
    # what the head meets when it seats is the thread law's, not a second time a contact's
    spec.add_exclude(bodyname1="world", bodyname2="screw")


FLOOR = 0.002
"""Thickness of the head under the slot [m]."""


def _add_head(body: mujoco.MjsBody, screw: Screw, friction: Friction) -> None:
    """The head from boxes: floor, two side walls, two closed ends."""
    wall = screw.head_radius - screw.slot_width / 2
    end = 0.001
    half_depth, half_length = screw.slot_depth / 2, screw.slot_length / 2
    boxes = {
        "floor": ([0, 0, -FLOOR / 2], [screw.head_radius, screw.head_radius, FLOOR / 2]),
        "left": ([0, screw.slot_width / 2 + wall / 2, half_depth], [half_length + end, wall / 2, half_depth]),
        "right": ([0, -screw.slot_width / 2 - wall / 2, half_depth], [half_length + end, wall / 2, half_depth]),
        "front": ([half_length + end / 2, 0, half_depth], [end / 2, screw.slot_width / 2, half_depth]),
        "back": ([-half_length - end / 2, 0, half_depth], [end / 2, screw.slot_width / 2, half_depth]),
    }
    for name, (position, size) in boxes.items():
        geom = body.add_geom(
            name=f"slot_{name}", type=mujoco.mjtGeom.mjGEOM_BOX, pos=position, size=size, mass=0.001,
            rgba=[0.6, 0.6, 0.63, 1],
        )  # fmt: skip
        rub(geom, friction.tip, solimp=STEEL)
