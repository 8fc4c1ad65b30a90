"""Step by step towards the best round that keeps all requirements: a sequence of nonlinear programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from turnscrew.decide.plan import Course, Handle
from turnscrew.decide.plan_requirements import Near, Requirements
from turnscrew.decide.planner_clearance import Clearance, clearance
from turnscrew.decide.planner_problem import Program
from turnscrew.decide.planner_round import Unknowns, finger_of, moments
from turnscrew.decide.planner_rows import Outcome, Wish

MOST_STEPS = 25
FREE_STEPS = 8
"""Steps of full length; from then on each is shorter by `SHORTEN`, which ends cycles between two neighbours."""
SHORTEN = 0.8

SETTLED_OBJECTIVE, SETTLED_ANGLE = 2e-3, 0.02
"""Changes of objective (0.1 deg of stroke) and joints [rad] below which a sequence has settled."""

MISSED = 1e-4
"""Sum of slacks that still counts as none: a micron, 0.1 mrad."""

GAP_ERROR = 1e-4
"""Clearance that may be missing after the last step, whose rows are exact to first order only [m]."""

SOLVED = "Solve_Succeeded"
"""IPOPT's word for success."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Round:
    """A round of the gait, or a stroke, in the palm frame.

    Attributes:
        handle: What is held.
        need: The requirements it was sought under.
        unknowns: Palm pose and postures.
        clearance: At these postures.
        missed: Sum of slacks and violations of the last step.
        steps: Programs solved.
        course: What was planned.
    """

    handle: Handle
    need: Requirements
    unknowns: Unknowns
    clearance: Clearance
    missed: float
    steps: int
    course: Course = Course.ROUND

    @property
    def keeps(self) -> bool:
        """Whether all requirements are met."""
        return self.missed < MISSED and all(
            gap > self.need.clearance(kind) - GAP_ERROR for kind, gap in self.clearance.least.items()
        )

    @property
    def stroke(self) -> float:
        """Angle the handle turns by [rad]."""
        return float(self.unknowns["stroke"][0])


def refine(
    handle: Handle, need: Requirements, start: Unknowns, wish: Wish, progress: Progress | None = None,
    course: Course = Course.ROUND,
) -> Round:  # fmt: skip
    """The round that the sequence settles on, from a start that may break every requirement.

    Args:
        handle: What is held.
        need: What the round must keep to.
        start: Values of all unknowns.
        wish: What to maximise.
        progress: Told of each step in a line.
        course: What is planned.
    """
    watched = moments(course)
    unknowns, last = start, np.inf
    near = clearance(watched, unknowns, handle)
    for step in range(1, MOST_STEPS + 1):
        length = SHORTEN ** max(0, step - FREE_STEPS)
        outcome = Program(handle, need, watched, near.points, unknowns, wish, length, course).solve()
        if not np.isfinite(outcome.missed):
            return Round(handle, need, unknowns, near, np.inf, step, course)
        moved = _largest_turn(unknowns, outcome.unknowns)
        unknowns = outcome.unknowns
        near = clearance(watched, unknowns, handle)
        if progress is not None:
            progress(_line(step, outcome, near))
        settled = abs(outcome.objective - last) < SETTLED_OBJECTIVE and moved < SETTLED_ANGLE
        last = outcome.objective
        if settled:
            break
    return Round(handle, need, unknowns, near, outcome.missed, step, course)


def _largest_turn(before: Unknowns, after: Unknowns) -> float:
    return max(float(np.abs(after[name] - before[name]).max()) for name in before if finger_of(name))


def _line(step: int, outcome: Outcome, near: Clearance) -> str:
    missed = {name: round(value, 4) for name, value in outcome.slack.items() if value > MISSED}
    return (
        f"step {step}: stroke {np.degrees(outcome.unknowns['stroke'][0]):.1f} deg, gaps to the tool "
        f"{near.least[Near.TOOL] * 1e3:.1f} mm, between fingers {near.least[Near.HAND] * 1e3:.1f} mm"
        + (f", missing {missed}" if missed else "")
        + ("" if outcome.status == SOLVED else f" ({outcome.status})")
    )
