"""The last moments of odometry, to bring a late camera frame to the present."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.signals import Vision


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose of the tool.

    Attributes:
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation.
    """

    p_WT: Array
    R_WT: Array

    def moved(self, dtheta: Array, dp: Array) -> Pose:
        """Turned about its tip by dtheta (3,) [rad] and moved by dp (3,) [m], both in W."""
        return Pose(self.p_WT + dp, exp_so3(dtheta) @ self.R_WT)


class Seen(NamedTuple):
    """A camera frame, brought to now.

    Attributes:
        pose: Of the tool.
        P: (6, 6) covariance of its errors, as in `Vision`: an error of orientation turns along with the tool.
    """

    pose: Pose
    P: Array


@dataclass(frozen=True, slots=True)
class Trail:
    """Pure odometry (no filter corrections) at the last ticks, oldest first.

    Attributes:
        times: Of the ticks [s].
        rotations: Accumulated rotation at each, as matrices in W.
        travels: Accumulated travel of the tip at each, (3,) in W [m].
        span: How far back it reaches [s], three frames of a 30 Hz camera unless told otherwise; frames that come later
            are refused.
    """

    times: tuple[float, ...] = ()
    rotations: tuple[Array, ...] = ()
    travels: tuple[Array, ...] = ()
    span: float = 0.1

    def extended(self, time: float, dtheta: Array, dp: Array) -> Trail:
        """The trail with one more tick, which turned the tool by dtheta (3,) [rad] and moved its tip by dp (3,) [m]."""
        if not self.times:
            return Trail((time,), (np.eye(3),), (np.zeros(3),), self.span)
        drop = 1 if self.times[0] < time - self.span else 0
        return Trail(
            (*self.times[drop:], time),
            (*self.rotations[drop:], exp_so3(dtheta) @ self.rotations[-1]),
            (*self.travels[drop:], self.travels[-1] + dp),
            self.span,
        )

    def to_now(self, frame: Vision) -> Seen | None:
        """Pose that the frame would show now: turned and moved by the odometry since its stamp.

        Args:
            frame: As it arrived.

        Returns:
            The tool's pose now with its covariance, or None when the frame is older than the trail, and so useless.
        """
        if not self.times or frame.stamp < self.times[0]:
            return None
        i = bisect_left(self.times, frame.stamp)
        if i in (0, len(self.times)):
            then_R, then_p = (self.rotations[min(i, len(self.times) - 1)], self.travels[min(i, len(self.times) - 1)])
        else:
            share = (frame.stamp - self.times[i - 1]) / (self.times[i] - self.times[i - 1])
            step = log_so3(self.rotations[i] @ self.rotations[i - 1].T)
            then_R = exp_so3(share * step) @ self.rotations[i - 1]
            then_p = (1.0 - share) * self.travels[i - 1] + share * self.travels[i]
        turn = self.rotations[-1] @ then_R.T
        P = frame.P.copy()
        P[3:] = turn @ P[3:]
        P[:, 3:] = P[:, 3:] @ turn.T
        return Seen(Pose(frame.p_WT + self.travels[-1] - then_p, turn @ frame.R_WT), P)
