"""Coulomb cones of the contacts: are forces inside, by what margin, and how much squeeze brings them inside.

Normals are the handle's outward ones, so a fingertip presses with `f_n = -n . f`; a force is inside its cone
when its tangential part is at most mu f_n.
"""

from __future__ import annotations

from math import cos, inf, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.compiled import compiled

EMPTY = (inf, -inf)
"""The interval without a point."""

DUST = 1e-9
"""Force [N] that counts as none at a contact which takes no part in the squeeze."""


def split(f_W: Array, n_W: Array) -> tuple[Array, Array]:
    """Normal and tangential parts of contact forces.

    Args:
        f_W: (k, 3) forces of the fingertips on the tool, in W [N].
        n_W: (k, 3) handle's outward unit normals, in W.

    Returns:
        (k,) pressing force `f_n = -n . f` [N] and (k,) magnitude of the rest [N].
    """
    pressing = -(f_W * n_W).sum(axis=1)
    along = f_W + pressing[:, None] * n_W
    return pressing, np.sqrt((along * along).sum(axis=1))


def cone_margin(f_W: Array, n_W: Array, mu: float | Array) -> Array:
    """By how much each contact force is inside its cone: `mu f_n - |f_t|`, (k,) [N]; negative outside.

    Args:
        f_W: (k, 3) forces of the fingertips on the tool, in W [N].
        n_W: (k, 3) handle's outward unit normals, in W.
        mu: Coefficient of friction, one for all or (k,).
    """
    return margins(np.ascontiguousarray(f_W), np.ascontiguousarray(n_W), mu * np.ones(len(n_W)))


@compiled
def margins(f_W: Array, n_W: Array, mu: Array) -> Array:
    """`cone_margin` of contacts that each have a coefficient mu (k,) of their own; contiguous arrays only."""
    inside = np.empty(len(n_W))
    for i in range(len(n_W)):
        pressing = -(f_W[i, 0] * n_W[i, 0] + f_W[i, 1] * n_W[i, 1] + f_W[i, 2] * n_W[i, 2])
        x, y, z = f_W[i, 0] + pressing * n_W[i, 0], f_W[i, 1] + pressing * n_W[i, 1], f_W[i, 2] + pressing * n_W[i, 2]
        inside[i] = mu[i] * pressing - sqrt(x * x + y * y + z * z)
    return inside


def in_cone(f_W: Array, n_W: Array, mu: float) -> Flags:
    """Whether each contact force is inside its cone or on it, (k,); arguments as for `cone_margin`."""
    return cone_margin(f_W, n_W, mu) >= 0.0


@compiled
def polyhedral_cones(n_W: Array, mu: Array, sides: int = 8) -> Array:
    """Rows of inner pyramids: `rows_i @ f_i <= 0` implies that f_i is inside the cone of n_i and mu_i.

    `rows_ij = t_ij + mu_i cos(pi / sides) n_i`, with unit tangents t_ij at equal angles: the polygon is inscribed in
    the circle.  Eight sides give away at most 1 - cos(pi / 8) = 7.6 % of the friction.

    Args:
        n_W: (k, 3) handle's outward unit normals, in W.
        mu: (k,) coefficients of friction.
        sides: Number of faces, at least 3.

    Returns:
        (k, sides, 3).
    """
    k = len(n_W)
    rows = np.empty((k, sides, 3))
    turn = 2.0 * pi / sides
    for i in range(k):
        n = n_W[i]
        t1, t2 = np.zeros(3), np.empty(3)
        # the axis least along n, so the two tangents are well apart from it
        axis = np.abs(n).argmin()
        t1[axis] = 1.0
        t1 = (t1 - n[axis] * n) / sqrt(1.0 - n[axis] ** 2)
        t2[0], t2[1], t2[2] = n[1] * t1[2] - n[2] * t1[1], n[2] * t1[0] - n[0] * t1[2], n[0] * t1[1] - n[1] * t1[0]
        for j in range(sides):
            rows[i, j] = cos(turn * j) * t1 + sin(turn * j) * t2 + cos(pi / sides) * mu[i] * n
    return rows


