"""Whether a screw that nobody holds springs back or stays: what the strokes until now tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

MOST = 0.025
"""Torque over angle beyond which one stroke alone tells of friction [N.m/rad]: springs that two fingers turn by five
rounds have .02 at most."""

GROWTH, NONE = 0.5, 0.25
"""Share of a spring's growth from which on a thread counts as one, and below which it is surely none: readings of the
same fingers err alike, so a spring shows 1, friction 0; but friction that grows with depth looks like a spring."""

AFTER = 0.1
"""Angle beyond that of the loss at which a stroke turned a tool that was out [rad]."""


class Guess(NamedTuple):
    """What a thread seems to be: whether it is a spring, and whether that, or that it is none, is sure."""

    spring: bool
    sure: bool


def springs_back(ends: Sequence[tuple[float, float]], theta: float) -> Guess:
    """Whether the torque grows in proportion to the angle, as a spring's does.

    Args:
        ends: Angle of the screw [rad] and its torque on the tool [N.m] at the end of each stroke until now.
        theta: Angle at which the tip was lost [rad].
    """
    made = [end for end in ends if 0.0 < end[0] < theta + AFTER]
    if not made:
        return Guess(False, False)
    # while the first stroke lasts, the readings' errors are still being learned
    made = made[1:] if len(made) > 2 else made
    angles, torques = np.transpose(made)
    whole = torques[-1] / angles[-1]
    if whole <= 0.0 or len(made) == 1 or np.ptp(angles) == 0.0:
        return Guess(bool(whole < MOST), False)
    across = angles - angles.mean()
    share = float(across @ torques / (across @ across) / whole)
    return Guess(share > GROWTH, len(ends) > 2 and share < NONE)
