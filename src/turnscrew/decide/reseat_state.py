"""Where the search for the drive is: its steps, and what they remember."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from turnscrew.decide.gait_state import GaitState
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import FINGERS
from turnscrew.values import changed

FOUR: Flags = np.array([finger != "LF" for finger in FINGERS])
"""The fingers that hold the tool while its tip searches."""


class Step(StrEnum):
    """A step of the search, in order; an attempt that comes to nothing begins again with LIFT."""

    STILL = "still"
    """Hold what is held, until the camera tells where the tool is."""
    LIFT = "lift"
    """The arm lifts the tip over the head."""
    RELEASE = "release"
    """Forefinger and ring finger give up their share of the load, where they are to take the handle anew."""
    AIM = "aim"
    """Fingers that do not hold come before the handle,"""
    FEEL = "feel"
    """and feel for it."""
    LEVEL = "level"
    """The fingers right the tool in the hand."""
    WALK = "walk"
    """The gait turns the tool in the air, where the arm alone cannot bring it to the slot's heading."""
    HOVER = "hover"
    """The arm brings the tool over the slot, leaning along its edge, so that one corner of the blade is lowest."""
    LOOK = "look"
    """Fingers are locked, and the camera looks once more."""
    LAND = "land"
    """Down, until the head is felt."""
    REST = "rest"
    """How high the head is."""
    SWEEP = "sweep"
    """Across the slot, until the corner drops in; where it has not, HOVER again."""
    ALIGN = "align"
    """To and fro about the corner: where the blade is parallel to the slot, it sinks."""
    DRAG = "drag"
    """Along the slot, until its end is felt."""
    RIGHT = "right"
    """Upright, held against that end: the blade goes in."""
    TURN = "turn"
    """A little to and fro about the axis; whether the slot's end holds a tip that friction could not."""
    PRESS = "press"
    """Slackened again, so that the gait takes over a tool that stands upright."""
    DONE = "done"
    """The tip is in its drive."""
    FAILED = "failed"
    """It is not, and there is no other way."""


LOCKED = (Step.LOOK, Step.LAND, Step.REST, Step.SWEEP, Step.ALIGN, Step.DRAG, Step.RIGHT, Step.TURN, Step.PRESS)
"""Steps in which the fingers keep posture and squeeze."""

CARRIED = (Step.HOVER, Step.LOOK)
"""Steps in which the tool goes with the hand as it is held; in all others it is lifted off, handed over, righted or
pushed, and moves in the fingers by a millimetre or two."""


ATTEMPTS = 16
"""Attempts before the run is given up: two at the likelier heading, two at the other, and all of that four times; most
searches need one, which takes 30 s, and those that fail take 10 to 30 s each."""

SIDEWAYS = np.array([1.0, 1.0, 0.0])
"""Of a force all but what presses the tip on the head."""


@dataclass(frozen=True, slots=True)
class Felt:
    """What the locked fingers tell.

    Attributes:
        q: (28,) encoder angles while nothing pushed the tip [rad].
        p_HT: (3,) the tip as the palm saw it then [m].
        R_HT: (3, 3) the tool's orientation, likewise.
        force: (3,) what pushes the tool, in W, low-passed [N];
        slow: (3,) the same, more slowly [N].
        zero: (3,) what is felt although nothing pushes [N].
        give: (6,) by how much the tool has moved in the hand since, in W: tip [m], rotation vector [rad].
    """

    q: Array
    p_HT: Array
    R_HT: Array
    force: Array
    slow: Array
    zero: Array
    give: Array

    def levelled(self) -> Felt:
        """The same where nothing pushes sideways: what has been felt lately is no force."""
        return self._less(self.slow * SIDEWAYS)

    def zeroed(self) -> Felt:
        """The same where nothing pushes at all."""
        return self._less(self.force)

    def _less(self, zero: Array) -> Felt:
        return changed(self, zero=self.zero + zero, force=self.force - zero, slow=self.slow - zero)


