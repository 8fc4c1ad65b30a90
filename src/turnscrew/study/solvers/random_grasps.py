"""Grasps of a handle drawn at random, with known truth, as frames of the pose problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.estimate.pose_problem import UNIT, PoseFrame
from turnscrew.estimate.pose_refine import Guess
from turnscrew.estimate.pose_solution import Multipliers
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.rotations import exp_so3, matrix_from_quaternion, quaternion_from_matrix
from turnscrew.geometry.surfaces import SurfaceOfRevolution

TIP = Capsule(0.00705, 0.024)
"""Patch of a finger's tip, which stands for all fingertips."""

RADII = np.array([0.00918, 0.00705, 0.00705, 0.00705])
"""Of thumb and fingers [m]."""


@dataclass(frozen=True)
class Grasp:
    """A grasp with known truth, and what was seen of it.

    Attributes:
        p_WT: (3,) true tip position in W [m].
        R_WT: (3, 3) true orientation.
        xi: (k, 2) true contact parameters on the handle's patch.
        uv: (k, 2) on the fingertips' patches.
        frame: The data: orientation seen, fingertips, predicted contacts.
    """

    p_WT: Array
    R_WT: Array
    xi: Array
    uv: Array
    frame: PoseFrame

    def guess(self, multipliers: Multipliers | None = None) -> Guess:
        """The start at the true tip, the orientation seen and the predicted contacts."""
        return Guess(self.p_WT, matrix_from_quaternion(self.frame.r_bar), self.frame.xi, self.uv, multipliers)


def aligning(a: Array, b: Array, spin: float) -> Array:
    """A rotation (3, 3) that takes the unit vector a to b, one of the circle of them."""
    axis = np.cross(a, b)
    turn = exp_so3(axis / np.linalg.norm(axis) * np.arccos(np.clip(a @ b, -1.0, 1.0)))
    return exp_so3(spin * b) @ turn


def drawn_grasp(handle: SurfaceOfRevolution, k: int, rng: Generator, noise: float) -> Grasp:
    """A grasp by k fingertips in exact contact, 140 mm above the tip, from alternate sides.

    Args:
        handle: Patch of the handle, a length as its second parameter.
        k: Number of contacts, four at most.
        rng: What is drawn comes from here.
        noise: Of the orientation seen, per axis [rad].
    """
    R = exp_so3(np.array([*rng.normal(0.0, 0.02, 2), rng.uniform(-3.0, 3.0)]))
    p = np.array([1.0, 0.0, 0.2]) + rng.normal(0.0, 0.01, 3)
    xi = np.column_stack([np.arange(k) * np.pi + rng.normal(0.0, 0.2, k), 0.14 + rng.normal(0.0, 0.008, k)])
    uv = np.column_stack([rng.uniform(-2.0, 2.0, k), rng.uniform(-0.6, 0.8, k)])
    p_F, R_F = np.zeros((k, 3)), np.zeros((k, 3, 3))
    for i in range(k):
        tip = Capsule(RADII[i], TIP.length * RADII[i] / TIP.radius)
        R_F[i] = aligning(tip.normal(*uv[i]), -R @ handle.normal(*xi[i]), rng.uniform(-1.0, 1.0))
        p_F[i] = p + R @ handle.point(*xi[i]) - R_F[i] @ tip.point(*uv[i])
    seen = quaternion_from_matrix(exp_so3(rng.normal(0.0, noise, 3)) @ R)
    predicted = xi + rng.normal(0.0, 0.003, (k, 2)) * [1.0, UNIT]
    frame = PoseFrame(p + rng.normal(0.0, 1e-4, 3), seen, p_F, R_F, RADII[:k], 0.0, predicted)
    return Grasp(p, R, xi, uv, frame)
