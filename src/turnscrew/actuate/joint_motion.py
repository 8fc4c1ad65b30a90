"""Which joints move the contacts: (17) with the inverse that costs the least effort, the rest of the joints free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import solve_positive


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Contact motions to joint motions, worked out once for a state of the robot.

    `inverse = M^-1 J^T (J M^-1 J^T)^-1`, the dynamically consistent inverse (Khatib, 1987): light joints move more than
    heavy ones, and what the others do in its null space, `1 - inverse J`, disturbs no contact.

    Attributes:
        J: (m, n) velocities of the contact points by the joints.
        inverse: (n, m).
    """

    J: Array
    inverse: Array

    @classmethod
    def of(cls, M: Array, J: Array) -> JointMotion:
        """The inverse of J (m, n), of full rank, for the mass matrix M (n, n) [kg.m2]."""
        return cls(J, _consistent_inverse(M, J))

    def accelerations(self, a: Array, rest: Array) -> Array:
        """Joint accelerations under which the contacts accelerate as wanted.

        Args:
            a: (m,) `G^T R alpha + G^T Rdot nu + Gdot^T R nu - Jdot qdot`, in W [m/s2].
            rest: (n,) accelerations that the joints should have where the contacts leave them free [rad/s2].

        Returns:
            (n,) [rad/s2].

        Paper: (17).  Departures: the dynamically consistent inverse for the pseudo-inverse, which moves the arm as
            gladly as a finger and lets the wrist drift until round 4 fails (found by trial); and `rest` in its null
            space, without which 22 of 28 joints do as they like.
        """
        return _with_the_rest(self.inverse, self.J, a, rest)

    def speeds(self, V: Array, rest: Array) -> Array:
        """Joint speeds (n,) [rad/s] that roll on contacts moving at V (m,) [m/s], `rest` where they leave freedom.

        Paper: `J qdot = G^T R nu`, IV-C.
        """
        return _with_the_rest(self.inverse, self.J, V, rest)


@compiled
def _consistent_inverse(M: Array, J: Array) -> Array:
    spread = solve_positive(M, np.ascontiguousarray(J.T))
    inverse: Array = solve_positive(np.dot(J, spread), np.ascontiguousarray(spread.T)).T.copy()
    return inverse


@compiled
def _with_the_rest(inverse: Array, J: Array, wanted: Array, rest: Array) -> Array:
    motion: Array = rest + np.dot(inverse, wanted - np.dot(J, rest))
    return motion
