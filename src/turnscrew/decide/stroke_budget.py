"""How far to roll in a round, so that a thread that gets ever tighter is not too tight before the last one.

A spring-like thread asks for `k_s theta`: with full strokes twenty rounds can end at twice what two fingers hold.  What
they hold is then shared out over the rounds that are still to be made, in shorter strokes.  Where the torque does not
grow, as in the run-down of a self-locking thread, all strokes are full.  Which of the two it is, hand-overs tell better
than how the torque grows (`thread_guess`).

Paper: no counterpart; its runs end after five rounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEAST = float(np.radians(24.0))
"""Shortest turn of the handle in a round [rad]: one that turns the screw by less than `Gait.least_turn`, 22 deg, is
made again, and a degree is lost, to what thread and fingers give back: at .12 to .2 N.m strokes told to turn by 27 deg
turned by 26.2 to 28.3."""


Ends = Sequence[tuple[float, float]]
"""Angle [rad] and torque [N.m] at the end of each stroke."""


@dataclass(frozen=True)
class StrokeBudget:
    """What can be spent.

    Attributes:
        rounds: How many are wanted in all.
        torque: What the rolling pair holds with the share of friction that its squeeze counts on [N.m].
        least: Shortest stroke [rad].
    """

    rounds: int
    torque: float
    least: float = LEAST

    def stroke(self, full: float, made: int, ends: Ends, spring: Ends = ()) -> float:
        """Angle of the next stroke [rad].

        Args:
            full: The longest [rad].
            made: Rounds until now.
            ends: Angle of the screw [rad] and its torque on the tool [N.m] at the end of each stroke until now.
            spring: The same when each stroke had come to rest, if it is a spring that resists; nothing otherwise.
        """
        left, growth = self.rounds - made, growth_of(ends)
        if len(spring) > 1:
            # a spring resists in proportion, however little it seems to from one end to the next
            growth = max(growth, spring[-1][1] / spring[-1][0])
        if growth <= 0.0 or left <= 0:
            return full
        return float(np.clip((self.torque - ends[-1][1]) / (growth * left), min(self.least, full), full))


def growth_of(ends: Ends) -> float:
    """By how much a screw's torque grows with its angle [N.m/rad]; 0 until two strokes have ended.

    It is the slope of the line through the ends, where the same fingers read with the same errors, or of the one from
    nothing to the last end, if that is less: a spring resists in proportion to the angle, and friction that is read
    wrong by another share each time seems to grow at first.

    Args:
        ends: Angle [rad] and torque [N.m] at the end of each stroke.
    """
    if len(ends) < 2:
        return 0.0
    theta, torque = np.transpose(ends)
    if np.ptp(theta) == 0.0 or theta[-1] <= 0.0:
        return 0.0
    across = theta - theta.mean()
    return min(float(across @ torque / (across @ across)), float(torque[-1] / theta[-1]))


def pinch_torque(radius: float, friction: float, squeeze: float, thrust: float) -> float:
    """Torque of two opposite fingertips about a handle's axis [N.m], `2 r sqrt((mu N)^2 - (f_z / 2)^2)`.

    Args:
        radius: Of the handle [m].
        friction: Coefficient mu.
        squeeze: Normal force N of each [N].
        thrust: Force f_z along the axis that both carry [N].
    """
    return 2.0 * radius * float(np.sqrt(max((friction * squeeze) ** 2 - (thrust / 2.0) ** 2, 0.0)))
