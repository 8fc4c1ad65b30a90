"""What slips: the fingers over the handle, the tip in its drive; three detectors that hear of the same motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, sqrt
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.estimate.filter_state import HAND, THETA, FilterState, pose_covariance
from turnscrew.estimate.finger_slip import FingerSlip, FingerSlipState
from turnscrew.estimate.tip_motion import MotionState, TipMotion, astray
from turnscrew.estimate.tip_slip import SlipState, TipSlip
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import log_so3
from turnscrew.signals import Vision
from turnscrew.values import changed

if TYPE_CHECKING:
    from turnscrew.estimate.handle_contacts import HandleContacts
    from turnscrew.estimate.trail import Seen
    from turnscrew.robot.model import Fingertips

FLIP = np.deg2rad(15.0)
"""A frame that is turned by more tells nothing of the tip [rad]: a slip of 5 mm tilts a tool held 125 mm above it by
2.3 deg, a synthetic camera errs by 3 deg an axis, a flipped marker by 30."""


@dataclass(frozen=True, slots=True)
class SlipsState:
    """States of the detectors.

    Attributes:
        fingers: Of fingers that slide.
        motion: Of the tip, by the fingers' motion.
        tip: Of the tip, by forces and camera.
        turned: By what the tool has turned about its axis in this tick [rad].
    """

    fingers: FingerSlipState
    motion: MotionState
    tip: SlipState
    turned: float = 0.0


@dataclass(frozen=True, slots=True)
class Slips:
    """The detectors.

    Attributes:
        fingers: Of fingers that slide.
        motion: Of the tip, by the fingers' motion.
        tip: Of the tip, by forces and camera; its signal takes in what the motion says.
    """

    fingers: FingerSlip = field(default_factory=FingerSlip)
    motion: TipMotion = field(default_factory=TipMotion)
    tip: TipSlip = field(default_factory=TipSlip)

    def init(self) -> SlipsState:
        """Nothing has slipped."""
        return SlipsState(self.fingers.init(), self.motion.init(), self.tip.init())

    def rolled(
        self,
        state: SlipsState,
        f: FilterState,
        before: Fingertips,
        after: Fingertips,
        tip_W: Array,
        f_F: Array,
        level: Array,
        dtheta: Array,
        dp: Array,
        arm_time: float,
        radius: float,
        dt: float,
    ) -> SlipsState:
        """Takes in a tick's motion.

        Args:
            state: Of the last tick.
            f: The filter's state then.
            before: Fingertips then.
            after: Fingertips now, with the same encoder offsets removed.
            tip_W: (5, 3) their contact points then, in W [m].
            f_F: (5, 3) forces of the fingertips, each in its frame F [N].
            level: (5,) low-passed size of those of fingers that touch [N].
            dtheta: (3,) by what the tool has turned since, in W [rad].
            dp: (3,) by what its tip has travelled, in W [m].
            arm_time: Time in which the readings of the arm's joints forget [s].
            radius: Of the handle [m].
            dt: Time since the last tick [s].
        """
        axis = f.R_WT[:, 2]
        turned = float(axis @ dtheta)
        moved = astray(before, after, tip_W, f.p_WT, dtheta, dp)
        # of a reading now and one a memory ago
        S = 2.0 * f.P[HAND, HAND] * (1.0 - exp(-self.fingers.memory / arm_time))
        rolled, sigma = radius * turned, sqrt(float(axis @ S @ axis))
        fingers = self.fingers.update(state.fingers, moved @ axis, level, sigma, rolled, dt)
        motion = self.motion.update(state.motion, after, tip_W, f_F, moved, fingers.slid, rolled, f.p_WT, f.R_WT, S, dt)
        return changed(state, fingers=fingers, motion=motion, turned=turned)

    def turned(self, state: SlipsState, f: FilterState, seen: Seen, radius: float) -> SlipsState:
        """Takes in a camera's frame: whether the handle, of a radius [m], is seen to have turned back."""
        axis = f.R_WT[:, 2]
        turn = log_so3(seen.pose.R_WT @ f.R_WT.T)
        back = float(axis @ turn)
        if float(turn @ turn) - back * back > FLIP * FLIP:
            return state
        variance = float(axis @ (seen.P[3:, 3:] + f.P[THETA, THETA]) @ axis)
        return changed(state, fingers=self.fingers.seen(state.fingers, back, variance, radius))

    def felt(
        self,
        state: SlipsState,
        f: FilterState,
        tips: Fingertips,
        contacts: HandleContacts,
        f_F: Array,
        frame: Vision | None,
        dt: float,
    ) -> tuple[SlipsState, float]:
        """Takes in readings as they come; also how strongly all contradicts a tip that stays where it is.

        Args:
            state: Of this tick, its motion taken in.
            f: The filter's state.
            tips: Fingertips.
            contacts: Where they are nearest to the handle.
            f_F: (5, 3) forces of the fingertips, each in its frame F [N].
            frame: The camera's frame of this tick, if one came that holds a pose.
            dt: Time since the last tick [s].
        """
        f_W = (tips.R_WF @ f_F[:, :, None])[:, :, 0]
        seen = None
        if frame is not None and _angle(frame.R_WT, f.R_WT) < FLIP:
            seen = (frame.p_WT - f.p_WT)[:2], frame.P[:2, :2] + pose_covariance(f.P)[:2, :2]
        tip, signal = self.tip.update(
            state.tip,
            f_W,
            contacts.c_W,
            contacts.n_W,
            f.p_WT,
            f.R_WT[:, 2],
            state.turned,
            seen,
            state.motion.evidence,
            dt,
        )
        return changed(state, tip=tip), signal


def _angle(R: Array, other: Array) -> float:
    """Angle between two orientations [rad]."""
    return float(np.arccos(np.clip(0.5 * (np.trace(R.T @ other) - 1.0), -1.0, 1.0)))
