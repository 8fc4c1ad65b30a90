"""Joint torques of arm and hand, (17) and (18), for a robot that takes them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.actuate.joint_motion import consistent_inverse, joint_accelerations, joint_speeds
from turnscrew.actuate.postures import CARRIERS, Posture, Postures
from turnscrew.actuate.stops import Stops
from turnscrew.contact.rolling_motion import contact_accelerations, contact_velocities
from turnscrew.geometry.arrays import Array, Flags, Rows
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.contact_jacobian import contact_bias
from turnscrew.robot.coupling import SELECTION
from turnscrew.robot.model import RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.signals import GRIP, Command, Effort, Estimate, Goal

STOP = 10.0
"""Stiffness of the soft stops [N.m/rad]: 100 rad/s on a finger's .001 kg.m2.  Between two ticks joints are read 40 deg
late at that rate, which takes .06 N.m.s/rad of a joint's .1 of damping; with 15 N.m/rad it shakes."""


@dataclass(frozen=True)
class TorqueAdapter:
    """Turns wanted accelerations of the tool and contact forces into the drives' torques.

    Fingers that grip are under force control: their contacts accelerate with the tool (17) and press as told (18).  All
    other joints are held to postures, in the null space of the contacts where these need them.  A finger changes from
    one to the other while it presses with next to nothing (`Goal.share`), so the change is no jump of force.

    Attributes:
        robot: Kinematics, dynamics and limits.
        palm_weight: Inertia of arm and wrist that the inverse of (17) counts with, over the true one.  With the true
            one the wrist, lighter than the fingers' inertia at the handle, follows every fast roll by a degree, until
            the ring finger meets the middle one (found by trial).  The contacts accelerate as wanted whatever the
            weight: the fingers alone then see to it.
        postures: Impedance of the joints that do not carry the tool.
        stops: Before the limits of the fingers' joints.
    """

    robot: RobotModel
    palm_weight: float = 100.0
    postures: Postures = field(init=False)
    stops: Stops = field(init=False)
    _damping: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_damping", self.robot.damping @ SELECTION)
        object.__setattr__(self, "postures", Postures(self.robot.limits))
        object.__setattr__(self, "stops", Stops(self.robot.limits, STOP))

    def init(self, q: Array) -> Posture:
        """Postures begin where the joints are: angles (28,) [rad]."""
        return self.postures.init(q)

    def update(
        self, state: Posture, goal: Goal, effort: Effort, estimate: Estimate, dt: float
    ) -> tuple[Posture, Command]:
        """One beat.

        With `q = S q_d` for the driven joints and `rate` their wanted speeds,

            tau = S^T M_r S qddot + S^T (C_r qdot + N) + J^T F + S^T D S rate.

        The joints' damping D is compensated at the wanted speed and not at the measured one: it then brakes whatever is
        not wanted, and no noise of an encoder is fed back.

        Args:
            state: Of the last beat.
            goal: Roles and postures of the fingers, motion of the palm.
            effort: The servo's acceleration, wanted speed and contact forces.
            estimate: Joints, tool and contacts.
            dt: Time since the last beat [s].

        Returns:
            The new state, and the torques, each within its drive's limit; `saturated` tells which had to be cut.

        Paper: (18) with (17) and the two replacements of IV-C: the servo's alpha for the tool's acceleration, the
            wanted contact forces for the sensed ones.
        """
        dynamics = self.robot.dynamics(estimate.q, estimate.v)
        state, qddot = self.postures.update(state, goal, dynamics, estimate.q, estimate.v, dt)
        J, tips = self.robot.contact_jacobians(estimate.q, estimate.v, estimate.c_W), dynamics.tips
        tau, saturated = _torques(
            dynamics.M, dynamics.bias, self._damping, J, tips.J, dynamics.Jdot_v, tips.p_WF, goal.roles, estimate.v,
            estimate.c_W, estimate.p_WT, estimate.R_WT, estimate.nu, effort.nu_d, effort.alpha, effort.f_W, qddot,
            state.rate, self.palm_weight, DRIVE_LIMITS,
        )  # fmt: skip
        tau = np.clip(tau + self.stops.pushed_back(estimate.q, estimate.v), -DRIVE_LIMITS, DRIVE_LIMITS)
        return state, Command(None, saturated, tau)


@compiled
def _torques(
    M: Array, bias: Array, damping: Array, J: Array, J_tips: Array, Jdot_v: Array, p_WF: Array, roles: Rows, v: Array,
    c_W: Array, p_WT: Array, R_WT: Array, nu: Array, nu_d: Array, alpha: Array, f_W: Array, qddot: Array, rate: Array,
    palm_weight: float, limits: Array,
) -> tuple[Array, Flags]:  # fmt: skip
    """(17) and (18): torques (24,) within the drives' limits [N.m], and which had to be cut.

    J (5, 3, 24) has the contacts' Jacobians, J_tips (5, 6, 28), Jdot_v (5, 6) and p_WF (5, 3) tell of the fingertips'
    frames, `qddot` and `rate` (24,) of the postures, and the rest is as the messages have it.
    """
    rows = np.flatnonzero(roles == GRIP)
    if len(rows):
        tau = _carrying(
            M, bias, damping, J, J_tips, Jdot_v, p_WF, rows, v, c_W, p_WT, R_WT, nu, nu_d, alpha, f_W, qddot, rate,
            palm_weight,
        )  # fmt: skip
    else:
        tau = bias + np.dot(M, qddot) + damping * rate
    within = np.minimum(np.maximum(tau, -limits), limits)
    return within, tau != within


@compiled
def _carrying(
    M: Array, bias: Array, damping: Array, J: Array, J_tips: Array, Jdot_v: Array, p_WF: Array, rows: Rows, v: Array,
    c_W: Array, p_WT: Array, R_WT: Array, nu: Array, nu_d: Array, alpha: Array, f_W: Array, qddot: Array, rate: Array,
    palm_weight: float,
) -> Array:  # fmt: skip
    """Torques (24,) [N.m] while the fingers in `rows` carry the tool; arguments as for `_torques`."""
    J_c, c = J[rows].reshape(-1, len(M)), c_W[rows]
    # a contact travels with the tool and over it; over it by a few mm/s, whose effect on (17) is below 1 % of alpha
    cdot = contact_velocities(c, p_WT, R_WT, nu)
    a = contact_accelerations(c, cdot, p_WT, R_WT, nu, alpha)
    a = a - contact_bias(J_tips[rows], Jdot_v[rows], p_WF[rows], v, c, cdot)
    V = contact_velocities(c, p_WT, R_WT, nu_d).ravel()
    heavy = M.copy()
    for i in range(CARRIERS):
        heavy[i, i] *= palm_weight
    inverse = consistent_inverse(heavy, J_c)
    qddot, rate = joint_accelerations(inverse, J_c, a, qddot), joint_speeds(inverse, J_c, V, rate)
    tau: Array = bias + np.dot(M, qddot) + np.dot(f_W[rows].ravel(), J_c) + damping * rate
    return tau
