"""What touches fingertips and tool, and how they move, from the simulator's own arrays: one kernel for each reading.

The simulator's routines take one call for each contact and body, and each of these arrays another.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from turnscrew.geometry.arrays import Array, Flags, Rows
from turnscrew.geometry.compiled import compiled

Numbers = NDArray[np.int32]


class Touches(NamedTuple):
    """Contacts.

    Attributes:
        geoms: (n, 2) which geoms touch.
        points: (n, 3) where, in W [m].
        forces: (n, 3) what the first puts on the second, in W [N].
    """

    geoms: Rows
    points: Array
    forces: Array


@compiled
def touches(
    geom: Numbers, frame: Array, pos: Array, address: Numbers, efc_force: Array, watched: Flags
) -> tuple[Rows, Array, Array]:
    """`Touches` in which a watched geom takes part.

    With elliptic cones the solver's forces are the contact's own: normal, then tangents, from `address` on.

    Args:
        geom: (n, 2) geoms of all contacts.
        frame: (n, 9) their frames, normal first, rows in W.
        pos: (n, 3) in W [m].
        address: (n,) where their forces stand; negative where a contact has none.
        efc_force: Forces of all constraints [N].
        watched: Which geoms count.
    """
    n = 0
    geoms, points, forces = np.empty((len(geom), 2), np.intp), np.empty((len(geom), 3)), np.zeros((len(geom), 3))
    for i in range(len(geom)):
        if watched[geom[i, 0]] or watched[geom[i, 1]]:
            geoms[n, 0], geoms[n, 1] = geom[i, 0], geom[i, 1]
            points[n] = pos[i]
            if address[i] >= 0:
                forces[n] = np.dot(efc_force[address[i] : address[i] + 3], np.ascontiguousarray(frame[i]).reshape(3, 3))
            n += 1
    return geoms[:n].copy(), points[:n].copy(), forces[:n].copy()


@compiled
def felt(geoms: Rows, forces: Array, row: Rows, xmat: Array, bodies: Rows) -> Array:
    """Force (k, 3) of each fingertip on whatever it touches, in its frame F [N].

    Args:
        geoms: As in `Touches`, and so are `forces`.
        forces: Of the contacts.
        row: Of each geom: the fingertip that it is, or -1.
        xmat: (b, 9) orientations of all bodies.
        bodies: (k,) the fingertips'.
    """
    f_W, f_F = np.zeros((len(bodies), 3)), np.zeros((len(bodies), 3))
    for i in range(len(geoms)):
        one, other = row[geoms[i, 0]], row[geoms[i, 1]]
        for j in range(3):
            if one >= 0:
                f_W[one, j] += forces[i, j]
            if other >= 0:
                f_W[other, j] -= forces[i, j]
    for k in range(len(bodies)):
        f_F[k] = np.dot(f_W[k], xmat[bodies[k]].reshape(3, 3))
    return f_F


@compiled
def on_tool(
    geoms: Rows, points: Array, forces: Array, row: Rows, is_tool: Flags, is_slot: Flags, p_WT: Array, R_WT: Array,
    least: float,
) -> tuple[Array, Array, Flags, Array]:  # fmt: skip
    """What acts on the tool.

    Args:
        geoms: As in `Touches`, and so are `points` and `forces`.
        points: Of the contacts.
        forces: Of the contacts.
        row: Of each geom: the fingertip that it is, or -1.
        is_tool: Which geoms are the tool's,
        is_slot: and which the slot's.
        p_WT: (3,) the tool's tip in W [m].
        R_WT: (3, 3) its orientation.
        least: Force from which on a fingertip counts as touching [N].

    Returns:
        f_W (5, 3) and c_W (5, 3) of the fingertips, which of them touch, and F_s (6,) in T, as in `Truth`.
    """
    f_W, c_W, wrench, F_s = np.zeros((5, 3)), np.full((5, 3), np.nan), np.zeros(6), np.zeros(6)
    for i in range(len(geoms)):
        sign, toucher = (-1.0, geoms[i, 1]) if is_tool[geoms[i, 0]] else (1.0, geoms[i, 0])
        if not (is_tool[geoms[i, 0]] or is_tool[geoms[i, 1]]):
            continue
        f, r = sign * forces[i], points[i] - p_WT
        if row[toucher] >= 0:
            f_W[row[toucher]] += f
            c_W[row[toucher]] = points[i]
        elif is_slot[toucher]:
            wrench[:3] += f
            wrench[3] += r[1] * f[2] - r[2] * f[1]
            wrench[4] += r[2] * f[0] - r[0] * f[2]
            wrench[5] += r[0] * f[1] - r[1] * f[0]
    touching = np.zeros(5, np.bool_)
    for k in range(5):
        touching[k] = sqrt(f_W[k, 0] ** 2 + f_W[k, 1] ** 2 + f_W[k, 2] ** 2) > least
    for i in range(3):
        for j in range(3):
            F_s[i] += R_WT[j, i] * wrench[j]
            F_s[3 + i] += R_WT[j, i] * wrench[3 + j]
    return f_W, c_W, touching, F_s


@compiled
def velocities(xpos: Array, cvel: Array, com: Array, bodies: Rows, roots: Rows) -> Array:
    """Velocities (k, 6) of bodies at their origins in W, linear first [m/s, rad/s].

    Args:
        xpos: (b, 3) origins of all bodies in W [m].
        cvel: (b, 6) their velocities, angular first, taken at the centre of mass of the tree that each belongs to.
        com: (b, 3) these centres, by the body at the root of a tree, in W [m].
        bodies: (k,) which bodies.
        roots: (k,) the roots of their trees.
    """
    V = np.empty((len(bodies), 6))
    for k in range(len(bodies)):
        b, r = cvel[bodies[k]], xpos[bodies[k]] - com[roots[k]]
        V[k, 0] = b[3] - (r[1] * b[2] - r[2] * b[1])
        V[k, 1] = b[4] - (r[2] * b[0] - r[0] * b[2])
        V[k, 2] = b[5] - (r[0] * b[1] - r[1] * b[0])
        V[k, 3], V[k, 4], V[k, 5] = b[0], b[1], b[2]
    return V
