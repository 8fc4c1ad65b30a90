"""The planner's unknowns, and the postures of one round that they make up.

Everything is in the palm frame H; the arm is placed afterwards.  A posture of a finger is a blend of unknown
postures, since the fingers move along straight lines in joint space between them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from turnscrew.decide.plan import ROLLING, SUPPORTING, Course
from turnscrew.decide.plan_scene import Stance
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import COUPLED, INDEX, JOINTS, finger_joints

KNOTS = {Course.ROUND: 7, Course.STROKE: 13}
"""Postures along the roll: 10 deg apart in strokes of 60 and of 120, where the trapezoid rule errs by 0.2 %."""

PARKED = np.array([0.04, -0.25, 0.04, 0.04])
"""LF stretched and spread away from RF, two degrees off its limits [rad]."""

Unknowns = dict[str, Array]
"""Values of the unknowns by name: `c` (3,) the handle's middle [m], `u` (2,) x and z of the tool's axis, `stroke`
(1,), and finger postures [rad] named `TH0`.. (knots), `TH_lift`, `TH_mid`, `TH_front`, `FF_hold`, `FF_retreat`; of
one stroke, the knots and the retreats only."""


def roll_knot(finger: str, knot: int) -> str:
    """Name of a posture along the roll."""
    return f"{finger}{knot}"


def sizes(course: Course = Course.ROUND) -> dict[str, int]:
    """Number of entries of each unknown."""
    count = {finger: len(finger_joints(finger)) for finger in (*ROLLING, *SUPPORTING)}
    postures = [(finger, roll_knot(finger, knot)) for finger in ROLLING for knot in range(KNOTS[course])]
    if course is Course.ROUND:
        postures += [(finger, f"{finger}_{place}") for finger in ROLLING for place in ("lift", "mid", "front")]
        postures += [(finger, f"{finger}_hold") for finger in SUPPORTING]
    postures += [(finger, f"{finger}_retreat") for finger in SUPPORTING]
    return {"c": 3, "u": 2, "stroke": 1} | {name: count[finger] for finger, name in postures}


def in_order(unknowns: Mapping[str, Array], course: Course = Course.ROUND) -> Unknowns:
    """The unknowns in the order of `sizes`."""
    return {name: unknowns[name] for name in sizes(course)}


def finger_of(unknown: str) -> str | None:
    """The finger whose posture an unknown is, if any."""
    return unknown[:2] if unknown[:2] in (*ROLLING, *SUPPORTING) else None


Blend = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Moment:
    """A moment of the round: which blend of unknowns each finger's posture is.

    Attributes:
        name: For messages.
        blends: Of each of TH, FF, MF, RF.
        touching: Fingers whose tips may touch the handle.
    """

    name: str
    blends: Mapping[str, Blend]
    touching: tuple[str, ...]

    def stance(self, unknowns: Unknowns) -> Stance:
        """The posture in numbers."""
        fingers = {finger: blended(blend, unknowns) for finger, blend in self.blends.items()}
        return Stance(self.name, hand_posture(fingers), self.touching)


def blended(blend: Blend, unknowns: Mapping[str, Any]) -> Any:
    """Weighted sum of unknowns, numbers or symbols."""
    total: Any = 0.0
    for name, weight in blend:
        total = total + weight * unknowns[name]
    return total


def hand_posture(fingers: Mapping[str, Array]) -> Array:
    """Joint angles (28,) with the arm at zero and LF parked."""
    q = np.zeros(len(JOINTS))
    for finger, angles in (dict(fingers) | {"LF": PARKED}).items():
        q[list(finger_joints(finger))] = angles
    for follower, leader in COUPLED.items():
        q[INDEX[follower]] = q[INDEX[leader]]
    return q


def moments(course: Course = Course.ROUND) -> tuple[Moment, ...]:
    """The moments at which the planner watches all clearances."""
    found = [
        _moment(f"roll {knot}", {f: roll_knot(f, knot) for f in ROLLING}, {f: f"{f}_retreat" for f in SUPPORTING})
        for knot in range(KNOTS[course])
    ]
    return tuple(found if course is Course.STROKE else [*found, *_changes_of_fingers(KNOTS[course] - 1)])


def _changes_of_fingers(last: int) -> list[Moment]:
    """From the end of the roll, its knot `last`, to the next roll."""
    found = []
    for knot in (0, last):
        for s in (1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1.0):
            support: dict[str, Blend] = {f: ((f"{f}_retreat", 1 - s), (f"{f}_hold", s)) for f in SUPPORTING}
            rolled: dict[str, Blend] = {f: ((roll_knot(f, knot), 1.0),) for f in ROLLING}
            found.append(Moment(f"support {s:.2f} at knot {knot}", rolled | support, (*ROLLING, *SUPPORTING)))
    hold: dict[str, Blend] = {f: ((f"{f}_hold", 1.0),) for f in SUPPORTING}
    legs = (("lift", "mid"), ("mid", "front"))
    for start, end in legs:
        for s in (0.0, 1 / 4, 1 / 2, 3 / 4, 1.0):
            on_way: dict[str, Blend] = {f: ((f"{f}_{start}", 1 - s), (f"{f}_{end}", s)) for f in ROLLING}
            found.append(Moment(f"{start} to {end} {s:.2f}", on_way | hold, SUPPORTING))
    for place, knot in (("lift", last), ("front", 0)):
        halfway: dict[str, Blend] = {f: ((roll_knot(f, knot), 0.5), (f"{f}_{place}", 0.5)) for f in ROLLING}
        found.append(Moment(f"halfway to {place}", halfway | hold, (*ROLLING, *SUPPORTING)))
    return found


def _moment(name: str, rolling: Mapping[str, str], supporting: Mapping[str, str]) -> Moment:
    blends: dict[str, Blend] = {f: ((unknown, 1.0),) for f, unknown in (dict(rolling) | dict(supporting)).items()}
    return Moment(name, blends, ROLLING)


def axis(u: Any, root: Any) -> list[Any]:
    """The tool's axis from its x and z; it points to the palm's y.

    Args:
        u: (2,) x and z, numbers or symbols.
        root: Square root for that kind.
    """
    return [u[0], root(1.0 - u[0] ** 2 - u[1] ** 2), u[1]]
