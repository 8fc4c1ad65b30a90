"""A gait plan: where the tool stands, where the hand is, and the finger postures of one round.

One round (Paper: section IV-D and Fig. 3): thumb and middle finger roll on the handle and turn it; first and ring
finger are added and hold it; thumb and middle finger leave, go back to where they began, and take it up again.
Turning in is negative yaw, so the handle turns by `-stroke` while the rolling fraction goes from 0 to 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import COUPLED, FINGERS, INDEX, JOINTS, finger_joints

ROLLING = ("TH", "MF")
"""The fingers that turn the handle."""

SUPPORTING = ("FF", "RF")
"""The fingers that hold it meanwhile; the paper's IF is FF."""

PLACES = {finger: slice(finger_joints(finger)[0], finger_joints(finger)[-1] + 1) for finger in FINGERS}
FOLLOWERS = np.array([INDEX[joint] for joint in COUPLED])
LEADERS = np.array([INDEX[joint] for joint in COUPLED.values()])
"""Places in a joint vector: of each finger's driven joints, and of coupled joints and those that lead them."""


class Course(StrEnum):
    """What a plan is for."""

    ROUND = "round"
    """A whole round of the gait."""
    STROKE = "stroke"
    """One stroke of thumb and middle finger, as long as their joints allow; the others keep out of the way."""


@dataclass(frozen=True)
class Handle:
    """What the fingers hold: a cylinder on a shaft, measured from the tip along the tool's axis.

    Attributes:
        radius: [m].
        length: [m].
        middle: Height of the handle's middle above the tip [m].
        shaft_radius: Of the shaft between tip and handle [m].
    """

    radius: float
    length: float = 0.10
    middle: float = 0.125
    shaft_radius: float = 0.003


@dataclass(frozen=True)
class GaitPlan:
    """One round of the finger gait for one handle, as postures of the robot; or one long stroke alone.

    The plan of a stroke has nobody who takes over: its `relocation` and `hold` are empty.

    A finger's posture lists its driven joints, palm outwards (`finger_joints`): FF, MF, RF have J4, J3, J2 (J1 = J2);
    LF has J5 first; TH has THJ5..THJ1.

    Attributes:
        handle: The handle that the plan is for.
        stroke: Angle the handle turns by in a roll, > 0 [rad].
        contact_heights: Height above the tip at which each of TH, FF, MF, RF touches, at the roll's start [m].
        p_WS: (3,) bottom of the screw's drive in W, where the robot expects it [m].
        R_WT: (3, 3) orientation of the tool at the roll's start.
        arm: (6,) posture of WAMJ1..J4, WRJ2, WRJ1 [rad].
        roll: Of TH and MF, (K, n) postures while they roll without slip, evenly spaced in yaw [rad].
        relocation: Of TH and MF, (L, n) postures that lead from the lifted end of the roll (row 0) to the posture in
            front of the roll's start (last row), to be joined by straight lines in joint space [rad].
        hold: Of FF and RF, (n,) postures that just touch the handle [rad].
        retreat: Of FF and RF, (n,) postures out of TH's and MF's way [rad].
        parked: Of LF, (n,) posture out of the way [rad].
        margins: What the plan keeps clear of its limits, by name, in SI units.
        command: The command that made the plan.
    """

    handle: Handle
    stroke: float
    contact_heights: Mapping[str, float]
    p_WS: Array
    R_WT: Array
    arm: Array
    roll: Mapping[str, Array]
    relocation: Mapping[str, Array]
    hold: Mapping[str, Array]
    retreat: Mapping[str, Array]
    parked: Mapping[str, Array]
    margins: Mapping[str, float] = field(default_factory=dict)
    command: str = ""

    @property
    def course(self) -> Course:
        """What the plan is for."""
        return Course.ROUND if self.hold else Course.STROKE

    @property
    def radius(self) -> float:
        """Handle radius [m]."""
        return self.handle.radius

    @property
    def centre(self) -> Array:
        """Middle of the handle (3,) in W [m]."""
        return np.asarray(self.p_WS + self.handle.middle * self.R_WT[:, 2])

    def rolling(self, s: float) -> Array:
        """Posture (28,) after the fraction s of the roll; FF and RF retreated."""
        return self._posture({**self._rolled(s), **self.retreat})

    def adding(self, s: float, rolled: float = 1.0) -> Array:
        """Posture (28,) with FF and RF the fraction s of the way onto the handle; TH and MF after `rolled`.

        Read backwards, it removes them: after the relocation with `rolled=0`.
        """
        support = {finger: (1 - s) * self.retreat[finger] + s * self.hold[finger] for finger in SUPPORTING}
        return self._posture({**self._rolled(rolled), **support})

    def leaving(self, s: float) -> Array:
        """Posture (28,) with TH and MF the fraction s of the way off the handle; FF and RF hold."""
        return self._posture(
            {f: (1 - s) * self.roll[f][-1] + s * self.relocation[f][0] for f in ROLLING} | dict(self.hold)
        )

    def relocating(self, s: float) -> Array:
        """Posture (28,) with TH and MF the fraction s of the way back, off the handle; FF and RF hold."""
        return self._posture({**{f: between(self.relocation[f], s) for f in ROLLING}, **self.hold})

    def returning(self, s: float) -> Array:
        """Posture (28,) with TH and MF the fraction s of the way onto the handle again; FF and RF hold."""
        return self._posture(
            {f: (1 - s) * self.relocation[f][-1] + s * self.roll[f][0] for f in ROLLING} | dict(self.hold)
        )

    def _rolled(self, s: float) -> dict[str, Array]:
        return {finger: between(self.roll[finger], s) for finger in ROLLING}

    def _posture(self, fingers: Mapping[str, Array]) -> Array:
        q = np.zeros(len(JOINTS))
        q[: len(self.arm)] = self.arm
        for finger, angles in {**self.parked, **fingers}.items():
            q[PLACES[finger]] = angles
        q[FOLLOWERS] = q[LEADERS]
        return q

    def verify(self) -> list[str]:
        """Requirements that the plan breaks, one line each with its figure; empty for a good plan."""
        # the check needs the robot's chain, which a plan that is only read does without
        from turnscrew.decide.plan_check import violations

        return violations(self)


def between(rows: Array, s: float) -> Array:
    """Point at the fraction s (clipped to 0..1) of the way through the rows (K, n), evenly spaced, joined linearly."""
    place = min(max(s, 0.0), 1.0) * (len(rows) - 1)
    low = min(int(place), max(len(rows) - 2, 0))
    high = min(low + 1, len(rows) - 1)
    return np.asarray(rows[low] + (place - low) * (rows[high] - rows[low]))