class Scaling(NamedTuple):
    """How much internal force holds a grasp.

    Attributes:
        factor: Factor for the internal force.
        holds: Whether all contacts are then inside their narrowed cones.
        margin: Least `mu f_n - |f_t|` over the contacts, of the narrowed cones [N].
    """

    factor: float
    holds: bool
    margin: float


def scale_internal(
    f_W: Array, g_W: Array, n_W: Array, mu: float, fraction: float, least: float, most: float
) -> Scaling:
    """Smallest factor in [least, most] that brings `f + factor g` inside every cone narrowed to `fraction mu`.

    A cone is convex, so the factors that do are an interval for each contact, the roots of
    `mu^2 f_n^2 = |f_t|^2`, and the answer is the lower end of what they have in common.  Where that is empty the
    factor of the best worst margin is returned, with `holds` False.

    Args:
        f_W: (k, 3) forces that make the wanted wrench, in W [N].
        g_W: (k, 3) internal forces of factor 1, in W [N].
        n_W: (k, 3) handle's outward unit normals, in W.
        mu: Coefficient of friction.
        fraction: Share of mu that may be used: 0.8 keeps a margin of 20 % of the pressing force times mu.
        least: Smallest factor allowed.
        most: Largest factor allowed, finite: it bounds the squeeze by what fingertips and handle can bear.

    Paper: the "proper choice of F_0" that (16) leaves open.
    """
    reach = fraction * mu
    pressing, slope = -(f_W * n_W).sum(axis=1), -(g_W * n_W).sum(axis=1)
    along, bend = f_W + pressing[:, None] * n_W, g_W + slope[:, None] * n_W
    a = (reach * slope) ** 2 - (bend * bend).sum(axis=1)
    b = reach * reach * pressing * slope - (along * bend).sum(axis=1)
    c = (reach * pressing) ** 2 - (along * along).sum(axis=1)
    lower, upper = least, most
    for contact in zip(a.tolist(), b.tolist(), c.tolist(), pressing.tolist(), slope.tolist(), strict=True):
        start, end = _interval(*contact)
        lower, upper = max(lower, start), min(upper, end)
    holds = lower <= upper
    factor = lower if holds else _best_factor(f_W, g_W, n_W, reach, least, most)
    return Scaling(factor, holds, float(cone_margin(f_W + factor * g_W, n_W, reach).min()))


def _interval(a: float, b: float, c: float, pressing: float, slope: float) -> tuple[float, float]:
    """Factors x with `a x^2 + 2 b x + c >= 0` and `pressing + slope x >= 0`: one nappe of the double cone."""
    # A direction within 1e-12 of the cone's mantle leaves a linear condition; its quadratic term is rounding.
    if abs(a) <= 1e-12 * (slope * slope + abs(a)):
        if b * slope > 0.0:
            edge = -0.5 * c / b
            return (edge, inf) if b > 0.0 else (-inf, edge)
        return (-inf, inf) if b == 0.0 and c >= -(DUST**2) and pressing >= -DUST else EMPTY
    square = b * b - a * c
    if a < 0.0 and square < 0.0:
        return EMPTY
    # A direction inside the cone always meets it twice: a negative square is then rounding.
    square = max(square, 0.0)
    # The root that adds like signs first, the other from their product: no cancellation.
    large = -(b + (sqrt(square) if b >= 0.0 else -sqrt(square)))
    first, second = sorted((large / a, c / large if large else 0.0))
    if a > 0.0:
        return (second, inf) if slope > 0.0 else (-inf, first)
    return (first, second) if pressing - slope * b / a >= 0.0 else EMPTY


def _best_factor(f_W: Array, g_W: Array, n_W: Array, mu: float, least: float, most: float) -> float:
    """Factor of the greatest worst margin, a concave function, by four rounds of 33 samples: to 2e-5 of the range."""
    lower, upper = least, most
    best = least
    for _ in range(4):
        factors = np.linspace(lower, upper, 33)
        forces = (f_W + factors[:, None, None] * g_W).reshape(-1, 3)
        margins = cone_margin(forces, np.tile(n_W, (33, 1)), mu).reshape(33, -1).min(axis=1)
        i = int(margins.argmax())
        best = float(factors[i])
        lower, upper = float(factors[max(i - 1, 0)]), float(factors[min(i + 1, 32)])
    return best
