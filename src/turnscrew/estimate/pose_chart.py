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

from turnscrew.estimate.blended_capsule import BlendedCapsule
from turnscrew.estimate.buffered import Buffered
from turnscrew.estimate.pose_convex import convexified
from turnscrew.estimate.pose_problem import (
    G_PER_CONTACT,
    UNIT,
    X_PER_CONTACT,
    X_POSE,
    Bounds,
    PoseFrame,
    PoseProblem,
)
from turnscrew.estimate.pose_rows import pose_derivatives, pose_rows
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import matrix_from_quaternion, quaternion_conjugate, quaternion_product
from turnscrew.geometry.surfaces import SurfaceOfRevolution

PHI = slice(3, 6)
Z_POSE = 6

WIDEST = 1.0
"""Bound of each |phi_j| [rad]: the chart ends at |phi| = 2, a half turn, and no pose seen errs by 57 deg."""


class PoseChart:
    """Rows and their derivatives of one problem and, from `take` on, one frame.

    Attributes:
        problem: The problem.
        size: Number of variables, 6 + 4k.
        low, high: (6 + 10k,) boxes of variables and rows.
        g: (6k,) rows where they were last asked for.
        J: (6k, 6 + 4k) their Jacobian, where that was.
        H: (6 + 4k, 6 + 4k) Hessian of |phi|^2 / 2 + weights . g there, made convex.
        raised: (k, 4) what was added to the contacts' diagonal for that.
    """

    def __init__(self, problem: PoseProblem) -> None:
        self.problem, k = problem, problem.k
        self.size = n = Z_POSE + X_PER_CONTACT * k
        self._meridians = _meridians(problem)
        self._jets = self._meridians.results[0].reshape(k, 2, 3, 4)
        self._z = self._meridians.arguments[0]
        self._data = np.zeros(9 + 12 * k)
        self.g, self.J, self.H = np.zeros(G_PER_CONTACT * k), np.zeros((G_PER_CONTACT * k, n)), np.zeros((n, n))
        self.raised = np.zeros((k, X_PER_CONTACT))

    def take(self, frame: PoseFrame, parameters: Array, bounds: Bounds) -> None:
        """Fix the frame for the evaluations to come.

        Args:
            frame: Data.
            parameters: Of the frame, as it gives them.
            bounds: As the problem gives them.
        """
        rows = 12 * self.problem.k
        self._data[:9], self._data[9:] = matrix_from_quaternion(frame.r_bar).ravel(), parameters[:rows]
        self._meridians.arguments[1][:] = parameters[rows:]
        self.low, self.high = bounds.low[1:].copy(), bounds.high[1:].copy()
        self.low[:3], self.high[:3] = bounds.low[:3], bounds.high[:3]
        self.low[PHI], self.high[PHI] = -WIDEST, WIDEST
        self._least, self._most = self.low[self.size :], self.high[self.size :]

    def rows(self, z: Array) -> float:
        """Fill in g at z: the sum of its violations."""
        self._z[:] = z
        self._meridians.evaluate()
        return pose_rows(z, self._data, self._jets, self._least, self._most, self.g)

    def derivatives(self, z: Array, weights: Array) -> None:
        """Fill in J and H at z, where the rows must have been asked for last."""
        pose_derivatives(z, self._data, self._jets, weights, self.J, self.H)
        convexified(self.H, self.raised.reshape(-1))

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


def _meridians(problem: PoseProblem) -> Buffered:
    """(z, what each fingertip and then the handle is thicker than its patch [m]) -> the jets of `pose_rows`."""
    k, skin = problem.k, BlendedCapsule(problem.tip.radius, problem.tip.length)
    z, thicker = casadi.SX.sym("z", Z_POSE + X_PER_CONTACT * k), casadi.SX.sym("thicker", k + 1)
    jets = []
    for i in range(k):
        v, eta = z[Z_POSE + X_PER_CONTACT * i + 1], z[Z_POSE + X_PER_CONTACT * i + 3]
        jets += [_jet(skin, v, 1.0, thicker[i]), _jet(problem.handle, eta, problem.eta_unit, thicker[k])]
    return Buffered(casadi.Function("meridians", [z, thicker], [casadi.horzcat(*jets)], {"cse": True}))


def _jet(surface: SurfaceOfRevolution, variable: Any, unit: float, thicker: Any) -> Any:
    """(r, h, a, b) of a parallel surface, then the first and the second derivatives."""
    v = casadi.SX.sym("v")
    r, h, a, b = surface.symbolic_meridian(unit * v)
    value = casadi.vertcat((r + thicker * b) / UNIT, (h - thicker * a) / UNIT, a, b)
    slope = casadi.jacobian(value, v)
    jet = casadi.vertcat(value, slope, casadi.jacobian(slope, v))
    return casadi.densify(casadi.substitute(jet, v, variable))


@lru_cache(maxsize=64)
def pose_chart(problem: PoseProblem) -> PoseChart:
    """The chart of a problem, compiled when first asked for."""
    return PoseChart(problem)
