"""The paper's pose problem (1)-(6) for k contacts and any patches of the surface family: data and functions, no solver.

Variables, lengths in units of 10 mm so that all are of order one:

    x = ( (p - p_s) / 10 mm, r (w, x, y, z), then for each contact u_i, v_i, xi_i, eta_i / eta_unit ),   |r| = 1

    max (r . rbar)^2    subject to                                                               (6)
    |p - p_s|_j <= e1                          j = x, y, z in W                                   (1)
    |R sigma(xi, eta) + p - R_i sigma_i(u, v) - p_i|_j <= e1                                      (2)
    |R sigma-hat_xi . R_i n_i| <= e2,   |R sigma-hat_eta . R_i n_i| <= e2                         (3), (4)
    R n . R_i n_i <= -1/2
    |xi - xi-|, |eta - eta-| / 10 mm <= e3                                                        (5)

Paper: III-A.  Departures: the norms of (1), (2) and (5) are boxes inside the paper's balls (e1 = eps1 / sqrt 3,
e3 = sqrt(eps3 / 2)), because a squared norm has no gradient where it vanishes, which is where the solution lies, and a
third of the frames then fail; (r . rbar)^2 for |r . rbar|, which has a corner; opposed normals, without which (3) and
(4) admit the far side of the handle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import hypot, inf, sqrt
from typing import Any, NamedTuple

import casadi
import numpy as np

from turnscrew.estimate.blended_capsule import BlendedCapsule
from turnscrew.estimate.buffered import Buffered
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.rotations import quaternion_from_matrix
from turnscrew.geometry.surfaces import SurfaceOfRevolution

UNIT = 0.01
"""Length unit of the program [m]."""

OPPOSED = -0.5
"""Bound of R n . R_i n_i: (3) and (4) leave it near -1 or +1, so any bound between keeps the right side only."""

G_PER_CONTACT = 6
X_PER_CONTACT = 4
X_POSE = 7


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Tolerances of (1)-(5).

    Attributes:
        eps1: Of contact and tip positions [m]; above the .16 mm that a fingertip sinks in at 10 N, and above what is
            left of the learned joint offsets; found by trial.
        eps2: Of the tangent planes, a sine; 1.7 deg.
        step: sqrt(eps3), of the contact's move away from its prediction [rad, and 10 mm along the handle].
    """

    eps1: float = 0.0005
    eps2: float = 0.03
    step: float = 0.02

    def widened(self, factor: float) -> Tolerances:
        """The same with all three multiplied by factor."""
        return Tolerances(self.eps1 * factor, self.eps2 * factor, self.step * factor)


@dataclass(frozen=True, slots=True)
class PoseFrame:
    """The data of one frame for k contacts.

    Attributes:
        p_WS: (3,) where the tip should be, in W [m].
        r_bar: (4,) orientation seen (w, x, y, z).
        p_WF: (k, 3) fingertip centres in W [m].
        R_WF: (k, 3, 3) their orientations.
        tip_radius: (k,) fingertip radii [m].
        radius_error: What the handle is thicker than its patch [m].
        xi: (k, 2) predicted contact parameters (xi-, eta-) on the handle's patch.
    """

    p_WS: Array
    r_bar: Array
    p_WF: Array
    R_WF: Array
    tip_radius: Array
    radius_error: float
    xi: Array

    def parameters(self, tip_radius: float) -> Array:
        """The rows' parameter vector; tip_radius is that of the fingertip patch they were built with."""
        p = ((self.p_WF - self.p_WS) / UNIT).ravel()
        return np.concatenate([p, self.R_WF.ravel(), self.tip_radius - tip_radius, [self.radius_error]])


class Bounds(NamedTuple):
    """Boxes of the variables x (7 + 4k,) and, after them, of the rows g (6k,): low and high (7 + 10k,)."""

    low: Array
    high: Array


