"""How contact points have to move for the tool to move as wanted: the right side of (17), and `G^T R nu`."""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import cross


@compiled
def contact_velocities(c_W: Array, p_WT: Array, R_WT: Array, nu: Array) -> Array:
    """`G^T R nu`: velocities of the tool's points at the contacts, with R for diag(R, R).

    Args:
        c_W: (k, 3) contacts in W [m].
        p_WT: (3,) origin of T in W [m].
        R_WT: (3, 3) orientation of T.
        nu: (6,) velocity of T in T, linear first [m/s, rad/s].

    Returns:
        (k, 3) in W [m/s].

    Paper: IV-C.
    """
    v, omega = np.dot(R_WT, nu[:3]), np.dot(R_WT, nu[3:])
    V = np.empty(c_W.shape)
    for i in range(len(c_W)):
        V[i] = v + cross(omega, c_W[i] - p_WT)
    return V


@compiled
def contact_accelerations(c_W: Array, cdot_W: Array, p_WT: Array, R_WT: Array, nu: Array, alpha: Array) -> Array:
    """`G^T R nudot + G^T Rdot nu + Gdot^T R nu` of (17), with R for diag(R, R).

    The tool's velocity at a contact c is `v + omega x (c - p)`, in W; here is its rate of change, with a contact that
    travels in space at `cdot`.

    Args:
        c_W: (k, 3) contacts in W [m].
        cdot_W: (k, 3) how fast they travel in space, in W [m/s].
        p_WT: (3,) origin of T in W [m].
        R_WT: (3, 3) orientation of T.
        nu: (6,) velocity of T in T, linear first [m/s, rad/s].
        alpha: (6,) its rate of change in T, linear first: the servo's, or the true one [m/s2, rad/s2].

    Returns:
        (3k,) in W [m/s2].

    Paper: (17), with the servo's alpha for nudot as IV-C says.
    """
    v, omega = np.dot(R_WT, nu[:3]), np.dot(R_WT, nu[3:])
    a, domega = np.dot(R_WT, alpha[:3]) + cross(omega, v), np.dot(R_WT, alpha[3:])
    changes = np.empty(c_W.shape)
    for i in range(len(c_W)):
        changes[i] = a + cross(domega, c_W[i] - p_WT) + cross(omega, cdot_W[i] - v)
    return changes.ravel()
