"""The paper's pose problem (1)-(6) as a CasADi program for k contacts and any patches of the surface family.

Variables, lengths in units of 10 mm so that all are of order one:

    x = ( (p - p_s) / 10 mm, r (w, x, y, z), then for each contact u_i, v_i, xi_i, eta_i / eta_unit )

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
from typing import Any

import casadi
import numpy as np

from turnscrew.estimate.blended_capsule import BlendedCapsule
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.profiles import Capsule
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
        """The program's parameter vector; tip_radius is that of the fingertip patch it was built with."""
        p = ((self.p_WF - self.p_WS) / UNIT).ravel()
        offsets = self.tip_radius - tip_radius
        return np.concatenate([self.r_bar, p, self.R_WF.ravel(), offsets, [self.radius_error]])


class PoseProblem:
    """The program for one handle and k contacts with capsule fingertips; its solvers are built when first asked for.

    Attributes:
        handle: Patch of the handle.
        tip: Patch of a fingertip; others of the same family differ by a radius, which is a parameter (a parallel
            surface of a capsule is a capsule, though in another chart), and are taken to be as long.
        k: Number of contacts.
        eta_unit: Unit of the variable of eta, so that one unit is 10 mm along the handle.
    """

    def __init__(self, handle: SurfaceOfRevolution, tip: Capsule, k: int) -> None:
        self.handle, self.tip, self.k = handle, tip, k
        middle = handle.meridian(0.5 * sum(handle.domain))
        self.eta_unit = UNIT / hypot(middle.dr, middle.dh)
        self._program = self._build()
        self._solvers: dict[bool, Any] = {}
        self.g = casadi.Function("g", [self._program["x"], self._program["p"]], [self._program["g"]])

    def _build(self) -> dict[str, Any]:
        k = self.k
        x = casadi.SX.sym("x", X_POSE + X_PER_CONTACT * k)
        r_bar, radius_error = casadi.SX.sym("r_bar", 4), casadi.SX.sym("radius_error")
        p_F, R_F, offset = casadi.SX.sym("p_F", 3, k), casadi.SX.sym("R_F", 9, k), casadi.SX.sym("offset", k)
        p, r = x[:3], x[3:7]
        R = rotation(r)
        g = [casadi.dot(r, r)]
        skin = BlendedCapsule(self.tip.radius, self.tip.length)
        for i in range(k):
            u, v, xi, eta = casadi.vertsplit(x[X_POSE + X_PER_CONTACT * i : X_POSE + X_PER_CONTACT * (i + 1)])
            # Row-major rows arrive as columns of a column-major reshape.
            R_i = casadi.reshape(R_F[:, i], 3, 3).T
            ours = self.handle.symbolic(xi, eta * self.eta_unit, radius_error)
            its = skin.symbolic(u, v, offset[i])
            n_i = R_i @ its.n_hat
            g += [R @ ours.sigma / UNIT + p - R_i @ its.sigma / UNIT - p_F[:, i]]
            g += [casadi.dot(R @ ours.sigma_u_hat, n_i), casadi.dot(R @ ours.sigma_v_hat, n_i)]
            g += [casadi.dot(R @ ours.n_hat, n_i)]
        parameters = casadi.vertcat(r_bar, casadi.vec(p_F), casadi.vec(R_F), offset, radius_error)
        return {"x": x, "p": parameters, "f": -(casadi.dot(r, r_bar) ** 2), "g": casadi.vertcat(*g)}

    def solver(self, warm: bool) -> Any:
        """IPOPT on this program, built when first asked for; `warm` starts from given multipliers, close to the bounds.

        Settings, found by trial: MUMPS and the exact Hessian (L-BFGS needs ten times longer); the monotone barrier (a
        tenth faster than the adaptive one).  60 iterations are four times the
        usual number; what needs more is infeasible.
        """
        if warm not in self._solvers:
            self._solvers[warm] = self._make(warm)
        return self._solvers[warm]

    def _make(self, warm: bool) -> Any:
        options: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "mu_strategy": "monotone",
            "max_iter": 60,
        }
        if warm:
            near = dict.fromkeys(("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac"), 1e-6)
            near |= {"mult_bound_push": 1e-6}
            options |= {"warm_start_init_point": "yes", "mu_init": 1e-4}
            options |= {f"warm_start_{name}": value for name, value in near.items()}
        settings = {"print_time": False, "record_time": False, "calc_lam_p": False, "error_on_fail": False}
        return casadi.nlpsol("pose", "ipopt", self._program, {**settings, "ipopt": options})

    def bounds(self, frame: PoseFrame, tolerances: Tolerances) -> tuple[Array, Array, Array, Array]:
        """lbx, ubx, lbg, ubg of a frame."""
        e1 = tolerances.eps1 / UNIT / sqrt(3.0)
        e3 = tolerances.step / sqrt(2.0)
        low, high = [-e1] * 3 + [-1.1] * 4, [e1] * 3 + [1.1] * 4
        lbg, ubg = [1.0], [1.0]
        v_min, v_max = self.tip.domain
        for xi, eta in frame.xi.tolist():
            low += [-inf, v_min, xi - e3, eta / self.eta_unit - e3]
            high += [inf, v_max, xi + e3, eta / self.eta_unit + e3]
            lbg += [-e1] * 3 + [-tolerances.eps2] * 2 + [-inf]
            ubg += [e1] * 3 + [tolerances.eps2] * 2 + [OPPOSED]
        return np.array(low), np.array(high), np.array(lbg), np.array(ubg)


@lru_cache(maxsize=64)
def pose_problem(handle: SurfaceOfRevolution, tip: Capsule, k: int) -> PoseProblem:
    """The program for k contacts, built once for each handle and fingertip."""
    return PoseProblem(handle, tip, k)


def rotation(r: Any) -> Any:
    """Rotation matrix of a unit quaternion (w, x, y, z), symbolic."""
    w, x, y, z = casadi.vertsplit(r)
    return casadi.vertcat(
        casadi.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        casadi.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        casadi.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
