"""The grasp matrix and its inverse: from contact forces to the wrench on the tool and back, (15) and (16).

Two hard contacts cannot turn the tool about the line that joins them, so G has rank 5 and a wanted wrench may have
a part that no contact forces give.  `distribute` leaves that part out and returns it, rather than blow up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.errors import TurnscrewError
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled

LEAST_LEVER = 5e-4
"""Lever arm [m] below which a torque counts as unreachable.  Contacts are known to some 0.3 mm, and 0.01 N.m through
0.5 mm would already ask 20 N of a fingertip that should stay below 8 N."""


@dataclass(frozen=True, slots=True)
class Distribution:
    """Contact forces for a wanted wrench.

    Attributes:
        f_W: (k, 3) forces of the fingertips on the tool, in W [N]: the smallest that give the reachable part.
        lost: (6,) part of the wanted wrench that they do not give, about the tool's origin, in W [N, N.m].
    """

    f_W: Array
    lost: Array


@dataclass(frozen=True, slots=True)
class Grasp:
    """Hard contacts on the tool at one moment, with the pseudo-inverse worked out once.

    Attributes:
        G: (6, 3k) grasp matrix about the tool's origin, in W, force first: `F = G f`.
        inverse: (3k, 6) its pseudo-inverse, in the metric given to `grasp`.
        rank: 6 for three contacts or more off one line, 5 for two, 3 for one.
    """

    G: Array
    inverse: Array
    rank: int

    def wrench(self, f_W: Array) -> Array:
        """Wrench (6,) about the tool's origin, in W [N, N.m], of the fingertips' forces f_W (k, 3) on the tool [N].

        Paper: `diag[R, R] F_h = G (f_1; ...; f_k)`, III-B.
        """
        return self.G @ f_W.ravel()

    def velocities(self, V_WT: Array) -> Array:
        """Velocities (k, 3) [m/s] in W of the tool's points at the contacts, for its velocity V_WT (6,), linear first.

        Paper: `V = G^T R nu`, IV-C, with R standing for diag(R, R).
        """
        return (self.G.T @ V_WT).reshape(-1, 3)

    def distribute(self, F_W: Array) -> Distribution:
        """Smallest contact forces that give the tool a wrench, or the reachable part of it.

        Args:
            F_W: (6,) wanted wrench of the hand about the tool's origin, in W [N, N.m]: `diag(R, R) F_hd`.

        Returns:
            The forces, and what is lost.  With two contacts that is the torque about their line; how it is shared
            between force and torque at the tool's origin is the choice of metric made in `grasp`.

        Paper: (15).
        """
        f = self.inverse @ F_W
        return Distribution(f.reshape(-1, 3), F_W - self.G @ f)

    def internal(self, f_W: Array) -> Array:
        """Part (k, 3) of the forces f_W (k, 3) [N] that does no net wrench: `(I - G^+ G) f`.

        Paper: the second summand of (16).
        """
        f = f_W.ravel()
        return (f - self.inverse @ (self.G @ f)).reshape(-1, 3)


def grasp_matrix(c_W: Array, p_WT: Array) -> Array:
    """Grasp matrix `G = [I ... I; [c_1 - p]x ... [c_k - p]x]`.

    Args:
        c_W: (k, 3) contact points in W [m].
        p_WT: (3,) origin of the tool's frame in W [m].

    Returns:
        (6, 3k), force first, about the tool's origin, in W.

    Paper: G of III-B and IV-B, for hard contacts with friction.
    """
    k = len(c_W)
    G = np.zeros((6, 3 * k))
    for i, (x, y, z) in enumerate((c_W - p_WT).tolist()):
        j = 3 * i
        G[0, j] = G[1, j + 1] = G[2, j + 2] = 1.0
        G[3, j + 1], G[3, j + 2] = -z, y
        G[4, j], G[4, j + 2] = z, -x
        G[5, j], G[5, j + 1] = -y, x
    return G


@compiled
def weighted_grasp_matrix(c_W: Array, p_WT: Array, R_WT: Array, weights: Array) -> Array:
    """`W diag(R^T, R^T) G`: from contact forces in W to the weighted wrench on the tool in T.

    Args:
        c_W: (k, 3) contact points in W [m].
        p_WT: (3,) origin of the tool's frame in W [m].
        R_WT: (3, 3) orientation of the tool.
        weights: (6,) what a unit of force and of torque in T counts.

    Returns:
        (6, 3k), force first.
    """
    k = len(c_W)
    A = np.empty((6, 3 * k))
    for i in range(k):
        x, y, z = c_W[i, 0] - p_WT[0], c_W[i, 1] - p_WT[1], c_W[i, 2] - p_WT[2]
        for row in range(3):
            a, b, c = R_WT[0, row], R_WT[1, row], R_WT[2, row]
            force, torque = weights[row], weights[3 + row]
            A[row, 3 * i], A[row, 3 * i + 1], A[row, 3 * i + 2] = force * a, force * b, force * c
            # a row of R^T [r]x is the cross product of R's column with r
            A[3 + row, 3 * i] = torque * (b * z - c * y)
            A[3 + row, 3 * i + 1] = torque * (c * x - a * z)
            A[3 + row, 3 * i + 2] = torque * (a * y - b * x)
    return A


def grasp(c_W: Array, p_WT: Array, length: float = 1.0, share: Array | None = None) -> Grasp:
    """Grasp matrix and pseudo-inverse of hard contacts.

    `G^+ = (D G)^T (D G G^T D)^+ D` with D = diag(1, 1, 1, 1/length, ...).  At rank 6 the length drops out.  Below,
    the wrench that is realised is the one nearest to the wanted in `|force|^2 + |torque|^2 / length^2`: a small
    length keeps the torque and gives up force, a large one the other way round; 1 m is the plain pseudo-inverse in
    SI units, which for two contacts 0.13 m above the tip loses 0.13 N with every newton metre.

    Args:
        c_W: (k, 3) contact points in W [m], k >= 1.
        p_WT: (3,) origin of the tool's frame in W [m].
        length: What a newton is worth in newton metres when not all can be had [m].
        share: (k,) weight of each contact, 1 each by default: the forces are the smallest in
            `sum |f_i|^2 / share_i`, so a contact whose share goes to 0 hands its load over without a jump.

    Raises:
        TurnscrewError: there is no contact.

    Paper: G-dagger of (15) and (16).
    """
    if len(c_W) == 0:
        raise TurnscrewError("a grasp needs at least one contact; there is none")
    G = grasp_matrix(c_W, p_WT)
    scale = np.array([1.0, 1.0, 1.0, 1.0 / length, 1.0 / length, 1.0 / length])
    root = np.repeat(np.ones(len(c_W)) if share is None else np.sqrt(share), 3)
    scaled = scale[:, None] * G * root
    values, vectors = np.linalg.eigh(scaled @ scaled.T)
    kept = values > (LEAST_LEVER / length) ** 2
    V = vectors[:, kept]
    inverse = root[:, None] * (scaled.T @ (V / values[kept]) @ (V.T * scale))
    return Grasp(G, inverse, int(kept.sum()))


def squeeze(c_W: Array, i: int, j: int, newtons: float) -> Array:
    """Internal force of two contacts against each other, along the line that joins them.

    Args:
        c_W: (k, 3) contact points in W [m].
        i: Row of one contact.
        j: Row of the other, at another place.
        newtons: Magnitude [N]; positive presses together.

    Returns:
        (k, 3) forces of the fingertips on the tool, in W [N]; their net wrench is zero.

    Paper: the one-dimensional null space of G for two fingers, from which F_0 of (16) is taken.
    """
    f = np.zeros((len(c_W), 3))
    line = c_W[j] - c_W[i]
    f[i] = newtons / float(line @ line) ** 0.5 * line
    f[j] = -f[i]
    return f


def squeeze_all(c_W: Array, newtons: float) -> Array:
    """Internal force of all contacts towards their centroid: `f_i = newtons (m - c_i) / mean |m - c|`.

    For two contacts it is `squeeze`.  Forces and moments cancel whatever the number and places of contacts.

    Args:
        c_W: (k, 3) contact points in W [m], not all at one place.
        newtons: Mean magnitude [N].

    Returns:
        (k, 3) forces of the fingertips on the tool, in W [N]; their net wrench is zero.
    """
    inwards = c_W.mean(axis=0) - c_W
    distances: Array = np.sqrt((inwards * inwards).sum(axis=1))
    f: Array = newtons / float(distances.mean()) * inwards
    return f
