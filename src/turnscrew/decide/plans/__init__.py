"""Gait plans by handle: shipped with the package, kept in the user's cache, or planned on demand."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.resources import files

from turnscrew.decide.plan import Course, GaitPlan, Handle
from turnscrew.decide.plan_file import from_json
from turnscrew.decide.plans.store import fetch, keep

DEFAULT_RADIUS = 0.018

SHIPPED = ("r10.json", "r12.json", "r15.json", "r18.json", "stroke-r12.5.json")
"""Plans that ship; each holds the command that made it."""

STARTS = ("starts/r10.json", "starts/r12.json", "starts/r15.json", "starts/r18.json")
"""Grips that planning starts from, found by the same planner from random starts; not all keep its requirements."""

STROKE_START = "starts/stroke.json"
"""What planning one long stroke starts from, found by the same planner from the round of 12 mm."""

SAME = 1e-9
"""Difference below which two dimensions of a handle are the same [m]."""


def plan_for(
    radius: float = DEFAULT_RADIUS,
    *,
    length: float = Handle.length,
    middle: float = Handle.middle,
    shaft_radius: float = Handle.shaft_radius,
    course: Course = Course.ROUND,
    fresh: bool = False,
    progress: Callable[[str], None] | None = None,
) -> GaitPlan:
    """The gait plan of a handle: shipped, else from the user's cache, else planned (seconds to a minute) and kept.

    Args:
        radius: Of the handle [m].
        length: Of the handle [m].
        middle: Height of the handle's middle above the tip [m].
        shaft_radius: Of the shaft below the handle [m].
        course: A round of the gait, or one long stroke.
        fresh: Plan anew, whatever is at hand; the result is not kept.
        progress: Told in a line what the planner is doing.

    Raises:
        PlanError: No gait fits the handle.
    """
    handle = Handle(radius, length, middle, shaft_radius)
    if fresh:
        return _planned(handle, course, progress)
    for plan in _shipped():
        if plan.course is course and _is_same(plan.handle, handle):
            return plan
    found = fetch(handle, course)
    if found is None:
        found = _planned(handle, course, progress)
        keep(found)
    return found


def _planned(handle: Handle, course: Course, progress: Callable[[str], None] | None) -> GaitPlan:
    # the planner brings CasADi, which takes a second to load and which plans at hand do without
    from turnscrew.decide.planner import make_plan
    from turnscrew.decide.planner_stroke import make_stroke

    make, starts = (make_plan, STARTS) if course is Course.ROUND else (make_stroke, (STROKE_START, *STARTS))
    return make(handle, [_read(name) for name in starts], progress=progress, command=command(handle, course))


def command(handle: Handle, course: Course = Course.ROUND) -> str:
    """The command that plans a handle."""
    usual = Handle(handle.radius)
    options = [f"--radius {handle.radius:g}"]
    options += [
        f"--{name.replace('_', '-')} {getattr(handle, name):g}"
        for name in ("length", "middle", "shaft_radius")
        if getattr(handle, name) != getattr(usual, name)
    ]
    if course is Course.STROKE:
        options.append("--stroke")
    return f"turnscrew plan {' '.join(options)} --fresh"


@cache
def _shipped() -> tuple[GaitPlan, ...]:
    return tuple(_read(name) for name in SHIPPED)


def _read(name: str) -> GaitPlan:
    text = files(__package__ or "").joinpath(name).read_text(encoding="utf-8")
    return from_json(text, f"the shipped plan {name}")


def _is_same(one: Handle, other: Handle) -> bool:
    pairs = ((getattr(one, name), getattr(other, name)) for name in ("radius", "length", "middle", "shaft_radius"))
    return all(abs(a - b) < SAME for a, b in pairs)
