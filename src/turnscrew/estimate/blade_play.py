"""Does the blade cross its play in the slot?  What jerks the tool then is no slip of the tip.

A blade thinner than its slot turns freely by some degrees from one pair of walls to the other: whenever the torque
turns round, most of all with a thread that locks itself, where the hand lets the tool spring back while fingers change
and takes it up again with the next stroke.  The walls stop it with a knock, and it hops: for a tick the tip presses
with next to nothing.  To the forces that looks like a slip.  Two things tell it from one:

- **the torque** about the tool's axis is another one afterwards.  A tip that slides along its slot stays between the
  same walls, which hold the same couple: of 60 slips by a millimetre 58 left it within 6 mN.m.  A finger that is struck
  by another finger is read with another torque, too.  (A tip that leaves its drive loses its torque; that is not for
  this test, but for one that asks whether the tip is in the drive.)
- **the turn**: the tool has just turned back, against the way it turns the screw, by a good part of the play, and the
  torque has been another one.

What the torque is read to change by when other forces change, because readings point the wrong way, is allowed for.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, radians, sqrt

import numpy as np

from turnscrew.estimate.biased_load import DIRECTION_SHARE
from turnscrew.estimate.slip_steps import axial_torque
from turnscrew.geometry.arrays import Array


@dataclass(frozen=True, slots=True)
class PlayState:
    """The last ticks, the newest last.

    Attributes:
        torque: (n,) of the fingertips about the tool's axis, as read [N.m].
        moment: (n, 5, 3) force of each finger, in W, times its distance from the axis [N.m].
        turned: (n,) by what the tool turned about its axis in each tick [rad].
    """

    torque: Array
    moment: Array
    turned: Array


@dataclass(frozen=True, slots=True)
class BladePlay:
    """Parameters.

    Attributes:
        play: Angle by which the blade can turn in its slot, from wall to wall [rad].
        direction_error: Bound of the readings' error in direction [rad].
        after: Time over which a torque is told [s]: of three readings the middle one.
        gap: Time before now in which the torque is not looked at [s], for it may be that of the jerk,
        before: and time up to which it is compared with what it is now [s]: it comes and goes while a blade that is
            free hops.
        least: What the torque changes by at least when the blade meets its walls [N.m]: a slip leaves it within 6 mN.m,
            and the threads of screws that a hand can turn resist by 10 and more.
        sure: Standard deviations of the readings' error that count as no change.
        lately: Time in which the tool has turned back [s]: a spring-back of a fast gait crosses the play in .1 s,
        share: of the play by which it has to: odometry errs by a tenth of it in that time,
        memory: and time in which the torque has changed by `least` then [s]: a thread like a spring, which turns back
            with the tool, keeps its blade on the same walls and its torque nearly as it was.
    """

    play: float = radians(3.9)
    direction_error: float = radians(30.0)
    after: float = 0.03
    gap: float = 0.08
    before: float = 0.2
    least: float = 0.008
    sure: float = 2.0
    lately: float = 0.15
    share: float = 0.4
    memory: float = 0.4

    def init(self) -> PlayState:
        """Nothing read yet."""
        return PlayState(np.empty(0), np.empty((0, 5, 3)), np.empty(0))

    def update(self, state: PlayState, f_W: Array, arm: Array, axis: Array, turned: float, dt: float) -> PlayState:
        """Take in one tick.

        Args:
            state: Of the last tick.
            f_W: (5, 3) forces of the fingertips on the tool as read, in W [N].
            arm: (5, 3) from the tip to the contact points, in W [m].
            axis: (3,) the tool's axis in W.
            turned: By what the tool has turned about it since the last tick [rad].
            dt: Time since then [s].
        """
        torque, moment = axial_torque(f_W, arm, axis)
        kept = round(self.memory / dt) - 1
        return PlayState(
            np.append(state.torque[-kept:], torque),
            np.concatenate([state.moment[-kept:], moment[None]]),
            np.append(state.turned[-kept:], turned),
        )

    def crossed(self, state: PlayState, dt: float) -> bool:
        """Whether the blade has met the other wall, or is on its way to it."""
        after, gap, before = (round(span / dt) for span in (self.after, self.gap, self.before))
        if len(state.torque) < before + after:
            return False
        # medians: fingers that strike something are read wrong for a tick
        torque, moment = float(np.median(state.torque[-after:])), np.median(state.moment[-after:], axis=0)
        met = False
        for end in range(gap, before + 1, after):
            then = slice(-end - after, -end)
            shift = (moment - np.median(state.moment[then], axis=0)).ravel()
            doubt = self.sure * DIRECTION_SHARE * self.direction_error * sqrt(shift @ shift)
            met = met or abs(torque - float(np.median(state.torque[then]))) > hypot(self.least, doubt)
        back = float(state.turned[-round(self.lately / dt) :].sum())
        eased = float(np.ptp(state.torque[:-gap])) > self.least
        return bool(met or (eased and back > self.share * self.play))
