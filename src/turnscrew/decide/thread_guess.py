"""Whether a screw that nobody holds springs back or stays: what the hand-overs until now tell.

Whoever takes over the handle does not hold it quite where it was: it goes back by a degree or two.  A spring then
pushes as before.  Friction is rid of its load, or turns round: its torque falls by as much as it was, or twice that.
How large the torque is, or how it grows, tells less: fingertip readings err by a quarter, and by other amounts while
the fingers roll, but what the same fingers read a third of a second later errs alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

FALL = 0.007
"""Mean fall of the torque from which on it is friction's [N.m].  In 43 runs up to a moment between 1 and 12 s (k_s
.005 to .016 N.m/rad, prevailing torques .012 to .053 N.m, positions and torques) springs showed -.022 to .006,
friction .005 to .051, that below .009 in the first stroke alone."""

SURE, AFTER = (0.002, 0.012), 1
"""Falls below and above which there is no doubt [N.m], after how many strokes: no heading but that is tried then."""


class Guess(NamedTuple):
    """What a thread seems to be: whether it is a spring, and whether that is sure."""

    spring: bool
    sure: bool


def springs_back(falls: Sequence[float]) -> Guess:
    """Whether it does.

    Args:
        falls: By how much the screw's torque on the tool has fallen while a roll's end was passed on, for each stroke
            until now [N.m].
    """
    known = [fall for fall in falls if np.isfinite(fall)]
    if not known:
        return Guess(False, False)
    # while the first stroke lasts, the readings' errors are still being learned
    mean = float(np.mean(known[1:] or known))
    return Guess(mean < FALL, len(known) > AFTER and not SURE[0] < mean < SURE[1])
