"""Turning a tool in the air by the finger gait: the arm alone turns it by some 15 deg, a slot may be 90 deg away.

A slot looks the same after half a turn, so turning on as the gait does gets to any heading, in three strokes at most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.decide.gait import Gait
from turnscrew.decide.gait_state import GaitState, Phase
from turnscrew.decide.reseat_gather import Gathering
from turnscrew.decide.reseat_state import FOUR, ReseatState
from turnscrew.geometry.euler import yaw
from turnscrew.signals import Estimate, Goal
from turnscrew.values import changed

FRESH = (Phase.RELOCATE, Phase.RETURN, Phase.REGRIP, Phase.REMOVE)
"""Phases after which thumb and middle finger stand where a roll begins."""

STUCK = 3.0
"""Time after which fingers that do not come to touch are helped as the recovery helps them [s]: they need half a
second, a second at a slow pace."""


def handed_over(gait: Gait, state: GaitState, phase: Phase) -> GaitState:
    """The gait's state at the beginning of a phase in which all four fingers hold the tool, nothing rolled yet.

    Args:
        gait: The gait.
        state: Before.
        phase: Of a hand-over.
    """
    return changed(
        state, phase=phase, clock=0.0, rolled=0.0, aside=0.0, near=False, gripping=FOUR.copy(),
        q_target=gait.plan.adding(1.0),
    )  # fmt: skip


@dataclass(frozen=True)
class AirWalk:
    """The gait without a screw.

    Attributes:
        gait: With full strokes, and the hand left where it is.
        gathering: Rights the tool meanwhile.
        start: Heading of the slot at angle zero [rad].
    """

    gait: Gait
    gathering: Gathering
    start: float

    def begin(self, state: ReseatState, estimate: Estimate) -> ReseatState:
        """Four fingers hold the tool; it is to be turned in the hand until its blade is parallel to the slot.

        What the arm has turned the hand by until now does not count, for then it would have no way left.
        """
        left = (yaw(self.gathering.back(estimate) @ estimate.R_WT) - (self.start - state.theta)) % np.pi
        phase = Phase.REMOVE if state.gait.phase in FRESH else Phase.SUPPORT
        gait = changed(handed_over(self.gait, state.gait, phase), vain=0)
        return changed(state, gait=gait, left=float(left))

    def update(self, state: ReseatState, estimate: Estimate, dt: float) -> tuple[ReseatState, Goal, bool]:
        """One tick; also whether four fingers have come to hold the tool after a roll."""
        before = self._unstuck(state.gait, estimate)
        gait, goal = self.gait.update(before, estimate, dt)
        begun = before.rolled if before.clock > 0.0 else 0.0
        left = state.left - (gait.rolled - begun if before.phase is Phase.ROLL else 0.0)
        gait = changed(gait, stroke=min(gait.stroke, gait.rolled + max(left, 0.0)))
        state = changed(state, gait=gait, gripping=gait.gripping.copy(), left=left)
        motion = self.gathering.righting(state, estimate, goal.turn_rate)
        goal = changed(goal, V_tool=motion.tool, turn_rate=0.0, tip_force=0.0)
        return state, goal, before.phase is Phase.ADD and gait.phase is Phase.SUPPORT

    def _unstuck(self, gait: GaitState, estimate: Estimate) -> GaitState:
        """The gait's state, but for fingers that have not found the handle."""
        if gait.clock < STUCK:
            return gait
        if gait.phase is Phase.ADD:
            return self.gait.backing(gait)
        return self.gait.aiming(gait, estimate) if gait.phase is Phase.RETURN else gait
