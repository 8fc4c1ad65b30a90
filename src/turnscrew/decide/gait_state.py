"""The gait's phases, who does what in them, and where the gait is (Section IV-D, Fig. 3 and Section V-B, Fig. 6)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from turnscrew.decide.plan import ROLLING, SUPPORTING
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import FINGERS


class Phase(StrEnum):
    """A round of the gait, in order; SETTLE comes once, before the first, and after a search for the drive.

    One long stroke is SETTLE, ROLL and HOLD.  CATCH and GRASP come in when thumb or middle finger has lost the handle,
    BACK when these are in the way of the fingers that are to be added.
    """

    SETTLE = "settle"
    ROLL = "roll"
    ADD = "add"
    SUPPORT = "support"
    LEAVE = "leave"
    RELOCATE = "relocate"
    RETURN = "return"
    REGRIP = "regrip"
    REMOVE = "remove"
    HOLD = "hold"
    CATCH = "catch"
    GRASP = "grasp"
    BACK = "back"


ORDER = tuple(phase for phase in Phase if phase not in (Phase.HOLD, Phase.CATCH, Phase.GRASP, Phase.BACK))
NEXT: dict[Phase, Phase] = {
    **dict(pairwise(ORDER)), Phase.REMOVE: Phase.ROLL, Phase.HOLD: Phase.HOLD, Phase.CATCH: Phase.GRASP,
    Phase.GRASP: Phase.ADD, Phase.BACK: Phase.ADD,
}  # fmt: skip
"""What follows each phase of a round."""

TH_MF = np.array([finger in ROLLING for finger in FINGERS])
FF_RF = np.array([finger in SUPPORTING for finger in FINGERS])
FEELING: dict[Phase, Flags] = {Phase.ADD: FF_RF, Phase.RETURN: TH_MF, Phase.CATCH: TH_MF}
"""Who feels for the handle."""
HELD_BY_TH_MF = (Phase.ROLL, Phase.ADD, Phase.HOLD, Phase.CATCH, Phase.GRASP, Phase.BACK)
"""Phases in which thumb and middle finger are where the roll has brought them."""


@dataclass(frozen=True, slots=True)
class GaitState:
    """Where the gait is.

    Attributes:
        phase: Present phase.
        round: Rounds completed.
        clock: Time in this phase [s].
        rolled: Angle turned by the goal in this stroke [rad].
        gripping: (5,) fingers that carry the tool.
        q_from: (28,) joint angles when the phase began [rad].
        q_target: (28,) where the free fingers go in this phase [rad].
        theta: Angle of the screw when the last round ended [rad].
        vain: Rounds in a row, up to the last, that have not turned the screw.
        cycle: All rounds until now, those that do not count included.
        aside: Time in this phase before fingers that feel begin to [s].
        near: Whether they have come before the handle.
        stroke: Angle by which the handle is to turn in this stroke [rad].
        ends: Angle of the screw [rad] and its torque on the tool [N.m] at the end of each stroke.
        at_rest: Its torque when the last roll had come to rest [N.m]; not a number until then.
        rests: Angle [rad] and torque [N.m] then, of each stroke until now.
        falls: By how much less it was when the other fingers had taken hold, for each stroke until now [N.m].
    """

    phase: Phase
    round: int
    clock: float
    rolled: float
    gripping: Flags
    q_from: Array
    q_target: Array
    theta: float = 0.0
    vain: int = 0
    cycle: int = 0
    aside: float = 0.0
    near: bool = False
    stroke: float = 0.0
    ends: tuple[tuple[float, float], ...] = ()
    at_rest: float = np.nan
    rests: tuple[tuple[float, float], ...] = ()
    falls: tuple[float, ...] = ()
