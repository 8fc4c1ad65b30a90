"""Newton-Euler dynamics of the tool about its tip: M and C of (7) and (8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import skew

GRAVITY_W = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, slots=True)
class ToolInertia:
    """Mass properties of the screwdriver, as the robot believes them.

    Attributes:
        mass: [kg].
        com: (3,) centre of mass o in T [m].
        inertia: (3, 3) inertia about the centre of mass, axes of T [kg.m2].
    """

    mass: float
    com: Array
    inertia: Array

    def mass_matrix(self) -> Array:
        """(6, 6) M of (7), about the origin of T, linear rows first: [m 1, -m [o]x; m [o]x, I - m [o]x [o]x]."""
        o = self.mass * skew(self.com)
        return np.block([[self.mass * np.eye(3), -o], [o, self.inertia_at_tip()]])

    def inertia_at_tip(self) -> Array:
        """(3, 3) I - m [o]x [o]x, the inertia about the origin of T [kg.m2]."""
        o = skew(self.com)
        return self.inertia - self.mass * (o @ o)

    def bias(self, R_WT: Array, nu: Array) -> Array:
        """(6,) C of (7): fictitious forces and gravity, in T, force first [N, N.m].

        C = [ m (w x v + w x (w x o) - R^T g) ;  w x (I - m [o]x [o]x) w + m o x (w x v - R^T g) ].

        Args:
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T, linear first [m/s, rad/s].
        """
        v, W = nu[:3], skew(nu[3:])
        fall = W @ v - R_WT.T @ GRAVITY_W
        force = self.mass * (fall + W @ (W @ self.com))
        torque = W @ (self.inertia_at_tip() @ nu[3:]) + self.mass * (skew(self.com) @ fall)
        return np.concatenate([force, torque])
