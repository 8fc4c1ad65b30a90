"""Patches of surfaces of revolution, with every derivative that contact kinematics needs, exact.

Handle and fingertips are all of one family, `sigma(u, v) = (r(v) cos u, r(v) sin u, h(v))`: a member gives its
meridian (r, h) with two derivatives, and tangents, normals and curvatures follow here once for all.
The meridian must climb (h' >= 0, and (r', h') never zero), so that the normal below points outwards.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import cos, hypot, sin
from typing import Any, NamedTuple

import casadi
import numpy as np

from turnscrew.errors import ModelError
from turnscrew.geometry.arrays import Array


class Meridian(NamedTuple):
    """The generating curve at one parameter: radius r and height h [m] with their first and second derivatives."""

    r: float
    h: float
    dr: float
    dh: float
    ddr: float
    ddh: float


class SymbolicPatch(NamedTuple):
    """A patch as CasADi expressions, all (3, 1): point [m], unit tangents along u and v, outward unit normal."""

    sigma: Any
    sigma_u_hat: Any
    sigma_v_hat: Any
    n_hat: Any


class LocalGeometry(NamedTuple):
    """A patch at one point, as rolling needs it.

    Attributes:
        t_u: (3,) unit tangent along u.
        t_v: (3,) unit tangent along v.
        n: (3,) outward unit normal, t_u x t_v.
        speed_u: |sigma_u| [m per unit of u]; 0 at a pole.
        speed_v: |sigma_v| [m per unit of v].
        curvature_u: Normal curvature along u [1/m], positive where convex.
        curvature_v: Normal curvature along v [1/m], positive where convex.
    """

    t_u: Array
    t_v: Array
    n: Array
    speed_u: float
    speed_v: float
    curvature_u: float
    curvature_v: float


class SurfaceOfRevolution(ABC):
    """`sigma(u, v) = (r(v) cos u, r(v) sin u, h(v))` about the z axis of its frame, u in rad, v within `domain`.

    Principal directions are those of u and v.  All points and vectors are in the surface's own frame.
    """

    __slots__ = ()

    @property
    @abstractmethod
    def domain(self) -> tuple[float, float]:
        """Lower and upper end (v_min, v_max) of the meridian's parameter."""

    @property
    def spline(self) -> tuple[Array, Array]:
        """The meridian as compiled functions take it: heights (n + 1,) of its knots [m], and its n cubics (n, 4).

        With a row (a, b, c, d), `h = v` and `r = a x^3 + b x^2 + c x + d` [m], x the height above the lower knot.

        Raises:
            ModelError: the meridian is no spline of the height; that of a handle is.
        """
        raise ModelError(f"{type(self).__name__}: its meridian is no spline of the height, as a handle's must be")

    @abstractmethod
    def meridian(self, v: float) -> Meridian:
        """The generating curve and its derivatives at v, one-sided from above where the second ones jump."""

    @abstractmethod
    def symbolic_meridian(self, v: Any) -> tuple[Any, Any, Any, Any]:
        """The generating curve for CasADi: (r, h) [m] and its unit tangent (t_r, t_h)."""

    def point(self, u: float, v: float) -> Array:
        """sigma(u, v), (3,) [m]."""
        m = self.meridian(v)
        return np.array([m.r * cos(u), m.r * sin(u), m.h])

    def tangents(self, u: float, v: float) -> Array:
        """First derivatives of the patch: (3, 2), columns sigma_u and sigma_v [m per unit of the parameter]."""
        m, c, s = self.meridian(v), cos(u), sin(u)
        return np.array([[-m.r * s, m.dr * c], [m.r * c, m.dr * s], [0.0, m.dh]])

    def second_derivatives(self, u: float, v: float) -> Array:
        """Second derivatives of the patch: (3, 3), columns sigma_uu, sigma_uv and sigma_vv."""
        m, c, s = self.meridian(v), cos(u), sin(u)
        return np.array([[-m.r * c, -m.dr * s, m.ddr * c], [-m.r * s, m.dr * c, m.ddr * s], [0.0, 0.0, m.ddh]])

    def normal(self, u: float, v: float) -> Array:
        """Outward unit normal (3,), `(h' cos u, h' sin u, -r') / |(r', h')|`; well defined at a pole too."""
        m = self.meridian(v)
        w = 1.0 / hypot(m.dr, m.dh)
        return np.array([w * m.dh * cos(u), w * m.dh * sin(u), -w * m.dr])

    def normal_derivatives(self, u: float, v: float) -> Array:
        """Derivatives of the outward unit normal: (3, 2), columns n_u and n_v.

        They lie along the tangents: `n_u = (h'/|.|) e_u` and `n_v = curvature_v sigma_v` (Rodrigues).
        """
        m, c, s = self.meridian(v), cos(u), sin(u)
        square = m.dr * m.dr + m.dh * m.dh
        a = m.dh / square**0.5
        k = (m.ddh * m.dr - m.ddr * m.dh) / square**1.5
        return np.array([[-a * s, k * m.dr * c], [a * c, k * m.dr * s], [0.0, k * m.dh]])

    def unit_tangents(self, u: float, v: float) -> Array:
        """Unit vectors along sigma_u and sigma_v: (3, 2); at a pole the limit along the meridian u.

        Paper: sigma-hat_xi and sigma-hat_eta of (3) and (4).
        """
        m, c, s = self.meridian(v), cos(u), sin(u)
        w = 1.0 / hypot(m.dr, m.dh)
        return np.array([[-s, w * m.dr * c], [c, w * m.dr * s], [0.0, w * m.dh]])

    def curvatures(self, v: float) -> tuple[float, float]:
        """Principal curvatures (along u, along v) [1/m], positive where the surface is convex.

        `kappa_v = (h'' r' - r'' h') / |(r', h')|^3` and `kappa_u = h' / (r |(r', h')|)`, which at a pole, where
        r and h' vanish, is kappa_v by symmetry.
        """
        return _curvatures(self.meridian(v))

    def local_geometry(self, u: float, v: float) -> LocalGeometry:
        """Orthonormal tangent frame, speeds and curvatures at once, from one evaluation of the meridian."""
        m, c, s = self.meridian(v), cos(u), sin(u)
        speed = hypot(m.dr, m.dh)
        a, b = m.dr / speed, m.dh / speed
        k_u, k_v = _curvatures(m)
        return LocalGeometry(
            t_u=np.array([-s, c, 0.0]),
            t_v=np.array([a * c, a * s, b]),
            n=np.array([b * c, b * s, -a]),
            speed_u=m.r,
            speed_v=speed,
            curvature_u=k_u,
            curvature_v=k_v,
        )

    def symbolic(self, u: Any, v: Any, offset: Any = 0.0) -> SymbolicPatch:
        """The patch as CasADi expressions of the parameters, so a pose problem can be stated for any member.

        Args:
            u: Angle, SX, MX or number [rad].
            v: Meridian parameter, SX, MX or number.
            offset: Distance [m] by which the surface is grown along its normal: the parallel surface has the same
                tangents and normal, so a learned error of a handle's radius enters as one parameter.

        Returns:
            Point, unit tangents and outward unit normal, each (3, 1).

        Paper: sigma, sigma-hat_xi, sigma-hat_eta and n-hat of (2)-(4).
        """
        r, h, t_r, t_h = self.symbolic_meridian(v)
        c, s = casadi.cos(u), casadi.sin(u)
        n = casadi.vertcat(t_h * c, t_h * s, -t_r)
        return SymbolicPatch(
            sigma=casadi.vertcat(r * c, r * s, h) + offset * n,
            sigma_u_hat=casadi.vertcat(-s, c, 0.0),
            sigma_v_hat=casadi.vertcat(t_r * c, t_r * s, t_h),
            n_hat=n,
        )


def _curvatures(m: Meridian) -> tuple[float, float]:
    speed = hypot(m.dr, m.dh)
    k_v = (m.ddh * m.dr - m.ddr * m.dh) / speed**3
    # Nearer to the axis than 1e-9 of the meridian's speed the quotient is rounding noise.
    k_u = m.dh / (m.r * speed) if m.r > 1e-9 * speed else k_v
    return k_u, k_v
