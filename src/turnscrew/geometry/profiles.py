"""The members of the family: cylindrical handle, capsule fingertip, and a handle turned to any smooth profile."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from math import cos, isfinite, pi, sin
from typing import Any

import casadi
import numpy as np

from turnscrew.errors import ModelError
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.surfaces import Meridian, SurfaceOfRevolution


@dataclass(frozen=True, slots=True)
class Cylinder(SurfaceOfRevolution):
    """Lateral surface of a cylinder: `r = radius, h = v`, so v is the height above the frame's origin [m].

    Attributes:
        radius: [m].
        z0: Height of the lower rim [m].
        z1: Height of the upper rim [m].

    Raises:
        ModelError: radius is not positive, or z1 not above z0.
    """

    radius: float
    z0: float
    z1: float
    _spline: tuple[Array, Array] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        _require_positive("cylinder: radius", self.radius)
        _require_positive("cylinder: z1 - z0", self.z1 - self.z0)
        heights, cubics = np.array([self.z0, self.z1], float), np.array([[0.0, 0.0, 0.0, self.radius]])
        object.__setattr__(self, "_spline", (heights, cubics))

    @property
    def domain(self) -> tuple[float, float]:
        """Heights of the rims [m]."""
        return self.z0, self.z1

    @property
    def spline(self) -> tuple[Array, Array]:
        """One piece of constant radius."""
        return self._spline

    def meridian(self, v: float) -> Meridian:
        """The generating curve; v [m]."""
        return Meridian(self.radius, v, 0.0, 1.0, 0.0, 0.0)

    def symbolic_meridian(self, v: Any) -> tuple[Any, Any, Any, Any]:
        """The generating curve and its unit tangent for CasADi."""
        return self.radius, v, 0.0, 1.0


@dataclass(frozen=True, slots=True)
class Capsule(SurfaceOfRevolution):
    """Fingertip: a hemisphere on a cylinder, in one chart.  The frame sits in the hemisphere's centre, z outwards.

    `r = rho cos v+, h = rho (sin v+ + v-)` with v+ = max(v, 0) and v- = min(v, 0): v is the latitude on the
    hemisphere and goes on down the cylinder at the same speed rho, so the chart is once continuously
    differentiable across the seam; curvature along v jumps there from 0 to 1/rho.

    Attributes:
        radius: rho [m].
        length: Length of the cylindrical part below the hemisphere's centre [m].

    Raises:
        ModelError: radius is not positive, or length negative.
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        _require_positive("capsule: radius", self.radius)
        if not (isfinite(self.length) and self.length >= 0.0):
            raise ModelError(f"capsule: length is {self.length!r}; it must be a finite number, 0 or more")

    @property
    def domain(self) -> tuple[float, float]:
        """From the end of the cylindrical part to the pole."""
        return -self.length / self.radius, 0.5 * pi

    def meridian(self, v: float) -> Meridian:
        """The generating curve; v [rad]."""
        rho = self.radius
        if v < 0.0:
            return Meridian(rho, rho * v, 0.0, rho, 0.0, 0.0)
        c, s = rho * cos(v), rho * sin(v)
        return Meridian(c, s, -s, c, -c, -s)

    def symbolic_meridian(self, v: Any) -> tuple[Any, Any, Any, Any]:
        """The generating curve and its unit tangent for CasADi."""
        above, below = casadi.fmax(v, 0.0), casadi.fmin(v, 0.0)
        c, s = casadi.cos(above), casadi.sin(above)
        return self.radius * c, self.radius * (s + below), -s, c


@dataclass(frozen=True, slots=True)
class TurnedHandle(SurfaceOfRevolution):
    """Handle turned to a profile: `r = spline(v), h = v`, a cubic spline through the given radii.

    Between the ends the spline is twice continuously differentiable ("not-a-knot": two points make a cone,
    three a parabolic barrel); beyond them its outermost cubics go on.

    Attributes:
        heights: Increasing heights of the knots [m]; at least two.
        radii: Radius at each [m], positive.

    Raises:
        ModelError: fewer than two knots, heights not increasing, or a radius that is not positive.
    """

    heights: tuple[float, ...]
    radii: tuple[float, ...]
    _pieces: tuple[tuple[float, ...], ...] = field(init=False, repr=False, compare=False)
    _spline: tuple[Array, Array] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.heights) != len(self.radii) or len(self.heights) < 2:
            raise ModelError(
                f"turned handle: {len(self.heights)} heights and {len(self.radii)} radii; give as many, at least two"
            )
        for lower, upper in zip(self.heights, self.heights[1:], strict=False):
            _require_positive("turned handle: step of the heights", upper - lower)
        for radius in self.radii:
            _require_positive("turned handle: radius", radius)
        # Imported here because it costs more than all the rest of the package, and few handles are turned.
        from scipy.interpolate import CubicSpline

        cubics = np.ascontiguousarray(CubicSpline(self.heights, self.radii).c.T)
        object.__setattr__(self, "_pieces", tuple(tuple(cubic) for cubic in cubics.tolist()))
        object.__setattr__(self, "_spline", (np.array(self.heights, float), cubics))

    @property
    def domain(self) -> tuple[float, float]:
        """Heights of the outermost knots [m]."""
        return self.heights[0], self.heights[-1]

    @property
    def spline(self) -> tuple[Array, Array]:
        """Knots and cubics."""
        return self._spline

    def meridian(self, v: float) -> Meridian:
        """The generating curve; v [m]."""
        i = min(max(bisect_right(self.heights, v) - 1, 0), len(self._pieces) - 1)
        a, b, c, d = self._pieces[i]
        x = v - self.heights[i]
        r = ((a * x + b) * x + c) * x + d
        return Meridian(r, v, (3.0 * a * x + 2.0 * b) * x + c, 1.0, 6.0 * a * x + 2.0 * b, 0.0)

    def symbolic_meridian(self, v: Any) -> tuple[Any, Any, Any, Any]:
        """The generating curve and its unit tangent for CasADi."""
        # A spline is its first cubic plus, from each inner knot on, the jump of the third derivative: no branches.
        a, b, c, d = self._pieces[0]
        x = v - self.heights[0]
        r, dr = ((a * x + b) * x + c) * x + d, (3.0 * a * x + 2.0 * b) * x + c
        inner = zip(self.heights[1:-1], self._pieces, self._pieces[1:], strict=False)
        for height, before, after in inner:
            x = casadi.fmax(v - height, 0.0)
            jump = after[0] - before[0]
            r, dr = r + jump * x**3, dr + 3.0 * jump * x**2
        speed = casadi.sqrt(1.0 + dr**2)
        return r, v, dr / speed, 1.0 / speed


def tapered(z0: float, z1: float, radius0: float, radius1: float) -> TurnedHandle:
    """Conical handle from radius0 at height z0 to radius1 at z1 [m]."""
    return TurnedHandle((z0, z1), (radius0, radius1))


def barrel(z0: float, z1: float, end_radius: float, middle_radius: float) -> TurnedHandle:
    """Parabolic handle with end_radius at z0 and z1 and middle_radius halfway [m]; a waist where that is smaller."""
    return TurnedHandle((z0, 0.5 * (z0 + z1), z1), (end_radius, middle_radius, end_radius))


def _require_positive(what: str, value: float) -> None:
    if not (isfinite(value) and value > 0.0):
        raise ModelError(f"{what} is {value!r}; it must be a finite number above 0")
