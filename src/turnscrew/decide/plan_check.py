"""Judges a gait plan by geometry alone, independently of the planner and of MuJoCo's collision detection.

Every phase is sampled densely: gaps of all links, contacts, joint limits; rolling without slip is integrated along
the path from closest points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from turnscrew.decide.plan import ROLLING, SUPPORTING, Course, GaitPlan
from turnscrew.decide.plan_requirements import REQUIRED, STROKE, Near, Requirements
from turnscrew.decide.plan_scene import Stance, gaps, palm_gap
from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import robot_chain
from turnscrew.robot.joints import ARM, INDEX, WRIST, finger_joints

SAMPLES = 13
"""Postures along each phase: 5 deg of roll apart, 4 mm of a fingertip's way back."""

ROLL_SAMPLES = 241
"""Postures along the roll for integrating slip: 0.3 deg apart, where the midpoint rule errs by a micron."""

GAP_ERROR = 2e-5
"""Largest gap of a fingertip that should touch [m]: what a straight line between rows 3 deg apart leaves."""

SLIP = 3e-4
"""Largest slip over a roll that still counts as rolling [m]: what a held grasp creeps by in a stroke anyway."""

SAMPLING = 1.5e-4
"""Clearance that a sample between the planner's own may lack [m]."""

ROUNDING = 1e-5
"""Rounding of the plan file, and the planner's own tolerance, in any unit."""

BETWEEN_KNOTS = 1e-3
"""What the roll between the planner's knots may exceed its bounds by, in radians and cosines."""


@dataclass(frozen=True, slots=True)
class Touch:
    """A fingertip at the handle, from closest points of capsule axis and handle axis.

    Attributes:
        gap: Between the surfaces [m].
        height: Of the contact above the handle's middle [m].
        n: (3,) outward normal of the handle in W.
        point: (3,) contact on the handle in W [m].
        side: n.z with the fingertip's axis z: negative when its half ball touches.
        lever: Fingertip centre from the knuckle along the palm's z [m].
        R: (3, 3) orientation of the fingertip in W.
        p: (3,) its centre in W [m].
    """

    gap: float
    height: float
    n: Array
    point: Array
    side: float
    lever: float
    R: Array
    p: Array


def touch(plan: GaitPlan, q: Array, finger: str) -> Touch:
    """Where a finger is nearest to the handle at joint angles q (28,)."""
    chain = robot_chain()
    p, R = chain.place(q)
    tip = chain.tips[finger]
    axis, p_F, z = plan.R_WT[:, 2], p[tip.body] + R[tip.body] @ tip.p, R[tip.body][:, 2]
    offset = p_F - plan.centre
    across, lean = offset - (offset @ axis) * axis, z - (z @ axis) * axis
    back = float(np.clip((across @ lean) / max(lean @ lean, 1e-12), 0.0, tip.length))
    nearest = offset - back * z
    height = float(nearest @ axis)
    radial = nearest - height * axis
    reach = float(np.sqrt(radial @ radial))
    n = radial / reach
    knuckle = chain.names.index(f"{finger.lower()}{'base' if finger == 'TH' else 'knuckle'}")
    lever = float(R[chain.palm][:, 2] @ (p_F - p[knuckle]))
    gap = reach - plan.radius - tip.rho
    point = plan.centre + height * axis + plan.radius * n
    return Touch(gap, height, n, point, float(n @ z), lever, R[tip.body], p_F)


def required(plan: GaitPlan) -> Requirements:
    """What a plan has to keep to."""
    return REQUIRED if plan.course is Course.ROUND else STROKE


def violations(plan: GaitPlan) -> list[str]:
    """Requirements that a plan breaks, one line each with its figure."""
    return [*_limits(plan), *_contacts(plan), *_slips(plan), *_clearances(plan), *_lifts(plan)]


def margins(plan: GaitPlan) -> dict[str, float]:
    """What a plan keeps clear of its limits, in SI units: joints, gaps, opposition, level, slip."""
    least = _least_gaps(plan)
    rolled = [plan.rolling(s) for s in np.linspace(0.0, 1.0, SAMPLES)]
    pairs = [(touch(plan, q, "TH"), touch(plan, q, "MF")) for q in rolled]
    count = len(ARM) + len(WRIST)
    low, high = robot_chain().limits[:count].T
    found = {
        "finger_joints": min(float(_joint_margin(q).min()) for q in _postures(plan)),
        "arm_joints": float(np.minimum(plan.arm - low, high - plan.arm).min()),
        "tool_clearance": least[Near.TOOL][0],
        "own_clearance": least[Near.OWN][0],
        "finger_clearance": least[Near.HAND][0],
        "opposition": max(float(one.n @ other.n) for one, other in pairs),
        "level": max(abs(one.height - other.height) for one, other in pairs),
        "rolling_slip": max(slip(plan, finger) for finger in ROLLING),
    }
    if plan.course is Course.ROUND:
        hold = touch(plan, plan.adding(1.0), "FF"), touch(plan, plan.adding(1.0), "RF")
        found["hold_opposition"] = float(hold[0].n @ hold[1].n)
        found["hold_level"] = abs(hold[0].height - hold[1].height)
    return found


