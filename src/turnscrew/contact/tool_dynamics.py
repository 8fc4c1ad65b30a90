"""Newton-Euler dynamics of the tool about its tip: M and C of (7) and (8)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.rotations import skew
from turnscrew.geometry.small import cross

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
        return _bias(self.mass, self.com, self.M, R_WT, nu)

    def wrench(self, R_WT: Array, nu: Array, alpha: Array) -> Array:
        """(6,) `M alpha + C`: wrench of all that touches the tool, for a motion; in T, force first [N, N.m].

        Args:
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T, linear first [m/s, rad/s].
            alpha: (6,) its rate of change [m/s2, rad/s2].

        Paper: the right side of (7).
        """
        return tool_wrench(self.mass, self.com, self.M, R_WT, nu, alpha)


@compiled
def _bias(mass: float, com: Array, M: Array, R_WT: Array, nu: Array) -> Array:
    v, omega = nu[:3], nu[3:]
    fall = cross(omega, v)
    spin = np.zeros(3)
    for i in range(3):
        for j in range(3):
            fall[i] -= R_WT[j, i] * GRAVITY_W[j]
            spin[i] += M[3 + i, 3 + j] * omega[j]
    force = mass * (fall + cross(omega, cross(omega, com)))
    return np.concatenate((force, cross(omega, spin) + mass * cross(com, fall)))


@compiled
def tool_wrench(mass: float, com: Array, M: Array, R_WT: Array, nu: Array, alpha: Array) -> Array:
    """`ToolInertia.wrench`, for compiled functions to call."""
    F = _bias(mass, com, M, R_WT, nu)
    for i in range(6):
        for j in range(6):
            F[i] += M[i, j] * alpha[j]
    return F
