"""The point of a segment nearest to a surface of revolution: a search in two parameters.

By symmetry the nearest point of the surface lies in the half-plane through its axis and the segment's point, so
the distance is that of (rho(s), z(s)) from the meridian (r(v), v), to be minimised over both parameters within
their bounds.  A coarse grid finds the right valley, projected Newton steps its bottom.
"""

from __future__ import annotations

from math import atan2, hypot, inf
from typing import NamedTuple, TypeAlias

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.surfaces import SurfaceOfRevolution

Triple: TypeAlias = tuple[float, float, float]
Pair: TypeAlias = tuple[float, float]

MAX_STEPS = 40
"""Newton needs 3-8 steps from the grid's best point; more means a meridian with a kink, where the slope stays."""

FLAT = 1e-11
"""Slope (cosine between the joining line and a tangent) taken for zero: 100 times the rounding of coordinates of
0.1 m at a distance of 7 mm."""

SHRINKS = (1.0, 0.5, 0.25, 0.1, 0.01, 1e-4)
"""Fractions of a step that are tried until one does not climb."""

GRID = (9, 33)
"""Points of the coarse grid along segment and meridian: some 3 mm apart on finger and handle, finer than any waist."""

ROUNDING = 1.0 + 1e-13
"""Near the bottom the squared distance changes by less than its rounding: a step that climbs by no more is taken."""

TINY = 1e-12
"""Stands for zero in denominators: a distance of a picometre [m], or the squared speed of a still point."""

CROSSED = 1e-9
"""Distance [m] below which the segment counts as entering the surface."""

CONVEX = 1e-9
"""Least share of the Hessian's determinant that its off-diagonal must leave for it to count as convex."""


class Foot(NamedTuple):
    """Where a segment `a + s d`, s in [-length, 0], is nearest to a surface, in the surface's frame.

    Attributes:
        s: Parameter on the segment [m].
        xi: Angle on the surface [rad].
        eta: Meridian parameter on the surface.
        distance: Signed distance of the segment's point from the surface [m], negative inside.
        direction: Unit vector from the surface outwards to the segment's point.
        on_patch: Whether neither the surface's ends nor the segment's far end nor a crossing stopped the search.
        iterations: Newton steps taken.
        residual: Slope left in the free parameters [1].
    """

    s: float
    xi: float
    eta: float
    distance: float
    direction: Triple
    on_patch: bool
    iterations: int
    residual: float


class _Local(NamedTuple):
    """Half the squared distance at (s, v) with gradient and Hessian; joining vector (A, B), normal and speed there."""

    s: float
    v: float
    value: float
    g_s: float
    g_v: float
    H_ss: float
    H_sv: float
    H_vv: float
    A: float
    B: float
    n_r: float
    n_z: float
    speed: float
    s_speed: float


@compiled
def _meridian(heights: Array, cubics: Array, v: float) -> tuple[float, float, float]:
    """Radius at height v, of a spline's pieces, with two derivatives; the outermost pieces go on beyond the ends."""
    i = 0
    while i + 1 < len(cubics) and v >= heights[i + 1]:
        i += 1
    a, b, c, d = cubics[i, 0], cubics[i, 1], cubics[i, 2], cubics[i, 3]
    x = v - heights[i]
    return ((a * x + b) * x + c) * x + d, (3.0 * a * x + 2.0 * b) * x + c, 6.0 * a * x + 2.0 * b


@compiled
def _evaluate(heights: Array, cubics: Array, a: Triple, d: Triple, s: float, v: float) -> _Local:
    x, y, z = a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2]
    rho = hypot(x, y)
    if rho == 0.0:
        rho = TINY
    drho = (x * d[0] + y * d[1]) / rho
    ddrho = (d[0] * d[0] + d[1] * d[1] - drho * drho) / rho
    r, dr, ddr = _meridian(heights, cubics, v)
    A, B, speed = rho - r, z - v, hypot(dr, 1.0)
    return _Local(
        s=s,
        v=v,
        value=0.5 * (A * A + B * B),
        g_s=A * drho + B * d[2],
        g_v=-A * dr - B,
        H_ss=drho * drho + A * ddrho + d[2] * d[2],
        H_sv=-dr * drho - d[2],
        H_vv=speed * speed - A * ddr,
        A=A,
        B=B,
        n_r=1.0 / speed,
        n_z=-dr / speed,
        speed=speed,
        s_speed=hypot(drho, d[2]),
    )


@compiled
def _start(heights: Array, cubics: Array, a: Triple, d: Triple, length: float) -> tuple[float, float]:
    """Best point of the coarse grid."""
    best, s_best, v_best = inf, 0.0, heights[0]
    for j in range(GRID[1]):
        v = heights[0] + (heights[-1] - heights[0]) * j / (GRID[1] - 1)
        r = _meridian(heights, cubics, v)[0]
        for i in range(GRID[0]):
            s = length * (i / (GRID[0] - 1) - 1.0)
            across, along = hypot(a[0] + s * d[0], a[1] + s * d[1]) - r, a[2] + s * d[2] - v
            square = across * across + along * along
            if square < best:
                best, s_best, v_best = square, s, v
    return s_best, v_best


