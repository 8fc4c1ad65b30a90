"""Jacobians of the points at which the fingertips touch, by the driven joints, and how they change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from turnscrew.geometry.arrays import Array, Rows
from turnscrew.geometry.rotations import cross_rows
from turnscrew.robot.coupling import SELECTION

if TYPE_CHECKING:
    from turnscrew.robot.model import Dynamics, Fingertips

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
    J = tips.J[rows]
    r = c_W - tips.p_WF[rows]
    x, y, z = r[:, 0, None], r[:, 1, None], r[:, 2, None]
    A, B, C = J[:, 3], J[:, 4], J[:, 5]
    at = J[:, :3].copy()
    # J_v + J_omega x r
    at[:, 0] += B * z - C * y
    at[:, 1] += C * x - A * z
    at[:, 2] += A * y - B * x
    return np.asarray(at @ SELECTION)


def contact_bias(dynamics: Dynamics, v: Array, rows: Rows, c_W: Array, cdot_W: Array) -> Array:
    """`Jdot qdot` of (17): how the contact points' velocities change while no joint accelerates.

    With r = c - p_F the velocity is `v_F + omega_F x r`, so it changes by `a_F + alpha_F x r + omega_F x (cdot - v_F)`.

    Args:
        dynamics: Of the robot at q and v.
        v: (28,) joint speeds [rad/s].
        rows: (k,) which fingers.
        c_W: (k, 3) their contacts, in W [m].
        cdot_W: (k, 3) how fast the contacts travel in space, in W [m/s]: not with the fingertip, when they roll.

    Returns:
        (3k,) in W [m/s2].
    """
    tips = dynamics.tips
    V = tips.J[rows] @ v
    a = dynamics.Jdot_v[rows]
    r = c_W - tips.p_WF[rows]
    changes = a[:, :3] + cross_rows(a[:, 3:], r) + cross_rows(V[:, 3:], cdot_W - V[:, :3])
    return np.asarray(changes.ravel())
