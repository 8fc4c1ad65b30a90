"""Forward kinematics of the fingers relative to the palm, with symbols.

The same chain as `turnscrew.robot.chain.Chain.place`, written in CasADi's SX from the palm outwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import Chain, robot_chain
from turnscrew.robot.joints import COUPLED, HAND_FINGERS, JOINTS, finger_joints


@dataclass(frozen=True, slots=True)
class FingerKinematics:
    """One finger in the palm frame H as functions of its driven joints (n,).

    Attributes:
        tip: To the fingertip frame's origin (3,), its z axis (3,), and the Jacobians of origin and rotation (3, n),
            coupled joints summed into their leaders' columns.
        links: To the axis ends of the proximal, middle and distal capsules (3, 6), two columns each.
        knuckle: (3,) origin of the last joint frame before the finger flexes, at zero posture [m].
    """

    tip: ca.Function
    links: ca.Function
    knuckle: Array


@cache
def finger_kinematics(finger: str) -> FingerKinematics:
    """Symbolic kinematics of one of `FINGERS`."""
    chain = robot_chain()
    angles = ca.SX.sym(f"q_{finger}", len(finger_joints(finger)))
    p, R, joints = _place(chain, finger, angles)
    tip = chain.tips[finger]
    p_F, z_F = p[tip.body] + R[tip.body] @ tip.p, R[tip.body][:, 2]
    J_p, J_w = ca.SX.zeros(3, angles.numel()), ca.SX.zeros(3, angles.numel())
    for body, column in joints.items():
        axis = R[body] @ chain.axis[body]
        J_w[:, column] += axis
        J_p[:, column] += ca.cross(axis, p_F - p[body])
    ends = [
        p[shape.body] + R[shape.body] @ vertex
        for link in ("proximal", "middle", "distal")
        for shape in chain.shapes
        if shape.name == f"C_{finger.lower()}{link}"
        for vertex in shape.vertices
    ]
    knuckle = chain.p[chain.names.index(f"{finger.lower()}{'base' if finger == 'TH' else 'knuckle'}")]
    return FingerKinematics(
        ca.Function(f"tip_{finger}", [angles], [p_F, z_F, J_p, J_w]),
        ca.Function(f"links_{finger}", [angles], [ca.horzcat(*ends)]),
        knuckle,
    )


def _place(chain: Chain, finger: str, angles: ca.SX) -> tuple[dict[int, ca.SX], dict[int, ca.SX], dict[int, int]]:
    """Frames in H of the bodies from the palm to the fingertip, and the column of `angles` that turns each."""
    driven = [JOINTS[index] for index in finger_joints(finger)]
    p: dict[int, ca.SX] = {chain.palm: ca.SX.zeros(3)}
    R: dict[int, ca.SX] = {chain.palm: ca.SX.eye(3)}
    columns: dict[int, int] = {}
    for body, (parent, joint) in enumerate(zip(chain.parent, chain.joint, strict=True)):
        own = joint < 0 or JOINTS[joint] in HAND_FINGERS[finger]
        if parent not in p or not own:
            continue
        p[body] = p[parent] + R[parent] @ chain.p[body]
        R[body] = R[parent] @ chain.R[body]
        if joint >= 0:
            columns[body] = driven.index(COUPLED.get(JOINTS[joint], JOINTS[joint]))
            R[body] = R[body] @ _rotation(chain.axis[body], angles[columns[body]])
    return p, R, columns


def _rotation(axis: Array, angle: ca.SX) -> ca.SX:
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: ca.SX = ca.SX.eye(3) + ca.sin(angle) * K + (1 - ca.cos(angle)) * (K @ K)
    return turn
