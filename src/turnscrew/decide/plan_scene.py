"""All gaps between fingers, palm and tool in given postures of the hand, in the palm frame H."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from turnscrew.decide.plan import Handle
from turnscrew.decide.plan_geometry import Body, box, capsule, cylinder, rim_lines, separations
from turnscrew.decide.plan_requirements import Near
from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import PALM_SHAPES, robot_chain
from turnscrew.robot.joints import FINGERS

LINKS = ("proximal", "middle", "distal")
HANDLE, SHAFT = "handle", "shaft"


@dataclass(frozen=True, slots=True)
class Stance:
    """A posture of the hand at one moment of the round.

    Attributes:
        name: For messages.
        q: (28,) joint angles [rad].
        touching: Fingers whose tips may touch the handle.
    """

    name: str
    q: Array
    touching: tuple[str, ...]


@dataclass(frozen=True)
class Gaps:
    """Signed gaps (m,) [m] between bodies, with what it takes to tell how they change.

    Attributes:
        gap: (m,) [m].
        stance: (m,) index of the stance.
        near: (m) what kind of gap it is.
        pairs: (m) names of the two bodies; the first is a finger's link.
        ones: (m) the links.
        others: (m) what they are near to.
    """

    gap: Array
    stance: Array
    near: list[Near]
    pairs: list[tuple[str, str]]
    ones: list[Body]
    others: list[Body]

    def least(self, kind: Near) -> int:
        """Row of the smallest gap of a kind."""
        return int(np.argmin(np.where([near is kind for near in self.near], self.gap, np.inf)))


@cache
def link_pairs() -> tuple[tuple[str, str], ...]:
    """Pairs of bodies that must stay apart: links of different fingers, links and palm, links and tool."""
    chain = robot_chain()
    body_of = {shape.name: shape.body for shape in chain.shapes}
    links = [link_name(finger, link) for finger in FINGERS for link in LINKS]
    pairs = []
    for place, one in enumerate(links):
        later = [other for other in links[place + 1 :] if other[:4] != one[:4]]
        for other in (*later, *PALM_SHAPES):
            a, b = sorted((body_of[one], body_of[other]))
            if (a, b) not in chain.apart:
                pairs.append((one, other))
        pairs += [(one, HANDLE), (one, SHAFT)]
    return tuple(pairs)


def link_name(finger: str, link: str) -> str:
    """Name of a finger link's collision shape."""
    return f"C_{finger.lower()}{link}"


def tool_bodies(handle: Handle, c: Array, u: Array) -> tuple[Body, Body]:
    """Handle and shaft.

    Args:
        handle: The tool's dimensions.
        c: (3,) middle of the handle [m].
        u: (3,) unit vector along the tool's axis, up.
    """
    half = handle.length / 2
    return (
        cylinder(HANDLE, c - half * u, c + half * u, handle.radius),
        cylinder(SHAFT, c - handle.middle * u, c - half * u, handle.shaft_radius),
    )


def hand_bodies(q: Array) -> dict[str, Body]:
    """Links of the fingers and boxes of the palm at joint angles q (28,), in H, by name."""
    chain = robot_chain()
    p, R = chain.place(q)
    p_WH, R_WH = p[chain.palm], R[chain.palm]
    bodies = {}
    for shape in chain.shapes:
        corners = (p[shape.body] + shape.vertices @ R[shape.body].T - p_WH) @ R_WH
        if len(corners) == 2:
            bodies[shape.name] = capsule(shape.name, corners[0], corners[1], shape.radius)
        else:
            bodies[shape.name] = box(shape.name, corners)
    return bodies


def gaps(stances: Sequence[Stance], handle: Handle, c: Array, u: Array) -> Gaps:
    """Gaps of all pairs in all stances; the tool stands still in H.

    Args:
        stances: Postures.
        handle: The tool's dimensions.
        c: (3,) middle of the handle in H [m].
        u: (3,) unit vector along the tool's axis, up, in H.
    """
    tool = dict(zip((HANDLE, SHAFT), tool_bodies(handle, c, u), strict=True))
    ones, others, pairs, stance, near = [], [], [], [], []
    for index, (moment, bodies) in enumerate((moment, hand_bodies(moment.q)) for moment in stances):
        bodies |= tool
        tips = {link_name(finger, "distal") for finger in moment.touching}
        touching = {link_name(finger, link) for finger in moment.touching for link in LINKS}
        for one, other in link_pairs():
            if not (other == HANDLE and one in tips):
                ones.append(bodies[one])
                others.append(bodies[other])
                pairs.append((one, other))
                stance.append(index)
                at_tool = Near.OWN if one in touching else Near.TOOL
                near.append(at_tool if other in (HANDLE, SHAFT) else Near.HAND)
    return Gaps(separations(ones, others)[0], np.array(stance), near, pairs, ones, others)


def palm_gap(q: Array, handle: Handle, c: Array, u: Array) -> float:
    """Gap between the palm and the handle [m]."""
    lines = rim_lines(tool_bodies(handle, c, u)[0])
    bodies = hand_bodies(q)
    return min(float(separations(lines, [bodies[name]] * len(lines))[0].min()) for name in PALM_SHAPES)