def contact_heights(plan: GaitPlan) -> dict[str, float]:
    """Height above the tip at which each finger touches: TH and MF at the roll's start, FF and RF holding [m]."""
    q, fingers = plan.rolling(0.0), [*ROLLING]
    if plan.course is Course.ROUND:
        q, fingers = plan.adding(1.0, rolled=0.0), ["TH", "FF", "MF", "RF"]
    return {finger: plan.handle.middle + touch(plan, q, finger).height for finger in fingers}


def slip(plan: GaitPlan, finger: str) -> float:
    """Largest distance by which a rolling fingertip's contact has slid on the handle [m].

    Step by step, the finger's material at the contact moves by `dp + dphi x (x - p)` and the handle's by
    `-dyaw z x (x - c)`; their difference, without its part along the normal, is summed in the contact's frame.
    """
    axis, dyaw = plan.R_WT[:, 2], -plan.stroke / (ROLL_SAMPLES - 1)
    marks = [touch(plan, plan.rolling(s), finger) for s in np.linspace(0.0, 1.0, ROLL_SAMPLES)]
    total, worst = np.zeros(2), 0.0
    for one, other in pairwise(marks):
        turn = other.R @ one.R.T
        dphi = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        point, p = (one.point + other.point) / 2, (one.p + other.p) / 2
        material = other.p - one.p + np.cross(dphi, point - p)
        difference = material - dyaw * np.cross(axis, point - plan.centre)
        n = one.n + other.n
        tangent = np.cross(axis, n) / np.sqrt(n @ n)
        total += [difference @ tangent, difference @ axis]
        worst = max(worst, float(np.sqrt(total @ total)))
    return worst


def _phases(plan: GaitPlan) -> tuple[tuple[str, Callable[[float], Array], tuple[str, ...]], ...]:
    everyone = (*ROLLING, *SUPPORTING)
    rolling = ("rolling", plan.rolling, ROLLING)
    if plan.course is Course.STROKE:
        return (rolling,)
    return (
        rolling,
        ("adding", plan.adding, everyone),
        ("leaving", plan.leaving, everyone),
        ("relocating", plan.relocating, SUPPORTING),
        ("returning", plan.returning, everyone),
        ("removing", lambda s: plan.adding(1.0 - s, rolled=0.0), everyone),
    )


def _postures(plan: GaitPlan) -> list[Array]:
    return [phase(s) for _, phase, _ in _phases(plan) for s in np.linspace(0.0, 1.0, SAMPLES)]


def _joint_margin(q: Array) -> Array:
    """Distance of the joints of TH, FF, MF and RF from their limits [rad]."""
    joints = [joint for finger in (*ROLLING, *SUPPORTING) for joint in finger_joints(finger)]
    low, high = robot_chain().limits[joints].T
    return np.asarray(np.minimum(q[joints] - low, high - q[joints]))


def _limits(plan: GaitPlan) -> list[str]:
    found: dict[str, float] = {}
    names = list(INDEX)
    limits = robot_chain().limits
    for q in _postures(plan):
        for finger in (*ROLLING, *SUPPORTING):
            for joint in finger_joints(finger):
                margin = float(min(q[joint] - limits[joint, 0], limits[joint, 1] - q[joint]))
                if margin < required(plan).joint_margin - BETWEEN_KNOTS:
                    found[names[joint]] = min(margin, found.get(names[joint], margin))
    for joint, angle in enumerate(plan.arm):
        margin = float(min(angle - limits[joint, 0], limits[joint, 1] - angle))
        if margin < required(plan).joint_margin:
            found[names[joint]] = margin
    broken = [f"{name} comes within {margin:.3f} rad of its limit" for name, margin in found.items()]
    bend = -float(plan.roll["TH"][:, -1].max())
    if bend < required(plan).thumb_bend - BETWEEN_KNOTS:
        broken.append(f"the thumb's last joint bends by {bend:.3f} rad only, less than {required(plan).thumb_bend:g}")
    return broken


