"""The gait planner: palm pose and all finger postures of one round, for a given handle.

One nonlinear program holds palm pose and postures together (`planner_problem`); it is solved step by step
(`planner_refine`), first for the longest stroke, then for the widest margins at a stroke somewhat shorter.  Starts
are known plans of handles of like radius; when these fail, the same with random changes.
Paper: section IV-D describes the gait and leaves its postures open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from turnscrew.decide.plan import ROLLING, SUPPORTING, Course, GaitPlan, Handle, between
from turnscrew.decide.plan_check import contact_heights, margins
from turnscrew.decide.plan_requirements import REQUIRED
from turnscrew.decide.planner_arm import stand
from turnscrew.decide.planner_problem import within_tilt
from turnscrew.decide.planner_refine import Progress, Round, refine
from turnscrew.decide.planner_roll import dense_roll
from turnscrew.decide.planner_round import KNOTS, PARKED, Unknowns, finger_of, in_order, roll_knot
from turnscrew.decide.planner_rows import Wish
from turnscrew.errors import PlanError
from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import robot_chain
from turnscrew.robot.joints import finger_joints
from turnscrew.robot.model import RobotModel

WANTED_STROKE = np.radians(60.0)
"""Stroke that plans are made for: 45 deg of screw a round, up to 10 lost at hand-overs, some to spare."""

LEAST_STROKE = np.radians(54.0)
"""Stroke below which a round is not worth its hand-overs: 45 deg net would be left to luck."""

SPARE = np.radians(4.0)
"""What the plan stays below the longest stroke, where every requirement is met without room."""

AMPLE = Wish(most_stroke=WANTED_STROKE + 2 * SPARE)
"""First the stroke, up to more than is wanted."""

TRADE = Wish(stroke=1.0, margin=4.0, clearance=4.0)
"""What margins are worth: 23 deg of stroke, 0.1 rad of joint range and 1 mm of clearance are the same.  Rounds are
lost to fingers that get into each other's way, not to short strokes."""

CHANGES = 4
"""Random starts that are tried when no known plan leads to a round: another half minute."""

HOPELESS = 0.1
"""Sum of slacks (10 mm, 1 rad) of the best known start above which random changes are not worth trying."""

SPREAD_ANGLE, SPREAD_PLACE, SPREAD_TILT = 0.15, 0.006, 0.1
"""Standard deviations of the random changes: of a finger's joints [rad], the handle's place [m], its axis."""


def make_plan(
    handle: Handle, known: Sequence[GaitPlan], seed: int = 0, progress: Progress | None = None, command: str = ""
) -> GaitPlan:
    """Plans a round of the gait.

    Args:
        handle: What is to be held.
        known: Plans to start from; at least one.
        seed: Of the random starts.
        progress: Told in a line what is going on.
        command: Kept in the plan: what made it.

    Raises:
        PlanError: No round keeps the requirements with a stroke of 54 deg or more.
    """
    rng = np.random.default_rng(seed)
    told = progress or (lambda _: None)
    nearest = sorted(known, key=lambda plan: abs(plan.radius - handle.radius))
    longest = _longest(handle, [grip_of(plan) for plan in nearest], rng, told)
    most = min(WANTED_STROKE, longest.stroke - SPARE)
    told(f"longest stroke {np.degrees(longest.stroke):.1f} deg; now for wide margins at {np.degrees(most):.1f} or less")
    wish = replace(TRADE, least_stroke=min(LEAST_STROKE, most), most_stroke=most)
    wide = refine(handle, REQUIRED, longest.unknowns, wish, told)
    return assemble(wide if wide.keeps else longest, rng, command)


