"""The planner of one long stroke: thumb and middle finger roll as far as joints, drives and gaps let them.

The program is that of a round without its hand-overs, with rows for the drives: at every posture of the roll they must
be able to give the pinch that it ends with.
Paper: section V-A simulates one stroke of two fingers and leaves its postures open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from turnscrew.decide.plan import Course, GaitPlan, Handle
from turnscrew.decide.plan_requirements import STROKE
from turnscrew.decide.planner import TRADE, assemble, grip_of
from turnscrew.decide.planner_refine import Progress, Round, refine
from turnscrew.decide.planner_rows import Wish
from turnscrew.errors import PlanError

SPIN = 6.0
"""Price of the fingertips' spin on the handle: a tenth of a radian is worth 3 deg of stroke.  It slides a loaded
fingertip by some .15 mm (friction 1 over a patch of 2 mm, three fifths of it used)."""

WANTED = np.radians(120.0)
"""Stroke that plans are made for: 110 deg of screw, up to 10 lost to the blade's play in the slot, to the torque's lag
and to a joint that stands nearer to its limit than planned."""

SPARE = np.radians(1.5)
"""What the plan stays below the longest stroke, where every requirement is met without room."""


def make_stroke(
    handle: Handle, known: Sequence[GaitPlan], progress: Progress | None = None, command: str = ""
) -> GaitPlan:
    """Plans one stroke: up to `WANTED`, with the widest margins at that.

    Args:
        handle: What is to be held.
        known: Plans to start from, of strokes or of rounds; the first that leads to a stroke is taken.
        progress: Told in a line what is going on.
        command: Kept in the plan: what made it.

    Raises:
        PlanError: No stroke keeps the requirements.
    """
    told = progress or (lambda _: None)
    best: Round | None = None
    for count, plan in enumerate(known):
        told(f"start {count + 1} for one stroke of a handle of radius {handle.radius * 1e3:.1f} mm")
        found = refine(handle, STROKE, grip_of(plan, Course.STROKE), Wish(spin=SPIN), told, Course.STROKE)
        if found.keeps:
            best = found
            break
    if best is None:
        raise PlanError(f"tool.handle.radius = {handle.radius:g}: no stroke of two fingers fits this handle")
    most = min(WANTED, best.stroke - SPARE)
    told(f"longest stroke {np.degrees(best.stroke):.1f} deg; now for wide margins at {np.degrees(most):.1f}")
    wish = replace(TRADE, spin=SPIN, least_stroke=most, most_stroke=most)
    wide = refine(handle, STROKE, best.unknowns, wish, told, Course.STROKE)
    return assemble(wide if wide.keeps else best, np.random.default_rng(0), command)
