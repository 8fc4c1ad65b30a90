"""How contacts travel over fingertip and handle while they roll: equations (12)-(14) of the paper.

Opposed normals and no slip leave one velocity `a` of the contact over both surfaces.  Differentiating (14) ties it
to the relative angular velocity through the two shape operators (Montana's relative curvature form):

    (S_handle + S_tip) a = n x (omega_T - omega_F),    all in W, in the common tangent plane, n the handle's normal,

two equations for two unknowns.  They are the paper's 6 x 4 system with its redundancy taken out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.rotations import exp_so3, skew
from turnscrew.geometry.small import cross
from turnscrew.geometry.surfaces import SurfaceOfRevolution

SINGULAR = 1e-12
"""Least determinant of the relative curvature over its squared trace: two cylinders at 1e-6 rad from parallel."""

POLE = 1e-9
"""Distance from a fingertip's axis [m] below which its angle u says nothing."""


class Contact(NamedTuple):
    """One contact's parameters: (u, v) on the fingertip, (xi, eta) on the handle."""

    u: float
    v: float
    xi: float
    eta: float


class ContactRates(NamedTuple):
    """How fast a contact travels.

    Attributes:
        rates: (4,) of (u, v, xi, eta) [1/s].
        sweep_W: (3,) velocity of the contact over both surfaces, `R d/dt c' = R_i d/dt c`, in W [m/s].
        regular: False in a line contact or at a fingertip's pole, where the rates are the smallest of many.
    """

    rates: Array
    sweep_W: Array
    regular: bool


def rolling_system(
    handle: SurfaceOfRevolution, tip: SurfaceOfRevolution, contact: Contact, R_WT: Array, R_WF: Array
) -> tuple[Array, Array]:
    """The rolling equation `A (udot, xidot) = B (omega, omega_i)` as the paper states it.

    `A = [-R_i c_u, R c'_xi; R_i n_u, R n'_xi]`, `B = [0, 0; [R n']x R, [R_i n_i]x R_i]`.

    Args:
        handle: The handle's surface, in T.
        tip: The fingertip's surface, in F.
        contact: Parameters of the contact.
        R_WT: (3, 3) orientation of T in W.
        R_WF: (3, 3) orientation of F in W.

    Returns:
        A (6, 4), of rank 4 where the contact is regular, and B (6, 6), for omega in T and omega_i in F [rad/s].

    Paper: the equation under (14), with u on the fingertip and xi on the handle, as their definitions in III-A say;
        as printed the two are exchanged.
    """
    u, v, xi, eta = contact
    A, B = np.empty((6, 4)), np.zeros((6, 6))
    A[:3, :2] = -R_WF @ tip.tangents(u, v)
    A[:3, 2:] = R_WT @ handle.tangents(xi, eta)
    A[3:, :2] = R_WF @ tip.normal_derivatives(u, v)
    A[3:, 2:] = R_WT @ handle.normal_derivatives(xi, eta)
    B[3:, :3] = skew(R_WT @ handle.normal(xi, eta)) @ R_WT
    B[3:, 3:] = skew(R_WF @ tip.normal(u, v)) @ R_WF
    return A, B


def contact_rates(
    handle: SurfaceOfRevolution,
    tip: SurfaceOfRevolution,
    contact: Contact,
    R_WT: Array,
    omega_T: Array,
    R_WF: Array,
    omega_F: Array,
) -> ContactRates:
    """Rates of the contact's parameters from the angular velocities of tool and fingertip.

    Args:
        handle: The handle's surface, in T.
        tip: The fingertip's surface, in F.
        contact: Parameters of a contact that satisfies (14).
        R_WT: (3, 3) orientation of T in W.
        omega_T: (3,) angular velocity of the tool in W, expressed in T [rad/s].
        R_WF: (3, 3) orientation of F in W.
        omega_F: (3,) angular velocity of the fingertip in W, expressed in F [rad/s].

    Returns:
        The rates, the solution of `rolling_system`.

    Paper: the equation under (14), solved in the tangent plane.
    """
    on_tip, on_handle = tip.local_geometry(contact.u, contact.v), handle.local_geometry(contact.xi, contact.eta)
    e1, e2 = R_WT @ on_handle.t_u, R_WT @ on_handle.t_v
    s1, s2 = R_WF @ on_tip.t_u, R_WF @ on_tip.t_v
    spin = R_WT @ omega_T - R_WF @ omega_F
    q11, q12, q21, q22 = float(e1 @ s1), float(e1 @ s2), float(e2 @ s1), float(e2 @ s2)
    k1, k2 = on_tip.curvature_u, on_tip.curvature_v
    m11 = on_handle.curvature_u + k1 * q11 * q11 + k2 * q12 * q12
    m22 = on_handle.curvature_v + k1 * q21 * q21 + k2 * q22 * q22
    m12 = k1 * q11 * q21 + k2 * q12 * q22
    a1, a2, regular = _solve_symmetric(m11, m12, m22, -float(e2 @ spin), float(e1 @ spin))
    if on_tip.speed_u > POLE:
        u_rate = (q11 * a1 + q21 * a2) / on_tip.speed_u
    else:
        u_rate, regular = 0.0, False
    v_rate = (q12 * a1 + q22 * a2) / on_tip.speed_v
    rates = np.array([u_rate, v_rate, a1 / on_handle.speed_u, a2 / on_handle.speed_v])
    return ContactRates(rates, a1 * e1 + a2 * e2, regular)