@dataclass(frozen=True, slots=True)
class ReseatState:
    """Where the search is.

    Attributes:
        step: Present step.
        clock: Time in it [s].
        gripping: (5,) fingers that carry the tool.
        gait: Of the gait: when the tip was lost, and while it turns the tool in the air.
        lost: Angles at which the screw may have been when the tip left its drive, the likeliest first [rad]; attempts
            take turns with them.
        spring: Whether the screw is taken to have sprung back to where it began.
        sure: Whether that is beyond doubt, until two attempts have failed.
        q_from: (28,) postures when the step began [rad].
        q_target: (28,) where fingers that do not hold go [rad].
        felt: What the locked fingers tell.
        slot: (3,) bottom centre of the drive as believed when the tip came down, in W [m].
        corner: (3,) where the lowest corner of the blade is to be, in W, if nothing pushed it [m].
        attempt: Attempts until now,
        tried: and those at the present one of the two headings.
        taken: Time since a finger has joined [s].
        aims: How often fingers that do not hold have been sent for the handle in this attempt.
        seen: For how long what the step waits for has been so [s].
        left: Angle by which the tool is still to be turned in the air [rad].
        walked: Whether it has been turned as far as it should.
        blocked: Whether the arm, which seemed to reach, has stopped on its way over the slot.
        side: Which corner is lowest: 1 for the one at +x of T, -1 for the other.
        heading: Of the slot in W, at the half turn that is nearest to the blade's [rad].
        turn: By how much the tool is turned from that heading [rad].
        sunk: How far the corner has sunk at most while it was turned [m].
        sunk_at: Where it has sunk, on the way back: mean of the angles, by how far [rad],
        weight: and what it is a mean of.
        off: How far the screw stands beyond where it was taken to stand, as found [rad].
        lean: Of the tool along its edge [rad].
        surface: Height of the corner on the head, as felt [m].
        rest: The same as told [m].
        held: (3,) where the hand would have had the corner when it began to pull at the righted tool, in W [m].
        down: How far below the head the corner of the righted tool has been lately [m].
        sweeps: Sweeps made in this attempt.
        why: What the last attempt came to.
    """

    step: Step
    clock: float
    gripping: Flags
    gait: GaitState
    lost: tuple[float, ...]
    spring: bool
    sure: bool
    q_from: Array
    q_target: Array
    felt: Felt | None = None
    slot: Array = field(default_factory=lambda: np.zeros(3))
    corner: Array = field(default_factory=lambda: np.zeros(3))
    attempt: int = 0
    tried: int = 0
    taken: float = 0.0
    aims: int = 0
    seen: float = 0.0
    left: float = 0.0
    walked: bool = False
    blocked: bool = False
    side: float = 1.0
    heading: float = 0.0
    turn: float = 0.0
    sunk: float = 0.0
    sunk_at: float = 0.0
    weight: float = 0.0
    off: float = 0.0
    lean: float = 0.0
    surface: float = 0.0
    rest: float = 0.0
    held: Array = field(default_factory=lambda: np.zeros(3))
    down: float = 0.0
    sweeps: int = 0
    why: str = ""

    @property
    def theta(self) -> float:
        """Angle at which the screw is taken to stand [rad]: a spring is back where it began."""
        return (0.0 if self.spring else self.lost[self.tried % len(self.lost)]) + self.off

    @property
    def along(self) -> Array:
        """(3,) unit vector in W along the slot, towards the end at which the blade's lowest corner goes in."""
        return self.side * np.array([np.cos(self.heading), np.sin(self.heading), 0.0])

    @property
    def across(self) -> Array:
        """(3,) unit vector in W across the slot."""
        return np.array([-np.sin(self.heading), np.cos(self.heading), 0.0])

    def to(self, step: Step) -> ReseatState:
        """The state at the beginning of a step."""
        return changed(self, step=step, clock=0.0, seen=0.0)

    def failed(self, why: str, *, other: bool = False) -> ReseatState:
        """The state when an attempt has come to nothing: the next one looks elsewhere, or at another heading.

        Args:
            why: What it came to.
            other: Whether the slot seems to have the other of the two headings; tried it is after two attempts anyhow,
                which leave of a heading that was beyond doubt as much doubt as of the other.
        """
        if self.attempt + 1 >= ATTEMPTS:
            return changed(self.to(Step.FAILED), why=why)
        again = changed(
            self.to(Step.LIFT), off=0.0, turn=0.0, walked=False, aims=0, sweeps=0, attempt=self.attempt + 1, why=why,
        )  # fmt: skip
        if self.tried == 0 and (self.sure or not other):
            return changed(again, tried=1)
        return changed(again, spring=not self.spring, sure=False, tried=0)

    def found(self, turn: float) -> ReseatState:
        """The state when the slot's heading has been felt.

        Args:
            turn: By how much it is turned from where it was taken to be [rad].
        """
        return changed(self, heading=self.heading + turn, off=self.off - turn, turn=0.0)