@compiled
def _is_free(x: float, slope: float, lower: float, upper: float) -> bool:
    return not (x <= lower and slope > 0.0) and not (x >= upper and slope < 0.0)


@compiled
def _clip(x: float, lower: float, upper: float) -> float:
    return min(max(x, lower), upper)


@compiled
def _newton_step(local: _Local, s_room: Pair, v_room: Pair) -> Pair:
    """Least point of the quadratic model within the bounds: its stationary point, or the best of the box's edges."""
    g_s, g_v, H_ss, H_sv, H_vv = local.g_s, local.g_v, local.H_ss, local.H_sv, local.H_vv
    if not (H_ss > 0.0 and H_ss * H_vv - H_sv * H_sv > CONVEX * H_ss * H_vv):
        # Gauss-Newton: the squares of the first derivatives alone, which never bend down.
        H_ss, H_vv = local.s_speed**2 + TINY, local.speed**2 * (1.0 + CONVEX)
    determinant = H_ss * H_vv - H_sv * H_sv
    if determinant > 0.0:
        ds, dv = (H_sv * g_v - H_vv * g_s) / determinant, (H_sv * g_s - H_ss * g_v) / determinant
        if s_room[0] <= ds <= s_room[1] and v_room[0] <= dv <= v_room[1]:
            return ds, dv
    least, best = inf, (0.0, 0.0)
    for edge in range(4):
        if edge < 2:
            ds = s_room[edge]
            dv = _clip(-(g_v + H_sv * ds) / H_vv, v_room[0], v_room[1])
        else:
            dv = v_room[edge - 2]
            ds = _clip(-(g_s + H_sv * dv) / H_ss, s_room[0], s_room[1])
        value = (g_s + 0.5 * H_ss * ds + H_sv * dv) * ds + (g_v + 0.5 * H_vv * dv) * dv
        if value < least:
            least, best = value, (ds, dv)
    return best


@compiled
def _foot(local: _Local, a: Triple, d: Triple, inside: bool, on_patch: bool, steps: int, slope: float) -> Foot:
    x, y = a[0] + local.s * d[0], a[1] + local.s * d[1]
    rho, distance = hypot(x, y), hypot(local.A, local.B)
    c, e = 1.0, 0.0
    if rho > 0.0:
        c, e = x / rho, y / rho
    n_r, n_z = local.n_r, local.n_z
    # Where the segment enters, the joining line is rounding; the surface's own normal is its limit.
    if distance >= CROSSED:
        if inside:
            distance = -distance
        n_r, n_z = local.A / distance, local.B / distance
    return Foot(local.s, atan2(e, c), local.v, distance, (n_r * c, n_r * e, n_z), on_patch, steps, slope)


@compiled
def foot_on_spline(heights: Array, cubics: Array, a: Triple, d: Triple, length: float) -> Foot:
    """`nearest_foot` of a surface that is given by the pieces of its `spline`, for compiled functions."""
    v_min, v_max = heights[0], heights[-1]
    s, v = _start(heights, cubics, a, d, length)
    here = _evaluate(heights, cubics, a, d, s, v)
    steps = 0
    while True:
        free_s = _is_free(here.s, here.g_s, -length, 0.0)
        free_v = _is_free(here.v, here.g_v, v_min, v_max)
        distance = hypot(here.A, here.B)
        crossed = distance < CROSSED
        slope = 0.0 if crossed else max(abs(here.g_s) * free_s, abs(here.g_v) * free_v / here.speed) / distance
        if slope < FLAT or steps == MAX_STEPS:
            break
        ds, dv = _newton_step(here, (-length - here.s, -here.s), (v_min - here.v, v_max - here.v))
        lower = here
        for shrink in SHRINKS:
            lower = _evaluate(heights, cubics, a, d, here.s + shrink * ds, here.v + shrink * dv)
            if lower.value <= here.value * ROUNDING:
                break
        # written so that a pose that is not a number ends the search
        if not lower.value <= here.value * ROUNDING:
            break
        here, steps = lower, steps + 1
    on_patch = free_v and not crossed and not (here.s <= -length and here.g_s > 0.0)
    inside = free_v and here.A * here.n_r + here.B * here.n_z < 0.0
    return _foot(here, a, d, inside, on_patch, steps, slope)


def nearest_foot(surface: SurfaceOfRevolution, a: Triple, d: Triple, length: float) -> Foot:
    """Nearest points of a segment and a surface of revolution.

    Args:
        surface: The surface, about the z axis; one whose meridian is a spline of the height.
        a: Point of the segment at s = 0 [m].
        d: Unit direction of the segment; it reaches from `a - length d` to a.
        length: [m], 0 for a point.

    Returns:
        The foot.  Where the segment crosses the surface the distance is 0; it is below 0 for a segment wholly inside.

    Raises:
        ModelError: the surface is no handle: its meridian is no spline of the height.
    """
    heights, cubics = surface.spline
    return foot_on_spline(heights, cubics, a, d, length)
