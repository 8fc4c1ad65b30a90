"""Jacobians of the points at which the fingertips touch, by the driven joints, and how they change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from turnscrew.geometry.arrays import Array, Rows
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import cross
from turnscrew.robot.body_jacobians import contact_rows
from turnscrew.robot.coupling import DRIVE_OF_JOINT, SELECTION

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

ALL = slice(None)


def contact_jacobian(tips: Fingertips, rows: Rows, c_W: Array) -> Array:
    """J of (17): velocities of the fingertips' material points at the contacts, by the driven joints.

    Args:
        tips: Fingertips.
        rows: (k,) which fingers.
        c_W: (k, 3) their contacts, in W [m].

    Returns:
        (3k, 24), three rows a finger, in W.
    """
    return contact_jacobians(tips, c_W, rows).reshape(-1, SELECTION.shape[1])


def contact_jacobians(tips: Fingertips, c_W: Array, rows: Rows | slice = ALL) -> Array:
    """The same for all fingers or some, apart: (k, 3, 24)."""
    return contact_rows(tips.J[rows], tips.p_WF[rows], c_W, DRIVE_OF_JOINT, SELECTION.shape[1])


@compiled
def contact_bias(J: Array, Jdot_v: Array, p_WF: Array, v: Array, c_W: Array, cdot_W: Array) -> Array:
    """`Jdot qdot` of (17): how the contact points' velocities change while no joint accelerates.

    With r = c - p_F the velocity is `v_F + omega_F x r`, so it changes by `a_F + alpha_F x r + omega_F x (cdot - v_F)`.

    Args:
        J: (k, 6, 28) Jacobians of the fingertips' frames, linear first, in W.
        Jdot_v: (k, 6) what these frames accelerate by while no joint does, in W [m/s2, rad/s2].
        p_WF: (k, 3) their origins in W [m].
        v: (28,) joint speeds [rad/s].
        c_W: (k, 3) contacts in W [m].
        cdot_W: (k, 3) how fast the contacts travel in space, in W [m/s]: not with the fingertip, when they roll.

    Returns:
        (3k,) in W [m/s2].
    """
    changes = np.empty(c_W.shape)
    for i in range(len(c_W)):
        V, a = np.dot(J[i], v), Jdot_v[i]
        changes[i] = a[:3] + cross(a[3:], c_W[i] - p_WF[i]) + cross(V[3:], cdot_W[i] - V[:3])
    return changes.ravel()
