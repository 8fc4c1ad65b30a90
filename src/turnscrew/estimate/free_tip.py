"""What the estimator does otherwise while the tip is out of its drive, and when it is back in.

The tip then tells nothing of the screw, the tool moves as the hand carries it, and nothing of what is felt is the
thread's.  That the tip is out, or in again, is not decided here: the loop is told with the last goal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from turnscrew.contact.carried import PalmPose, carried
from turnscrew.estimate.filter_state import SIZE, THETA, TIP, FilterState
from turnscrew.estimate.odometry import STILL
from turnscrew.estimate.screw_angle import AngleState
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import FINGERS

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


class Free(NamedTuple):
    """What the last goal says of the tip.

    Attributes:
        tip: Whether it is out of its drive.
        theta: Angle at which the screw is taken to stand then [rad].
        moves: Whether the tool is pushed or handed over, and moves in the fingers in ways that these do not tell.
        holds: (5,) fingers that are to carry the tool; others may still be felt to touch while they leave it.
    """

    tip: bool = False
    theta: float = 0.0
    moves: bool = False
    holds: Flags = np.ones(len(FINGERS), dtype=bool)


HELD = Free()
"""The tip is in its drive."""


class Hold(NamedTuple):
    """How fingers hold a tool that is carried.

    Attributes:
        tips: The fingertips before and now.
        c_W: (5, 3) contact points before, in W [m].
        weight: (5,) of each fingertip, 0 for those that do not touch.
    """

    tips: tuple[Fingertips, Fingertips]
    c_W: Array
    weight: Array


Palm = Callable[[Array], tuple[Array, Array]]
"""The palm's pose p_WH (3,) [m] and R_WH (3, 3) at joint angles (28,) [rad]."""


@dataclass(frozen=True, slots=True)
class FreeTip:
    """A tool that has been knocked out of its drive.

    Attributes:
        palm: Kinematics of the palm, which carries it.
        tip: Where its tip may be about where it was taken to be [m], per axis: knocked tools lie 7 to 45 mm off,
        lean: and how the tool may have turned [rad], per axis: they lean by 2 to 17 deg.
        creep: Random walk of a carried tip in the fingers [m/sqrt(s)]: what contacts give as loads change, a few tenths
            of a millimetre,
        sway: and of the tool's orientation [rad/sqrt(s)].
        back: By how much a tip that is back in its drive may be elsewhere than the camera had it [m], per axis: it had
            seconds of frames of a tool that moved,
        upright: and how the tool may have turned since [rad], per axis: it is pressed, and handed over.
        moved: By how much more it walks while the tool is pushed or handed over: a search that fails leaves 2 mm of
            error, which the camera must be free to take away.
    """

    palm: Palm
    tip: float = 0.03
    lean: float = np.deg2rad(12.0)
    creep: float = 0.00015
    sway: float = np.deg2rad(0.08)
    back: float = 0.0015
    upright: float = np.deg2rad(1.5)
    moved: float = 6.0

    def freed(self, f: FilterState, sure: FilterState) -> FilterState:
        """The pose doubted as above, and no longer tied to what else is known.

        All that is as it was while the tip was in: until a loss is noticed the frames of a tool that is somewhere else
        are taken to tell of the screw, which then is believed 1 to 2 mm from where it is.

        Args:
            f: Now.
            sure: When the tip was last taken to be in its drive.
        """
        P = sure.P.copy()
        both = slice(THETA.start, TIP.stop)
        P[both], P[:, both] = 0.0, 0.0
        sigma = np.zeros(SIZE)
        sigma[THETA], sigma[TIP] = self.lean, self.tip
        return replace(sure, p_WT=f.p_WT, R_WT=f.R_WT, blind=f.blind, P=P + np.diag(sigma**2))

    def seated(self, f: FilterState) -> FilterState:
        """The pose of a tool whose tip is back, doubted as above until it agrees with the drive's place."""
        sigma = np.zeros(SIZE)
        sigma[THETA], sigma[TIP] = self.upright, self.back
        return replace(f, P=f.P + np.diag(sigma**2))

    def carry(self, before: PalmPose | None, q: Array, hold: Hold, p_WT: Array) -> tuple[PalmPose, Array, Array]:
        """How the hand has carried the tool in a tick.

        Args:
            before: The palm at the last tick; None at the first.
            q: (28,) joint angles [rad].
            hold: How the fingers hold it.
            p_WT: (3,) the tip before, in W [m].

        Returns:
            The palm now, the tip's way (3,) in W [m] and the tool's rotation vector (3,) in W [rad].
        """
        palm = PalmPose(*self.palm(q))
        return palm, *carried((before or palm, palm), hold.tips, hold.c_W, hold.weight, p_WT)

    def predict(
        self, filter_: ToolFilter, f: FilterState, way: tuple[Array, Array], reach: Array, gripped: bool, moves: bool,
        dt: float,
    ) -> FilterState:  # fmt: skip
        """The filter moved on with a tool that is carried.

        Args:
            filter_: Its noise.
            f: Before.
            way: The tip's way (3,) in W [m] and the tool's rotation vector (3,) in W [rad].
            reach: (3, 6) linear Jacobian of the hand's middle by arm and wrist, in W [m].
            gripped: Whether two fingers or more touch.
            moves: Whether the tool is pushed or handed over.
            dt: [s].
        """
        dp, dtheta = way
        f = filter_.predict(f, STILL._replace(dtheta=dtheta), dp, 0.0, reach, gripped, dt)
        walk = np.zeros(SIZE)
        more = self.moved**2 if moves else 1.0
        walk[THETA], walk[TIP] = self.sway**2 * more * dt, self.creep**2 * more * dt
        return replace(f, P=f.P + np.diag(walk))


def seated_angle(angle: AngleState, yaw: float, start: float) -> AngleState:
    """The screw's angle after the blade has found its slot again.

    The screw stands about where it was taken to stand, its slot along the blade: a slot looks the same after half a
    turn, so the blade's yaw tells by how much it stands off.

    Args:
        angle: With theta as it was taken to be [rad].
        yaw: Of the tool now [rad].
        start: The slot's heading when theta was zero [rad].
    """
    off = (start - angle.theta - yaw + 0.5 * pi) % pi - 0.5 * pi
    theta = angle.theta + off
    return AngleState(angle.elapsed, yaw, theta, theta)
