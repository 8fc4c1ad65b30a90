"""Poses of a tool whose blade searches for its slot, and the twists that lead to them."""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.inverse_kinematics import rotation_vector

LEVER = 0.05
"""Length that turns an orientation's error into metres [m/rad]: 1.7 deg weigh as much as 1.5 mm of the tip."""


def leaning(corner: Array, heading: float, side: float, lean: float, half_width: float) -> tuple[Array, Array]:
    """Pose of a tool that leans along its edge, one corner lowest.

    Args:
        corner: (3,) where that corner is, in W [m].
        heading: Of the edge, from W's x axis [rad].
        side: 1 if it is the corner at +x of T, -1 if the other.
        lean: [rad].
        half_width: Of the blade [m].

    Returns:
        p_WT (3,) [m] and R_WT (3, 3).
    """
    R = exp_so3(np.array([0.0, 0.0, heading])) @ exp_so3(np.array([0.0, side * lean, 0.0]))
    return corner - R @ corner_T(side, half_width), R


def corner_T(side: float, half_width: float) -> Array:
    """(3,) a corner of the blade in T [m]; arguments as above."""
    return np.array([side * half_width, 0.0, 0.0])


def toward(
    now: tuple[Array, Array], wanted: tuple[Array, Array], rate: float, speed: float, turning: float
) -> tuple[Array, float]:
    """Twist that brings a tool from a pose to another, straight.

    Args:
        now: p_WT (3,) [m] and R_WT (3, 3).
        wanted: The same.
        rate: At which the error is removed [1/s].
        speed: Largest speed of the tip [m/s].
        turning: Largest rate of the orientation [rad/s].

    Returns:
        (6,) twist in W at the tip, linear first [m/s, rad/s], and the pose's error [m].
    """
    (p, R), (p_d, R_d) = now, wanted
    way, turn = p_d - p, rotation_vector(R_d @ R.T)
    V = rate * np.concatenate([way, turn])
    most = max(float(np.linalg.norm(V[:3])) / speed, float(np.linalg.norm(V[3:])) / turning, 1.0)
    return V / most, float(np.linalg.norm(way) + LEVER * np.linalg.norm(turn))


def seen_from(V: Array, p: Array, to: Array) -> Array:
    """A rigid body's twist (6,), linear first, at another point.

    Args:
        V: (6,) at p, in W [m/s, rad/s].
        p: (3,) in W [m].
        to: (3,) the other point [m].
    """
    return np.concatenate([V[:3] + np.cross(V[3:], to - p), V[3:]])