class PoseProblem:
    """The problem for one handle and k contacts with capsule fingertips.

    Attributes:
        handle: Patch of the handle.
        tip: Patch of a fingertip; others of the same family differ by a radius, which is a parameter (a parallel
            surface of a capsule is a capsule, though in another chart), and are taken to be as long.
        k: Number of contacts.
        size: Number of variables, 7 + 4k.
        eta_unit: Unit of the variable of eta, so that one unit is 10 mm along the handle.
    """

    def __init__(self, handle: SurfaceOfRevolution, tip: Capsule, k: int) -> None:
        self.handle, self.tip, self.k = handle, tip, k
        middle = handle.meridian(0.5 * sum(handle.domain))
        self.eta_unit = UNIT / hypot(middle.dr, middle.dh)
        self.size = X_POSE + X_PER_CONTACT * k
        # p, r, then u, v, xi, eta of each contact, then the rows of each contact: which of the tolerances bounds them
        self._kinds = np.array([0] * 3 + [1] * 4 + [2, 2, 3, 3] * k + [0, 0, 0, 4, 4, 2] * k)
        x, parameters = casadi.SX.sym("x", self.size), self.parameters()
        g = self.rows(x[:3], rotation(x[3:7]), x[X_POSE:], parameters)
        self._g = Buffered(casadi.Function("g", [x, parameters], [g]))

    def parameters(self) -> Any:
        """Symbols of the data, in the order of `PoseFrame.parameters`."""
        return casadi.SX.sym("parameters", (3 + 9 + 1) * self.k + 1)

    def rows(self, p: Any, R: Any, contacts: Any, parameters: Any) -> Any:
        """Left-hand sides of (2)-(4) and of the opposed normals, six for each contact, in any chart of the pose.

        Args:
            p: (3,) expression of (p - p_s) / 10 mm.
            R: (3, 3) expression of the tool's orientation.
            contacts: (4k,) expressions u, v, xi, eta / eta_unit of each contact.
            parameters: Symbols of the data.

        Paper: (2), (3), (4).
        """
        k = self.k
        # Row-major rows arrive as columns of a column-major reshape.
        p_F, R_F = casadi.reshape(parameters[: 3 * k], 3, k), casadi.reshape(parameters[3 * k : 12 * k], 9, k)
        offset, radius_error = parameters[12 * k : 13 * k], parameters[13 * k]
        skin = BlendedCapsule(self.tip.radius, self.tip.length)
        g = []
        for i in range(k):
            u, v, xi, eta = casadi.vertsplit(contacts[X_PER_CONTACT * i : X_PER_CONTACT * (i + 1)])
            R_i = casadi.reshape(R_F[:, i], 3, 3).T
            ours = self.handle.symbolic(xi, eta * self.eta_unit, radius_error)
            its = skin.symbolic(u, v, offset[i])
            n_i = R_i @ its.n_hat
            g += [R @ ours.sigma / UNIT + p - R_i @ its.sigma / UNIT - p_F[:, i]]
            g += [casadi.dot(R @ ours.sigma_u_hat, n_i), casadi.dot(R @ ours.sigma_v_hat, n_i)]
            g += [casadi.dot(R @ ours.n_hat, n_i)]
        return casadi.vertcat(*g)

    def g(self, x: Array, parameters: Array) -> Array:
        """The rows (6k,) at x, by data as `PoseFrame.parameters` gives them."""
        self._g.arguments[0][:], self._g.arguments[1][:] = x, parameters
        self._g.evaluate()
        return self._g.results[0].copy()

    def bounds(self, frame: PoseFrame, tolerances: Tolerances) -> Bounds:
        """The boxes of a frame; those of r leave room for the rounding of a unit quaternion only.

        Paper: (1), (5) and the right-hand sides of (2)-(4).
        """
        e1, e3 = tolerances.eps1 / UNIT / sqrt(3.0), tolerances.step / sqrt(2.0)
        half = np.array([e1, 1.1, inf, e3, tolerances.eps2])[self._kinds]
        middle = np.zeros(len(half))
        middle[X_POSE : self.size].reshape(-1, X_PER_CONTACT)[:, 2:] = self._predicted(frame)
        low, high = middle - half, middle + half
        v = slice(X_POSE + 1, self.size, X_PER_CONTACT)
        low[v], high[v] = self.tip.domain
        high[self.size + G_PER_CONTACT - 1 :: G_PER_CONTACT] = OPPOSED
        return Bounds(low, high)

    def _predicted(self, frame: PoseFrame) -> Array:
        """(k, 2) the prediction of (5) in the variables' units."""
        predicted: Array = frame.xi * np.array([1.0, 1.0 / self.eta_unit])
        return predicted

    def point(self, frame: PoseFrame, p_WT: Array, R_WT: Array, xi: Array, tip_uv: Array) -> Array:
        """The variables x of a pose with its contacts.

        Args:
            frame: Data.
            p_WT: (3,) tip position in W [m].
            R_WT: (3, 3) orientation of the tool.
            xi: (k, 2) contact parameters on the handle's patch.
            tip_uv: (k, 2) contact parameters on the fingertips' own patches.
        """
        r = quaternion_from_matrix(R_WT)
        # q and -q are one rotation; starting on the side of rbar keeps the path short.
        r = r if float(r @ frame.r_bar) >= 0.0 else -r
        uv = in_chart(tip_uv, frame.tip_radius / self.tip.radius)
        contacts = np.column_stack([uv, xi[:, :1], xi[:, 1:] / self.eta_unit])
        return np.concatenate([(p_WT - frame.p_WS) / UNIT, r, contacts.ravel()])

    def step(self, frame: PoseFrame, x: Array) -> Array:
        """(k, 2) moves of the contacts from their prediction, bounded by (5) [rad, and 10 mm]."""
        return x[X_POSE:].reshape(-1, X_PER_CONTACT)[:, 2:] - self._predicted(frame)


@lru_cache(maxsize=64)
def pose_problem(handle: SurfaceOfRevolution, tip: Capsule, k: int) -> PoseProblem:
    """The problem for k contacts, built once for each handle and fingertip."""
    return PoseProblem(handle, tip, k)


def in_chart(uv: Array, ratio: Array) -> Array:
    """Contact parameters in another capsule's chart, which runs down the cylinder at its own radius a radian.

    Args:
        uv: (k, 2) parameters in the charts of the capsules as they are.
        ratio: (k,) their radii over that of the capsule whose chart is wanted.
    """
    u, v = uv[:, 0], uv[:, 1]
    return np.column_stack([u, np.where(v < 0.0, v * ratio, v)])


def rotation(r: Any) -> Any:
    """Rotation matrix of a unit quaternion (w, x, y, z), symbolic."""
    w, x, y, z = casadi.vertsplit(r)
    return casadi.vertcat(
        casadi.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        casadi.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        casadi.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
