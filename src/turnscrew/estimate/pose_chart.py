"""The pose problem in a chart about rbar, where (6) is convex, with the derivatives that Newton's method needs.

    z = ( (p - p_s) / 10 mm, phi, then for each contact u_i, v_i, xi_i, eta_i / eta_unit ),   r = (w, phi / 2) rbar

The quaternion's vector part s = phi / 2 is what r differs from rbar by, and w = sqrt(1 - |s|^2).  So
`(r . rbar)^2 = 1 - |phi|^2 / 4` exactly: the paper's objective is half a squared length, unit length needs no
constraint, and phi is the rotation vector up to its third order.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt
from typing import Any

import casadi
import numpy as np

from turnscrew.estimate.buffered import Buffered
from turnscrew.estimate.pose_problem import X_PER_CONTACT, X_POSE, Bounds, PoseFrame, PoseProblem, rotation
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import matrix_from_quaternion, quaternion_conjugate, quaternion_product

PHI = slice(3, 6)
Z_POSE = 6

FLAT = 1e-6
"""Least pivot of a contact's parameters, a ten-thousandth of what multipliers give them as a rule."""

STEEP = 0.1
"""Least pivot of the rotation, a tenth of what the objective gives it."""

WIDEST = 1.0
"""Bound of each |phi_j| [rad]: the chart ends at |phi| = 2, a half turn, and no pose seen errs by 57 deg."""


class PoseChart:
    """Rows and their derivatives of one problem, compiled once.

    Attributes:
        problem: The problem.
        size: Number of variables, 6 + 4k.
        rows: (z, data, low, high) -> (g, sum of the rows' violations).
        slopes: (z, data) -> (J (6k, 6 + 4k)).
        curves: (z, data, weights of the rows) -> (J, Hessian of |phi|^2 / 2 + weights . g made convex, the most that
            was added to a contact's diagonal for that).
    """

    def __init__(self, problem: PoseProblem) -> None:
        self.problem = problem
        self.size = Z_POSE + X_PER_CONTACT * problem.k
        z, R_bar, parameters = casadi.SX.sym("z", self.size), casadi.SX.sym("R_bar", 9), problem.parameters()
        s = 0.5 * z[PHI]
        R = rotation(casadi.vertcat(casadi.sqrt(1 - casadi.dot(s, s)), s)) @ casadi.reshape(R_bar, 3, 3).T
        g = problem.rows(z[:3], R, z[Z_POSE:], parameters)
        weights, low, high = (casadi.SX.sym(name, g.numel()) for name in ("weights", "low", "high"))
        data = casadi.vertcat(R_bar, parameters)
        H = casadi.hessian(0.5 * casadi.dot(z[PHI], z[PHI]) + casadi.dot(weights, g), z)[0]
        # CasADi stores by columns: the transpose's columns are the rows of an array of ours.
        J = casadi.densify(casadi.jacobian(g, z).T)
        excess = casadi.sum1(casadi.fmax(casadi.fmax(low - g, g - high), 0))
        self.rows = _compiled("rows", [z, data, low, high], [g, excess])
        self.slopes = _compiled("slopes", [z, data], [J])
        self.curves = _compiled("curves", [z, data, weights], [J, *convex(H)])

    def take(self, data: Array, bounds: Bounds) -> None:
        """Fix the frame for the evaluations to come, with bounds in this chart."""
        for function in (self.rows, self.slopes, self.curves):
            function.arguments[1][:] = data
        self.rows.arguments[2][:], self.rows.arguments[3][:] = bounds.low[self.size :], bounds.high[self.size :]

    def data(self, frame: PoseFrame, parameters: Array) -> Array:
        """The compiled functions' parameter vector, of a frame and its `PoseFrame.parameters`."""
        return np.concatenate([matrix_from_quaternion(frame.r_bar).ravel(), parameters])

    def bounds(self, bounds: Bounds) -> Bounds:
        """The problem's boxes in this chart."""
        low, high = bounds.low[1:].copy(), bounds.high[1:].copy()
        low[:3], low[PHI], high[:3], high[PHI] = bounds.low[:3], -WIDEST, bounds.high[:3], WIDEST
        return Bounds(low, high)

    def enter(self, frame: PoseFrame, x: Array) -> Array:
        """The chart's z at the problem's variables x."""
        difference = quaternion_product(x[3:X_POSE], quaternion_conjugate(frame.r_bar))
        phi = (2.0 if difference[0] >= 0.0 else -2.0) * difference[1:]
        return np.concatenate([x[:3], phi, x[X_POSE:]])

    def leave(self, frame: PoseFrame, z: Array) -> Array:
        """The problem's variables x at z."""
        s = 0.5 * z[PHI]
        w = sqrt(max(1.0 - float(s @ s), 0.0))
        r = quaternion_product(np.array([w, *s.tolist()]), frame.r_bar)
        return np.concatenate([z[:3], r, z[Z_POSE:]])


def convex(H: Any) -> tuple[Any, Any]:
    """H with as much added to its diagonal as makes it positive semidefinite, and the most added for a contact.

    The modified Cholesky factorisation of Gill, Murray and Wright (Practical Optimization, 4.4.2.2), written out as an
    expression without branches: a pivot that is negative, or so small that later ones would drown in what it subtracts
    from them, is replaced by a larger one.  An eigenvalue decomposition does the same and takes twice as long as all
    else of a step together.  Contacts are eliminated one by one, as only the rotation couples them, and the rotation
    last; the position has no curvature.

    Args:
        H: (6 + 4k, 6 + 4k) symmetric expression over position, rotation and contacts.
    """
    A, added = casadi.SX(casadi.densify(H)), casadi.SX.zeros(H.shape[0])
    turn = list(range(PHI.start, PHI.stop))
    contacts = [list(range(i, i + X_PER_CONTACT)) for i in range(Z_POSE, H.shape[0], X_PER_CONTACT)]
    largest = casadi.SX(FLAT)
    for own in contacts:
        largest = casadi.fmax(largest, casadi.mmax(casadi.fabs(casadi.vec(A[own, own]))))
    for own in contacts:
        for place, j in enumerate(own):
            # one pivot may take half of the rotation's own curvature, which is 1
            _eliminate(A, added, j, [(own[place + 1 :], largest), (turn, 0.5)], FLAT)
    for place, j in enumerate(turn):
        _eliminate(A, added, j, [(turn[place + 1 :], 1.0)], STEEP)
    return casadi.densify(H) + casadi.diag(added), casadi.mmax(added[Z_POSE:])


def _eliminate(A: Any, added: Any, j: int, later: list[tuple[list[int], Any]], least: float) -> None:
    """Pivot on A_jj, made so large that it takes no more from each group of later pivots than is said."""
    pivot = casadi.fmax(casadi.fabs(A[j, j]), least)
    for group, most in later:
        if group:
            pivot = casadi.fmax(pivot, casadi.mmax(A[group, j] ** 2) / most)
    added[j] = pivot - A[j, j]
    rest = [i for group, _ in later for i in group]
    if rest:
        A[rest, rest] -= A[rest, j] @ A[rest, j].T / pivot


def _compiled(name: str, arguments: list[Any], results: list[Any]) -> Buffered:
    return Buffered(casadi.Function(name, arguments, results, {"cse": True}))


@lru_cache(maxsize=64)
def pose_chart(problem: PoseProblem) -> PoseChart:
    """The chart of a problem, compiled when first asked for."""
    return PoseChart(problem)