def _longest(handle: Handle, known: Sequence[Unknowns], rng: np.random.Generator, told: Progress) -> Round:
    """The round with the longest stroke from the known grips, and from changed ones while none will do."""
    best: Round | None = None
    nearest_miss = np.inf
    for count in range(len(known) + CHANGES):
        is_known = count < len(known)
        if best is not None and best.stroke >= (WANTED_STROKE if is_known else LEAST_STROKE + SPARE):
            return best
        if not is_known and nearest_miss > HOPELESS:
            break
        told(f"start {count + 1} for a handle of radius {handle.radius * 1e3:.1f} mm")
        grip = known[count % len(known)]
        found = refine(handle, REQUIRED, grip if is_known else _changed(grip, rng), AMPLE, told)
        nearest_miss = min(nearest_miss, found.missed)
        if found.keeps and (best is None or found.stroke > best.stroke):
            best = found
    if best is None or best.stroke < LEAST_STROKE + SPARE:
        longest = "none" if best is None else f"{np.degrees(best.stroke):.0f} deg"
        raise PlanError(
            f"tool.handle.radius = {handle.radius:g}: no finger gait fits this handle (longest stroke: {longest}); "
            "radii from 0.010 to 0.018 m work"
        )
    return best


def _changed(grip: Unknowns, rng: np.random.Generator) -> Unknowns:
    limits = robot_chain().limits
    turn = {finger: rng.normal(0.0, SPREAD_ANGLE, len(finger_joints(finger))) for finger in (*ROLLING, *SUPPORTING)}
    changed = {}
    for name, value in grip.items():
        finger = finger_of(name)
        if finger is not None:
            low, high = limits[list(finger_joints(finger))].T
            changed[name] = np.clip(value + turn[finger], low, high)
    changed["c"] = grip["c"] + rng.normal(0.0, SPREAD_PLACE, 3)
    changed["u"] = within_tilt(grip["u"] + rng.normal(0.0, SPREAD_TILT, 2), REQUIRED)
    return in_order(grip | changed)


def grip_of(plan: GaitPlan, course: Course = Course.ROUND) -> Unknowns:
    """The planner's unknowns in a plan: of a round, or what one stroke has of them."""
    chain = robot_chain()
    p, R = chain.place(plan.rolling(0.0))
    p_WH, R_WH = p[chain.palm], R[chain.palm]
    axis = R_WH.T @ plan.R_WT[:, 2]
    unknowns: dict[str, Array] = {
        "c": R_WH.T @ (plan.centre - p_WH),
        "u": axis[[0, 2]],
        "stroke": np.array([plan.stroke]),
    }
    for finger in ROLLING:
        for knot in range(KNOTS[course]):
            unknowns[roll_knot(finger, knot)] = between(plan.roll[finger], knot / (KNOTS[course] - 1))
        for place, s in (("lift", 0.0), ("mid", 0.5), ("front", 1.0)) if course is Course.ROUND else ():
            unknowns[f"{finger}_{place}"] = between(plan.relocation[finger], s)
    for finger in SUPPORTING:
        unknowns[f"{finger}_retreat"] = plan.retreat[finger]
        if course is Course.ROUND:
            unknowns[f"{finger}_hold"] = plan.hold[finger]
    return in_order(unknowns, course)


def assemble(found: Round, rng: np.random.Generator, command: str) -> GaitPlan:
    """The plan of a round or a stroke: the roll made dense, the arm placed, the margins measured.

    Raises:
        PlanError: The arm cannot hold the palm like that.
    """
    unknowns, handle, course = found.unknowns, found.handle, found.course
    leaving, holding = (ROLLING, SUPPORTING) if course is Course.ROUND else ((), ())
    where = stand(RobotModel(), handle, unknowns, rng)
    plan = GaitPlan(
        handle=handle,
        stroke=found.stroke,
        contact_heights={},
        p_WS=where.p_WS,
        R_WT=np.eye(3),
        arm=where.arm,
        roll=dense_roll(handle, unknowns, course),
        relocation={f: np.array([unknowns[f"{f}_{place}"] for place in ("lift", "mid", "front")]) for f in leaving},
        hold={finger: unknowns[f"{finger}_hold"] for finger in holding},
        retreat={finger: unknowns[f"{finger}_retreat"] for finger in SUPPORTING},
        parked={"LF": PARKED},
        command=command,
    )
    return replace(plan, contact_heights=contact_heights(plan), margins=margins(plan))
