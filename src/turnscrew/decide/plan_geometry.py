"""Distances between the hand's links, the palm and the tool, for many pairs at once.

The signed distance of a point to a convex body is convex along a straight line, so the distance of a capsule to a
convex body is the least value over its axis, found by golden section, less the radii.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
SHRINKS = 30
"""Golden sections: 0.618^30 of a 50 mm axis is 30 nm."""

RIM = 24
"""Lines that stand for a cylinder against a box: their polygon lies within 0.9 % of the radius of the circle."""


@dataclass(frozen=True, slots=True)
class Body:
    """A convex body in some common frame.

    Attributes:
        name: For messages.
        kind: "capsule", "box" or "cylinder".
        centre: (3,) [m].
        axes: (3, 3) rows: unit axes; the last is that of a capsule or cylinder.
        half: (3,) half extents along the axes: of a capsule (0, 0, half length), of a cylinder (radius, radius, half
            length) [m].
        radius: What is added all around: a capsule's radius, else 0 [m].
    """

    name: str
    kind: str
    centre: Array
    axes: Array
    half: Array
    radius: float


def capsule(name: str, start: Array, end: Array, radius: float) -> Body:
    """A capsule from the ends of its axis."""
    along = end - start
    length = float(np.sqrt(along @ along))
    return Body(name, "capsule", (start + end) / 2, _frame(along / length), np.array([0, 0, length / 2]), radius)


def cylinder(name: str, start: Array, end: Array, radius: float) -> Body:
    """A cylinder with flat ends from the centres of its ends."""
    along = end - start
    length = float(np.sqrt(along @ along))
    half = np.array([radius, radius, length / 2])
    return Body(name, "cylinder", (start + end) / 2, _frame(along / length), half, 0.0)


def box(name: str, corners: Array) -> Body:
    """A box from its corners (8, 3), the sign of x changing slowest and of z fastest."""
    edges = np.array([corners[4] - corners[0], corners[2] - corners[0], corners[1] - corners[0]])
    lengths = np.sqrt((edges**2).sum(axis=1))
    return Body(name, "box", corners.mean(axis=0), edges / lengths[:, None], lengths / 2, 0.0)


def rim_lines(body: Body) -> list[Body]:
    """Lines along a cylinder's surface, which together stand for it against a box."""
    radius, length = body.half[0], body.half[2] * body.axes[2]
    lines = []
    for angle in np.linspace(0.0, 2 * np.pi, RIM, endpoint=False):
        foot = body.centre + radius * (np.cos(angle) * body.axes[0] + np.sin(angle) * body.axes[1])
        lines.append(capsule(body.name, foot - length, foot + length, 0.0))
    return lines


def separations(ones: Sequence[Body], others: Sequence[Body]) -> tuple[Array, Array, Array]:
    """Signed distances of capsules to convex bodies, pair by pair.

    Args:
        ones: Capsules.
        others: As many bodies of any kind.

    Returns:
        Distances (m,) [m], negative where a capsule's surface is inside; and the nearest points on the capsule's axis
        (m, 3) and in the other body (m, 3), the latter without its `radius`.
    """
    centre = np.array([one.centre for one in ones])
    along = np.array([one.half[2] * one.axes[2] for one in ones])
    radii = np.array([one.radius + other.radius for one, other in zip(ones, others, strict=True)])
    place = np.array([other.centre for other in others])
    axes = np.array([other.axes for other in others])
    half = np.array([other.half for other in others])
    is_round = np.array([other.kind == "cylinder" for other in others])

    def distance(t: Array) -> Array:
        local = _local(centre + t[:, None] * along - place, axes)
        return _signed_distance(local, half, is_round)

    t = _least(distance, len(centre))
    points = centre + t[:, None] * along
    nearest = _clamped(_local(points - place, axes), half, is_round)
    in_other = place + (axes * nearest[:, :, None]).sum(axis=1)
    return distance(t) - radii, points, in_other


def nearest_point(point: Array, body: Body) -> Array:
    """Point (3,) of a body, without its `radius`, nearest to a point (3,) [m]."""
    local = _clamped((body.axes @ (point - body.centre))[None], body.half[None], np.array([body.kind == "cylinder"]))
    return np.asarray(body.centre + local[0] @ body.axes)


def _least(function: Callable[[Array], Array], count: int) -> Array:
    """Minimiser (count,) over [-1, 1] of convex functions: golden section, or an end where that is lower still."""
    low, high = np.full(count, -1.0), np.full(count, 1.0)
    for _ in range(SHRINKS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        keep_left = function(left) < function(right)
        high, low = np.where(keep_left, right, high), np.where(keep_left, low, left)
    tries = np.array([(low + high) / 2, np.full(count, -1.0), np.full(count, 1.0)])
    lowest = np.argmin([function(t) for t in tries], axis=0)
    return np.asarray(tries[lowest, np.arange(count)])


def _local(offsets: Array, axes: Array) -> Array:
    return np.asarray((axes * offsets[:, None, :]).sum(axis=2))


def _signed_distance(local: Array, half: Array, is_round: Array) -> Array:
    radial = np.hypot(local[:, 0], local[:, 1]) - half[:, 0]
    excess = np.abs(local) - half
    excess[:, 0] = np.where(is_round, radial, excess[:, 0])
    excess[:, 1] = np.where(is_round, radial, excess[:, 1])
    outside = np.maximum(excess, 0.0)
    outside[:, 1] = np.where(is_round, 0.0, outside[:, 1])
    return np.asarray(np.sqrt((outside**2).sum(axis=1)) + np.minimum(excess.max(axis=1), 0.0))


def _clamped(local: Array, half: Array, is_round: Array) -> Array:
    in_box = np.clip(local, -half, half)
    reach = np.hypot(local[:, 0], local[:, 1])
    shrink = np.minimum(1.0, half[:, 0] / np.maximum(reach, 1e-12))
    in_round = local * np.stack([shrink, shrink, np.ones_like(shrink)], axis=1)
    in_round[:, 2] = in_box[:, 2]
    return np.where(is_round[:, None], in_round, in_box)


def _frame(axis: Array) -> Array:
    """Right-handed rows with the last along a unit axis (3,)."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = helper - (helper @ axis) * axis
    first /= np.sqrt(first @ first)
    second = np.array([
        axis[1] * first[2] - axis[2] * first[1],
        axis[2] * first[0] - axis[0] * first[2],
        axis[0] * first[1] - axis[1] * first[0],
    ])  # fmt: skip
    return np.array([first, second, axis])