def _contacts(plan: GaitPlan) -> list[str]:
    found: list[str] = []
    # halfway between the rows too, where straight lines leave the handle most
    for s in np.linspace(0.0, 1.0, 2 * len(plan.roll["TH"]) - 1):
        q = plan.rolling(s)
        thumb, middle = touch(plan, q, "TH"), touch(plan, q, "MF")
        found += _pair(f"rolling {s:.2f}", thumb, middle, REQUIRED.opposition, REQUIRED.rolling_side, REQUIRED.level)
        found += _below(f"rolling {s:.2f}: MF's lever", middle.lever, REQUIRED.rolling_lever)
    if plan.course is Course.ROUND:
        q = plan.adding(1.0)
        first, ring = touch(plan, q, "FF"), touch(plan, q, "RF")
        found += _pair("holding", first, ring, REQUIRED.hold_opposition, REQUIRED.holding_side, REQUIRED.hold_level)
        found += _below("holding: FF's lever", first.lever, REQUIRED.holding_lever)
        found += _below("holding: RF's lever", ring.lever, REQUIRED.holding_lever)
    for finger, height in contact_heights(plan).items():
        inside = plan.handle.length / 2 - abs(height - plan.handle.middle)
        # 0.1 mm: these are the roll's start, which the planner's knots hold to a tenth of that
        found += _below(f"{finger}'s contact is inside the handle's end by: it", inside, REQUIRED.edge - 1e-4)
    return found


def _pair(where: str, one: Touch, other: Touch, opposition: float, side: float, level: float) -> list[str]:
    cosine, step = float(one.n @ other.n), abs(one.height - other.height)
    # 0.1 mm in height: the planner's knots keep the bounds, the roll between them is only nearly so
    return [
        *([f"{where}: normals at {cosine:.3f}, not {opposition}"] if cosine > opposition + BETWEEN_KNOTS else []),
        *([f"{where}: contacts {step * 1e3:.2f} mm from level"] if step > level + 1e-4 else []),
        *[f"{where}: gap {t.gap * 1e6:.0f} um" for t in (one, other) if abs(t.gap) > GAP_ERROR],
        *[f"{where}: fingertip leans away ({t.side:.3f})" for t in (one, other) if t.side > side + BETWEEN_KNOTS],
    ]  # fmt: skip


def _slips(plan: GaitPlan) -> list[str]:
    slips = {finger: slip(plan, finger) for finger in ROLLING}
    return [f"{finger} slips {value * 1e3:.2f} mm while rolling" for finger, value in slips.items() if value > SLIP]


def _least_gaps(plan: GaitPlan) -> dict[Near, tuple[float, str]]:
    """Smallest gap of each kind [m], and where."""
    stances = [
        Stance(f"{name} {s:.2f}", phase(s), touching)
        for name, phase, touching in _phases(plan)
        for s in np.linspace(0.0, 1.0, SAMPLES)
    ]
    chain = robot_chain()
    p, R = chain.place(plan.rolling(0.0))
    p_WH, R_WH = p[chain.palm], R[chain.palm]
    c, u = R_WH.T @ (plan.centre - p_WH), R_WH.T @ plan.R_WT[:, 2]
    found = gaps(stances, plan.handle, c, u)
    least = {}
    for kind in Near:
        row = found.least(kind)
        one, other = found.pairs[row]
        where = f"{stances[found.stance[row]].name}: {one.removeprefix('C_')} and {other.removeprefix('C_')}"
        least[kind] = float(found.gap[row]), where
    palm = palm_gap(plan.rolling(0.0), plan.handle, c, u)
    least[Near.TOOL] = min(least[Near.TOOL], (palm, "palm and handle"))
    return least


def _clearances(plan: GaitPlan) -> list[str]:
    found = []
    for kind, (gap, where) in _least_gaps(plan).items():
        found += _below(f"{where}: gap", gap, REQUIRED.clearance(kind) - SAMPLING)
    return found


def _lifts(plan: GaitPlan) -> list[str]:
    """Fingers that leave must get away from the handle steadily, and far enough."""
    found: list[str] = []
    if plan.course is Course.STROKE:
        return found
    ways = (
        ("leaving", plan.leaving, ROLLING, REQUIRED.lift),
        ("returning backwards", lambda s: plan.returning(1.0 - s), ROLLING, REQUIRED.lift),
        ("removing", lambda s: plan.adding(1.0 - s, rolled=0.0), SUPPORTING, REQUIRED.retreat),
    )
    for name, way, fingers, least in ways:
        for finger in fingers:
            gap = np.array([touch(plan, way(s), finger).gap for s in np.linspace(0.0, 1.0, SAMPLES)])
            near = gap[:-1] < REQUIRED.cleared * least
            if (near & (np.diff(gap) < 0.0)).any():
                found.append(f"{name}: {finger} comes back towards the handle")
            found += _below(f"{name}: {finger}'s gap", float(gap[-1]), REQUIRED.cleared * least)
    return found


def _below(what: str, value: float, least: float) -> list[str]:
    return [f"{what} is {value * 1e3:.2f} mm, less than {least * 1e3:.2f}"] if value < least - ROUNDING else []
