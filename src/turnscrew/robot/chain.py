"""The kinematic chain and collision shapes of arm and hand as plain arrays.

Written out like this, the same forward kinematics can be evaluated with numbers here and with symbols by a planner:
`X_WB = X_WP(parent) . (p, R) . Rot(axis, q[joint])` for each body B in order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np

from turnscrew.errors import ModelError
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import FINGERS, JOINTS
from turnscrew.robot.model import robot_spec

PALM = "palm"
PALM_SHAPES = ("C_palm0", "C_palm1", "C_lfmetacarpal")
"""Boxes of the palm."""

_TIPS = {f"C_{finger.lower()}distal": finger for finger in FINGERS}


@dataclass(frozen=True, slots=True)
class Shape:
    """A convex collision shape fixed to a body: all points within `radius` of the hull of `vertices`.

    Attributes:
        name: As in the robot's description.
        body: Index of the body that carries it.
        vertices: (2, 3) ends of a capsule's axis or (8, 3) corners of a box, in the body's frame [m].
        radius: Of a capsule; 0 of a box [m].
    """

    name: str
    body: int
    vertices: Array
    radius: float


@dataclass(frozen=True, slots=True)
class Tip:
    """A fingertip's frame F and capsule.

    Attributes:
        body: Index of the distal phalanx; F has its orientation.
        p: (3,) origin of F, the distal half ball's centre, in the body's frame [m].
        rho: Capsule radius [m].
        length: Of the capsule's cylinder, which reaches from F's origin along -z [m].
    """

    body: int
    p: Array
    rho: float
    length: float


@dataclass(frozen=True)
class Chain:
    """Bodies of arm and hand, parents before children.

    Attributes:
        names: Of the n bodies.
        parent: Index of each body's parent; -1 is W.
        p: (n, 3) origin of each body's frame in its parent's [m].
        R: (n, 3, 3) orientation of each body's frame in its parent's at joint angle zero.
        axis: (n, 3) joint axis in the body's frame, through its origin; zero for a fixed body.
        joint: Index of each body's joint in the joint vector; -1 for a fixed body.
        limits: (28, 2) joint ranges [rad].
        shapes: What can collide: capsules and boxes (the forearm's mesh is left out: nothing gets near it).
        apart: Pairs of body indices, smaller first, whose shapes never collide by construction: neighbours.
        tips: Frames and capsules of the fingertips.
    """

    names: tuple[str, ...]
    parent: tuple[int, ...]
    p: Array
    R: Array
    axis: Array
    joint: tuple[int, ...]
    limits: Array
    shapes: tuple[Shape, ...]
    apart: frozenset[tuple[int, int]]
    tips: dict[str, Tip]

    @property
    def palm(self) -> int:
        """Index of the palm."""
        return self.names.index(PALM)

    def place(self, q: Array) -> tuple[Array, Array]:
        """Frames of all bodies in W at joint angles q (28,) [rad]: origins (n, 3) [m], orientations (n, 3, 3)."""
        p, R = np.empty((len(self.names), 3)), np.empty((len(self.names), 3, 3))
        for body, (parent, joint) in enumerate(zip(self.parent, self.joint, strict=True)):
            p_P, R_P = (p[parent], R[parent]) if parent >= 0 else (np.zeros(3), np.eye(3))
            p[body] = p_P + R_P @ self.p[body]
            turn = rotation(self.axis[body], q[joint]) if joint >= 0 else np.eye(3)
            R[body] = R_P @ self.R[body] @ turn
        return p, R


def rotation(axis: Array, angle: float) -> Array:
    """Rotation (3, 3) by an angle [rad] about a unit axis (3,): Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K))


@cache
def robot_chain() -> Chain:
    """The chain of the robot that `RobotModel` describes.

    Raises:
        ModelError: A joint is not a hinge through its body's origin, or a body has several.
    """
    model = robot_spec().compile()
    joint, axis = np.full(model.nbody, -1), np.zeros((model.nbody, 3))
    for index in range(len(JOINTS)):
        body = model.jnt_bodyid[index]
        hinge = model.jnt_type[index] == mujoco.mjtJoint.mjJNT_HINGE
        if not hinge or joint[body] >= 0 or model.jnt_pos[index].any() or model.qpos0[index] != 0.0:
            raise ModelError(f"joint {JOINTS[index]} is not a single hinge through its body's origin, zero at rest")
        joint[body], axis[body] = index, model.jnt_axis[index]
    shapes = _shapes(model)
    return Chain(
        names=tuple(model.body(body).name for body in range(1, model.nbody)),
        parent=tuple(int(parent) - 1 for parent in model.body_parentid[1:]),
        p=model.body_pos[1:].copy(),
        R=np.array([_matrix(quaternion) for quaternion in model.body_quat[1:]]),
        axis=axis[1:],
        joint=tuple(int(index) for index in joint[1:]),
        limits=model.jnt_range[: len(JOINTS)].copy(),
        shapes=shapes,
        apart=_apart(model),
        tips={finger: _tip(shape) for shape in shapes for name, finger in _TIPS.items() if shape.name == name},
    )


def _matrix(quaternion: Array) -> Array:
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, quaternion)
    return flat.reshape(3, 3)


def _shapes(model: mujoco.MjModel) -> tuple[Shape, ...]:
    shapes = []
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    for index in range(model.ngeom):
        kind, size = model.geom_type[index], model.geom_size[index]
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            local, radius = np.array([[0, 0, -size[1]], [0, 0, size[1]]]), float(size[0])
        elif kind == mujoco.mjtGeom.mjGEOM_BOX:
            local, radius = corners * size, 0.0
        else:
            continue
        if model.geom_contype[index]:
            vertices = model.geom_pos[index] + local @ _matrix(model.geom_quat[index]).T
            shapes.append(Shape(model.geom(index).name, int(model.geom_bodyid[index]) - 1, vertices, radius))
    return tuple(shapes)


def _apart(model: mujoco.MjModel) -> frozenset[tuple[int, int]]:
    """Pairs that MuJoCo does not test: parent and child, and those the hand's description excludes."""
    pairs = {(int(signature) >> 16, int(signature) & 0xFFFF) for signature in model.exclude_signature}
    welded = model.body_weldid
    for one in range(1, model.nbody):
        for other in range(1, model.nbody):
            if welded[model.body_parentid[welded[one]]] == welded[other] or welded[one] == welded[other]:
                pairs.add((one, other))
    return frozenset((min(pair) - 1, max(pair) - 1) for pair in pairs)


def _tip(shape: Shape) -> Tip:
    start, end = shape.vertices
    return Tip(shape.body, end, shape.radius, float(end[2] - start[2]))
