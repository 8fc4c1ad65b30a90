"""Has the tip slipped?  What the motion of the fingers says.

Three fingers or four hold the tool so firmly that a tip that slips hardly jerks them: but it tilts the tool, and with
it moves the contacts.  A millimetre at the tip, 125 mm below, moves two contacts 36 mm apart by .14 mm up and down; the
fingers' encoders, smoothed, tell the height of a fingertip to .01 mm, of the thumb's to .04 mm.

By rolling odometry the tool turns about a tip at rest.  What the fingertips move by otherwise, d_i, is summed and
forgotten slowly, as by a high-pass.  The displacement t of the tip that fits best,

    min  sum |t + u x (c_i - p) - d_i|^2 / S_i  +  |u|^2 / s_u^2  +  t_z^2 / s_z^2,

S_i from the encoders' noise by the fingers' Jacobians, has then a covariance S, and with the hand's own, for the arm's
encoders move all fingers alike, S + S_h.  A finger that slides down the handle moves along it by itself: S_i grows by
the square of that way.  Where the fit leaves more than all this explains, S grows by as much.  The answer is the
log-likelihood ratio of t with the slip's way added, a Gaussian that is wide along the blade's edge and narrow across
it, where the slot's walls are, against t with noise alone.

Paper: no counterpart; dv_x = dv_y = 0 of III-B and no slip (13) are what it is made of.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.estimate.motion_steps import displaced, evidence, strayed
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.small import cross
from turnscrew.robot.joints import ARM, FINGERS, WRIST

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

K = len(FINGERS)
HAND_JOINTS = len(ARM) + len(WRIST)
"""First joint of the fingers in the joint vector: what stands before moves all of them alike."""


@dataclass(frozen=True, slots=True)
class MotionState:
    """What the test remembers.

    Attributes:
        way: (5, 3) by how much each fingertip has moved otherwise than with the tool lately, in W [m].
        held: (5,) time for which each has held [s].
        slow: (5,) slowly smoothed size of each force [N].
        rolled: Way that the handle has rolled in the fingers lately, forgotten likewise [m].
        evidence: Log-likelihood ratio of a slip; negative where it speaks against one.
    """

    way: Array
    held: Array
    slow: Array
    rolled: float
    evidence: float


@dataclass(frozen=True, slots=True)
class TipMotion:
    """Parameters of the test.

    Attributes:
        encoder: Noise of a finger's joint as smoothed [rad]: half of .05 deg, as `JointSmoother` and `BetweenTicks` do.
        memory: Time in which a way is forgotten [s]: twice the .1 s in which a slip has to be seen, and short beside
            creep; .15 and .3 do about as well.
        floor: What a contact moves by that no encoder tells [m]: found by trial, of fingers that roll.
        share: Of the way that the handle rolls in the fingers by which a contact strays besides: found by trial; in
            fast rolls the thumb's strays by .1 to .2 mm on 8 mm.
        play: What the tip may move by from wall to wall of its slot, which is no slip [m].
        firm: Force from which on a finger holds [N]: one that has just met the handle slides by .2 to .4 mm below.
        going: Share of its mean over `slow_time` below which a force tells that the finger lets go: it slides then.
        slow_time: Time constant of that mean [s].
        fresh: Time for which a finger that has just begun to hold does not tell [s]: it settles.
        lift: What all fingers may move by along z and alike [m]: by the arm, or a hand that slides down the handle.
        turn: What the tool may have turned by beside what odometry has told [rad]: a slip of 2.5 mm.
        far: Way of a slip, a standard deviation [m]: once friction has given way, it ends millimetres farther.
        near: The same across the slot [m]: twice the blade's play, .2 mm, and what a shaft bends and a tool leans by.
    """

    encoder: float = 0.5 * np.deg2rad(0.05)
    memory: float = 0.2
    floor: float = 2e-5
    share: float = 0.006
    play: float = 2e-4
    firm: float = 1.5
    going: float = 0.6
    slow_time: float = 0.12
    fresh: float = 0.02
    lift: float = 5e-4
    turn: float = 0.02
    far: float = 2e-3
    near: float = 5e-4

    def init(self) -> MotionState:
        """Nothing held."""
        return MotionState(np.zeros((K, 3)), np.zeros(K), np.zeros(K), 0.0, 0.0)

    def update(
        self,
        state: MotionState,
        tips: Fingertips,
        c_W: Array,
        f_F: Array,
        moved: Array,
        slid: Array,
        rolled: float,
        p_WT: Array,
        R_WT: Array,
        S_hand: Array,
        dt: float,
    ) -> MotionState:
        """Take in one tick.

        Args:
            state: Of the last tick.
            tips: Fingertips now.
            c_W: (5, 3) their contact points, in W [m].
            f_F: (5, 3) their forces as read [N].
            moved: (5, 3) by how much each has moved in this tick otherwise than with the tool, in W [m]; see `astray`.
            slid: (5,) by what each has slid down the handle lately [m]; see `FingerSlip`.
            rolled: By what the handle has rolled in the fingers in this tick [m].
            p_WT: (3,) tip position, in W [m].
            R_WT: (3, 3) orientation of the tool, its x along the blade's edge.
            S_hand: (3, 3) covariance of what all fingertips are read to have moved by within `memory` and have not,
                in W [m2].
            dt: Time since the last tick [s].
        """
        keep = exp(-dt / self.memory)
        return MotionState(*_told(
            state.way, state.held, state.slow, state.rolled, f_F, moved, slid, rolled, tips.p_WF, tips.J, c_W, p_WT,
            R_WT, S_hand, (self.firm, self.going, keep, self.slow_time),
            (self.floor, self.share), (self.encoder, self.lift, self.turn, self.fresh), self.play, self.far, self.near,
            dt,
        ))  # fmt: skip


@compiled
def _told(
    way: Array, held: Array, slow: Array, rolled: float, f_F: Array, moved: Array, slid: Array, roll: float,
    p_WF: Array, J: Array, c_W: Array, p_WT: Array, R_WT: Array, S_hand: Array,
    straying: tuple[float, float, float, float], creep: tuple[float, float],
    fitting: tuple[float, float, float, float], play: float, far: float, near: float, dt: float,
) -> tuple[Array, Array, Array, float, float]:  # fmt: skip
    """`TipMotion.update` at once: `strayed`, `displaced` and `evidence`; the state's entries in their order."""
    firm, going, keep, slow_time = straying
    least, share = creep
    encoder, lift, turn, fresh = fitting
    now = strayed(way, held, slow, f_F, moved, firm, going, keep, slow_time, dt)
    rolled = keep * rolled + abs(roll)
    floor = hypot(least, share * rolled)
    found = displaced(
        now.way, now.held, c_W, p_WF, J, p_WT, HAND_JOINTS, encoder, floor, slid, R_WT[:, 2].copy(), lift, turn,
        fresh, dt,
    )  # fmt: skip
    told = 0.0
    if found.number >= 2:
        # places between two walls, all as likely: a sixth of the square of their distance for the way between two
        S = max(found.misfit, 1.0) * (found.S + S_hand[:2, :2]) + play**2 / 6.0 * np.eye(2)
        told = evidence(found.d, S, R_WT[:2, 0].copy(), far, near)
    return now.way, now.held, now.slow, rolled, told


