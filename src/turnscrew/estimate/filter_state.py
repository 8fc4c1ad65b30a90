"""The filter's states: what they are, where they stand, and how sure it is at the start.

27 of them say what is so (tool, screw, radius, joint offsets).  Nine more say what is read wrong at present, because
it is read wrong alike for a while: where the hand is, by the arm's encoders, and where the camera sees the tool.  The
last says by which share the tool stays behind the fingers that roll it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.joints import COUPLED, HAND_FINGERS, INDEX, JOINTS

GRIPPING = ("TH", "FF", "MF", "RF")
"""The fingers that ever hold the tool; the little finger's offsets are never seen and so not estimated."""

OFFSET_JOINTS = tuple(joint for finger in GRIPPING for joint in HAND_FINGERS[finger])
"""The 17 joints with offset states: THJ5..THJ1, then J4..J1 of FF, MF and RF.

J1 and J2 of a finger are coupled in motion but have an encoder each, so each has an offset of its own.
"""

OFFSET_COLUMNS = np.array([INDEX[joint] for joint in OFFSET_JOINTS])
"""Their places in the joint vector."""

THETA = slice(0, 3)
TIP = slice(3, 6)
SCREW = slice(6, 9)
RADIUS = 9
OFFSETS = slice(10, 10 + len(OFFSET_JOINTS))
HAND = slice(27, 30)
SEEN = slice(30, 36)
SLIDE = 36
SIZE = SLIDE + 1


@dataclass(frozen=True, slots=True)
class FilterState:
    """Mean and covariance of the error-state filter.

    The errors, in order: rotation vector theta in W (R_true = exp([theta]x) R_WT) [rad], tip p_WT in W [m], screw
    offset b in W [m], radius error [m], the 17 joint offsets of `OFFSET_JOINTS` [rad], the displacement of the hand in
    W [m], the camera's lasting error: of the tip in W [m], then of the orientation, a rotation vector in W [rad]; and
    the share of a roll by which the handle slides.

    Attributes:
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        b_W: (3,) where the screw is, less where it was said to be, in W [m].
        radius_error: What the handle is thicker than said [m].
        offset: (17,) encoder readings less joint angles [rad].
        hand_W: (3,) where all fingertips are read to be, less where they are, by encoders of arm and wrist [m].
        seen_W: (6,) the camera's lasting error: seen less true tip [m], then rotation vector from true to seen [rad].
        slide: Share by which the handle turns less than fingers that roll it without sliding would turn it.
        blind: Time since the last camera frame was taken in [s].
        P: (37, 37) covariance of the errors.
    """

    p_WT: Array
    R_WT: Array
    b_W: Array
    radius_error: float
    offset: Array
    hand_W: Array
    seen_W: Array
    slide: float
    blind: float
    P: Array

    def joint_offset(self) -> Array:
        """(28,) offsets of all joints [rad], zero for those not estimated."""
        full = np.zeros(len(JOINTS))
        full[OFFSET_COLUMNS] = self.offset
        return full

    def corrected(self, error: Array, P: Array) -> FilterState:
        """The state moved by an estimated error (37,), with covariance P."""
        return FilterState(
            p_WT=self.p_WT + error[TIP],
            R_WT=exp_so3(error[THETA]) @ self.R_WT,
            b_W=self.b_W + error[SCREW],
            radius_error=self.radius_error + float(error[RADIUS]),
            offset=self.offset + error[OFFSETS],
            hand_W=self.hand_W + error[HAND],
            seen_W=self.seen_W + error[SEEN],
            slide=self.slide + float(error[SLIDE]),
            blind=self.blind,
            P=P,
        )


_POSE = np.array([*range(TIP.start, TIP.stop), *range(THETA.start, THETA.stop)])
_POSE_GRID = np.ix_(_POSE, _POSE)


def pose_covariance(P: Array) -> Array:
    """(6, 6) covariance of the errors of p_WT, then of the rotation vector, out of the filter's (37, 37)."""
    covariance: Array = P[_POSE_GRID]
    return covariance


@dataclass(frozen=True, slots=True)
class Prior:
    """Standard deviations at the start.

    Attributes:
        rotation: Of the tool's orientation per axis [rad]; a start by one camera frame is right within 2-3 deg.
        tip: Of its tip per axis [m].
        screw: (3,) of the hand-to-screw calibration [m].
        radius: Of the handle's radius [m]: a caliper on a moulded handle.
        offset: Of a joint offset [rad]; .57 deg.
        coupling: Of J1 - J2 of a coupled finger [rad], or None where the tendon leaves them free.  The coupling makes
            the difference of the readings show the difference of the offsets.
        hand: Of the hand's displacement per axis [m]: the first reading of two wrist joints of .05 deg, up to
            .4 m away; the arm's four of .005 deg hardly add to it.
        slide: Of the share of a roll by which the handle slides: 1 % in strokes of the simulated hand, more under
            more load, for friction that holds a torque gives way a little.
    """

    rotation: float = np.deg2rad(3.0)
    tip: float = 0.005
    screw: tuple[float, float, float] = (0.0015, 0.0015, 0.002)
    radius: float = 0.0005
    offset: float = 0.01
    coupling: float | None = np.deg2rad(0.2)
    hand: float = 0.0004
    slide: float = 0.01

    def state(self, p_WT: Array, R_WT: Array, q: Array) -> FilterState:
        """The start.

        Args:
            p_WT: (3,) tip position in W [m].
            R_WT: (3, 3) orientation of the tool.
            q: (28,) encoder readings [rad].
        """
        sigma = np.zeros(SIZE)
        sigma[THETA], sigma[TIP], sigma[SCREW] = self.rotation, self.tip, self.screw
        sigma[RADIUS], sigma[OFFSETS], sigma[HAND] = self.radius, self.offset, self.hand
        sigma[SLIDE] = self.slide
        error, P = np.zeros(SIZE), np.diag(sigma**2)
        for follower, leader in COUPLED.items() if self.coupling is not None else ():
            if follower in OFFSET_JOINTS:
                h = np.zeros(SIZE)
                h[OFFSETS.start + OFFSET_JOINTS.index(follower)] = 1.0
                h[OFFSETS.start + OFFSET_JOINTS.index(leader)] = -1.0
                gain = P @ h / float(h @ P @ h + (self.coupling or 0.0) ** 2)
                error = error + gain * (q[INDEX[follower]] - q[INDEX[leader]] - h @ error)
                P = P - np.outer(gain, h @ P)
        offset, hand, seen = np.zeros(len(OFFSET_JOINTS)), np.zeros(3), np.zeros(6)
        return FilterState(p_WT, R_WT, np.zeros(3), 0.0, offset, hand, seen, 0.0, 0.0, P).corrected(error, P)
