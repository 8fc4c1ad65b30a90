"""Which joints move the contacts: (17) with the inverse that costs the least effort, the rest of the joints free."""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import solve_positive


@compiled
def consistent_inverse(M: Array, J: Array) -> Array:
    """The dynamically consistent inverse `M^-1 J^T (J M^-1 J^T)^-1` (Khatib, 1987).

    Light joints move more than heavy ones, and what the others do in its null space, `1 - inverse J`, disturbs no
    contact.

    Args:
        M: (n, n) mass matrix, or another that tells how dear each joint's motion is [kg.m2].
        J: (m, n) velocities of the contact points by the joints, of full rank.

    Returns:
        (n, m).
    """
    spread = solve_positive(M, J.T.copy())
    inverse: Array = solve_positive(np.dot(J, spread), spread.T.copy()).T.copy()
    return inverse


@compiled
def joint_accelerations(inverse: Array, J: Array, a: Array, rest: Array) -> Array:
    """Joint accelerations under which the contacts accelerate as wanted.

    Args:
        inverse: (n, m) of J, by `consistent_inverse`.
        J: (m, n) velocities of the contact points by the joints.
        a: (m,) `G^T R alpha + G^T Rdot nu + Gdot^T R nu - Jdot qdot`, in W [m/s2].
        rest: (n,) accelerations that the joints should have where the contacts leave them free [rad/s2].

    Returns:
        (n,) [rad/s2].

    Paper: (17).  Departures: the dynamically consistent inverse for the pseudo-inverse, which moves the arm as gladly
        as a finger and lets the wrist drift until round 4 fails (found by trial); and `rest` in its null space, without
        which 22 of 28 joints do as they like.
    """
    wanted: Array = rest + np.dot(inverse, a - np.dot(J, rest))
    return wanted


@compiled
def joint_speeds(inverse: Array, J: Array, V: Array, rest: Array) -> Array:
    """Joint speeds (n,) [rad/s] that roll on contacts moving at V (m,) [m/s], `rest` (n,) where they leave freedom.

    Arguments else as for `joint_accelerations`.

    Paper: `J qdot = G^T R nu`, IV-C.
    """
    wanted: Array = rest + np.dot(inverse, V - np.dot(J, rest))
    return wanted