def roll(
    handle: SurfaceOfRevolution,
    tip: SurfaceOfRevolution,
    contact: Contact,
    R_WT: Array,
    omega_T: Array,
    R_WF: Array,
    omega_F: Array,
    dt: float,
) -> Contact:
    """The contact a step later, by the midpoint rule with both angular velocities held in their own frames.

    The error of a step is of third order in the way travelled: at 1 rad/s and 4 ms some 1e-10 m, and 1e-6 m at worst
    where the contact runs fastest, on axes within 20 deg of parallel or next to a fingertip's pole.

    Args:
        handle: The handle's surface, in T.
        tip: The fingertip's surface, in F.
        contact: Parameters at the start of the step.
        R_WT: (3, 3) orientation of T in W at the start.
        omega_T: (3,) angular velocity of the tool, expressed in T [rad/s].
        R_WF: (3, 3) orientation of F in W at the start.
        omega_F: (3,) angular velocity of the fingertip, expressed in F [rad/s].
        dt: Length of the step [s].

    Returns:
        Parameters at the end.

    Paper: "the contact points on both surfaces are updated by integrating", IV-B.
    """
    half = 0.5 * dt
    first = contact_rates(handle, tip, contact, R_WT, omega_T, R_WF, omega_F)
    middle = Contact(*(np.array(contact) + half * first.rates).tolist())
    R_WT_middle, R_WF_middle = R_WT @ exp_so3(half * omega_T), R_WF @ exp_so3(half * omega_F)
    second = contact_rates(handle, tip, middle, R_WT_middle, omega_T, R_WF_middle, omega_F)
    return Contact(*(np.array(contact) + dt * second.rates).tolist())


def closure(
    handle: SurfaceOfRevolution,
    tip: SurfaceOfRevolution,
    contact: Contact,
    p_WT: Array,
    R_WT: Array,
    p_WF: Array,
    R_WF: Array,
) -> tuple[Array, Array]:
    """How far a contact is from closed: `p + R c' - p_i - R_i c_i` and `R n' + R_i n_i`, both zero when it is.

    Args:
        handle: The handle's surface, in T.
        tip: The fingertip's surface, in F.
        contact: Parameters of the contact.
        p_WT: (3,) origin of T in W [m].
        R_WT: (3, 3) orientation of T in W.
        p_WF: (3,) origin of F in W [m].
        R_WF: (3, 3) orientation of F in W.

    Returns:
        (3,) offset of the two points in W [m] and (3,) sum of the two outward normals in W.

    Paper: (12), and (14) with the prime on the handle's normal that is missing in print.
    """
    u, v, xi, eta = contact
    offset = p_WT + R_WT @ handle.point(xi, eta) - p_WF - R_WF @ tip.point(u, v)
    return offset, R_WT @ handle.normal(xi, eta) + R_WF @ tip.normal(u, v)


@compiled
def slip_velocity(c_W: Array, p_WT: Array, V_WT: Array, p_WF: Array, V_WF: Array) -> Array:
    """Velocity of the handle's material point at a contact relative to the fingertip's: zero while it rolls.

    Args:
        c_W: (3,) contact in W [m].
        p_WT: (3,) origin of T in W [m].
        V_WT: (6,) velocity of T in W, linear first [m/s, rad/s].
        p_WF: (3,) origin of F in W [m].
        V_WF: (6,) velocity of F in W, linear first [m/s, rad/s].

    Returns:
        (3,) in W [m/s].

    Paper: (13), left minus right side.
    """
    slip: Array = V_WT[:3] + cross(V_WT[3:], c_W - p_WT) - V_WF[:3] - cross(V_WF[3:], c_W - p_WF)
    return slip


def _solve_symmetric(m11: float, m12: float, m22: float, b1: float, b2: float) -> tuple[float, float, bool]:
    """Solution of the symmetric 2 x 2 system; the smallest one where the matrix has rank 1 (M^+ = M / trace^2)."""
    determinant, trace = m11 * m22 - m12 * m12, m11 + m22
    if abs(determinant) > SINGULAR * trace * trace:
        return (m22 * b1 - m12 * b2) / determinant, (m11 * b2 - m12 * b1) / determinant, True
    square = trace * trace
    if square == 0.0:
        return 0.0, 0.0, False
    return (m11 * b1 + m12 * b2) / square, (m12 * b1 + m22 * b2) / square, False
