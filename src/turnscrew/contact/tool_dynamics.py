"""Newton-Euler dynamics of the tool about its tip: M and C of (7) and (8)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import cross, skew

GRAVITY_W = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, slots=True)
class ToolInertia:
    """Mass properties of the screwdriver, as the robot believes them.

    Attributes:
        mass: [kg].
        com: (3,) centre of mass o in T [m].
        inertia: (3, 3) inertia about the centre of mass, axes of T [kg.m2].
        M: (6, 6) mass matrix of (7) about the origin of T, linear rows first: [m 1, -m [o]x; m [o]x, I - m [o]x [o]x].
    """

    mass: float
    com: Array
    inertia: Array
    M: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        o = skew(self.com)
        M = np.zeros((6, 6))
        M[:3, :3] = self.mass * np.eye(3)
        M[3:, :3] = self.mass * o
        M[:3, 3:] = -M[3:, :3]
        M[3:, 3:] = self.inertia - self.mass * (o @ o)
        object.__setattr__(self, "M", M)

    def bias(self, R_WT: Array, nu: Array) -> Array:
        """(6,) C of (7): fictitious forces and gravity, in T, force first [N, N.m].

        C = [ m (w x v + w x (w x o) - R^T g) ;  w x (I - m [o]x [o]x) w + m o x (w x v - R^T g) ].

        Args:
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T, linear first [m/s, rad/s].
        """
        v, omega = nu[:3], nu[3:]
        fall = cross(omega, v) - R_WT.T @ GRAVITY_W
        force = self.mass * (fall + cross(omega, cross(omega, self.com)))
        torque = cross(omega, self.M[3:, 3:] @ omega) + self.mass * cross(self.com, fall)
        return np.concatenate([force, torque])
