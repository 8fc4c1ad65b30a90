"""Clearance as smooth constraints: gaps between points of one body and another body, near the present postures.

The nearest point on the other body and the direction to it are held while the planner takes a step.  By the envelope
theorem the gap's first derivatives are then exact, and the step is short.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from turnscrew.decide.plan import Handle
from turnscrew.decide.plan_geometry import Body, nearest_point, separations
from turnscrew.decide.plan_requirements import Near
from turnscrew.decide.plan_scene import HANDLE, LINKS, SHAFT, Gaps, Stance, gaps, link_name
from turnscrew.decide.planner_kinematics import finger_kinematics
from turnscrew.decide.planner_round import PARKED, Moment, Unknowns, axis, blended
from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import robot_chain
from turnscrew.robot.joints import FINGERS

WATCHED = 0.010
"""Gaps above this are left alone for a step [m]: two fingers that step by 0.1 rad each come 8 mm nearer."""

MOST_PAIRS = 300
"""Smallest gaps first; more only slow the solver down."""


@dataclass(frozen=True, slots=True)
class Nearness:
    """A point of a link and what it is near to.

    Attributes:
        moment: Index of the moment.
        one: The link.
        other: What it is near to.
        place: Where on the link's axis the point is, -1 to 1.
        partner: Where on the other's axis the nearest point is: -1 to 1 on a link, heights above the handle's
            middle on the tool [m].
        point: (3,) the nearest point on a box of the palm [m].
        direction: (3,) unit vector to the link's point.
        gap: Present gap [m].
        near: What kind of gap it is.
    """

    moment: int
    one: str
    other: str
    place: float
    partner: float
    point: Array
    direction: Array
    gap: float
    near: Near


@dataclass(frozen=True)
class Clearance:
    """The clearance rows of one step.

    Attributes:
        points: What to watch.
        least: Smallest gap of each kind [m].
    """

    points: tuple[Nearness, ...]
    least: dict[Near, float]


def clearance(moments: Sequence[Moment], unknowns: Unknowns, handle: Handle) -> Clearance:
    """What is near to what at the present unknowns."""
    c, u = unknowns["c"], np.array(axis(unknowns["u"], np.sqrt))
    stances: list[Stance] = [moment.stance(unknowns) for moment in moments]
    found = gaps(stances, handle, c, u)
    order = np.argsort(found.gap)
    order = order[found.gap[order] < WATCHED][:MOST_PAIRS]
    points = [nearness for row in order for nearness in _points(found, int(row), c, u)]
    return Clearance(tuple(points), {kind: float(found.gap[found.least(kind)]) for kind in Near})


def _points(found: Gaps, row: int, c: Array, u: Array) -> list[Nearness]:
    """The nearest point of a link and its ends, as far as they are near."""
    link, other = found.ones[row], found.others[row]
    along = link.half[2] * link.axes[2]
    closest = float((separations([link], [other])[1][0] - link.centre) @ along / (along @ along))
    points = []
    # an end that is the nearest point itself is not taken twice
    for place in (closest, *(end for end in (-1.0, 1.0) if abs(end - closest) > 0.02)):
        point = link.centre + place * along
        nearest, direction, gap = _towards(point, other)
        gap -= link.radius + other.radius
        if gap < WATCHED:
            partner = float((nearest - other.centre) @ other.axes[2]) / max(other.half[2], 1e-9)
            if other.name in (HANDLE, SHAFT):
                partner = float((nearest - c) @ u)
            kind, names = found.near[row], found.pairs[row]
            points.append(Nearness(int(found.stance[row]), *names, place, partner, nearest, direction, gap, kind))
    return points


def _towards(point: Array, other: Body) -> tuple[Array, Array, float]:
    """Nearest point of a body, direction from it to the point, and their distance; from a body's axis when inside."""
    nearest = nearest_point(point, other)
    offset = point - nearest
    distance = float(np.sqrt(offset @ offset))
    if distance > 1e-5:
        return nearest, offset / distance, distance
    along = float((point - other.centre) @ other.axes[2])
    offset = point - other.centre - along * other.axes[2]
    depth = float(np.sqrt(offset @ offset))
    direction = offset / depth if depth > 1e-5 else other.axes[0]
    return nearest, direction, depth - float(other.half[0])


def gap_rows(
    near: Sequence[Nearness], moments: Sequence[Moment], symbols: dict[str, ca.SX], handle: Handle, u: ca.SX
) -> ca.SX:
    """Gaps of the watched points as functions of the unknowns.

    Args:
        near: Points to watch.
        moments: Of the round.
        symbols: The unknowns.
        handle: The tool's dimensions.
        u: (3,) the tool's axis.
    """
    ends_of = _ends(moments, symbols)
    radius_of = {shape.name: shape.radius for shape in robot_chain().shapes}
    rows = []
    for item in near:
        point = _on_axis(ends_of(item.moment, item.one), item.place)
        n = ca.DM(item.direction)
        if item.other in (HANDLE, SHAFT):
            across = n - ca.dot(n, u) * u
            radius = handle.radius if item.other == HANDLE else handle.shaft_radius
            # the tiny term keeps the root smooth where the direction is along the axis
            support = radius * ca.sqrt(ca.dot(across, across) + 1e-10)
            gap = ca.dot(n, point - symbols["c"] - item.partner * u) - support
        elif item.other in _LINK_NAMES:
            gap = ca.dot(n, point - _on_axis(ends_of(item.moment, item.other), item.partner)) - radius_of[item.other]
        else:
            gap = ca.dot(n, point - ca.DM(item.point))
        rows.append(gap - radius_of[item.one])
    return ca.vertcat(*rows)


_LINK_NAMES = {link_name(finger, link): (finger, place) for finger in FINGERS for place, link in enumerate(LINKS)}


def _ends(moments: Sequence[Moment], symbols: dict[str, ca.SX]) -> Callable[[int, str], ca.SX]:
    cache: dict[tuple[object, str], ca.SX] = {}

    def ends(moment: int, name: str) -> ca.SX:
        finger, place = _LINK_NAMES[name]
        blend = moments[moment].blends.get(finger)
        key = (blend, finger)
        if key not in cache:
            angles = ca.SX(PARKED) if blend is None else blended(blend, symbols)
            cache[key] = finger_kinematics(finger).links(angles)
        return cache[key][:, 2 * place : 2 * place + 2]

    return ends


def _on_axis(ends: ca.SX, place: float) -> ca.SX:
    return ends[:, 0] * (1 - place) / 2 + ends[:, 1] * (1 + place) / 2