def astray(before: Fingertips, after: Fingertips, c_W: Array, p_WT: Array, dtheta: Array, dp: Array) -> Array:
    """By how much each fingertip has moved otherwise than with the tool: `d_i - dp - dtheta x (c_i - p)`, (5, 3) [m].

    Args:
        before: Fingertips at the last tick.
        after: Fingertips now, with the same encoder offsets removed.
        c_W: (5, 3) contact points at the last tick, in W [m].
        p_WT: (3,) tip position then, in W [m].
        dtheta: (3,) rotation of the tool since then, in W [rad].
        dp: (3,) travel of its tip since then, in W [m].
    """
    return _astray(before.p_WF, before.R_WF, after.p_WF, after.R_WF, c_W, p_WT, dtheta, dp)


@compiled
def _astray(
    p_before: Array, R_before: Array, p_after: Array, R_after: Array, c_W: Array, p_WT: Array, dtheta: Array, dp: Array
) -> Array:
    """`astray` of the fingertips' origins (5, 3) and orientations (5, 3, 3)."""
    moved = np.empty((len(c_W), 3))
    for i in range(len(c_W)):
        turn = np.dot(R_after[i], R_before[i].T)
        way = p_after[i] + np.dot(turn, c_W[i] - p_before[i]) - c_W[i] - dp
        moved[i] = way - cross(dtheta, c_W[i] - p_WT)
    return moved
