"""How the screw resists: k_s, identified while the tool turns, and the torque itself."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.estimate.biased_load import BiasedLoad, LoadState
from turnscrew.geometry.arrays import Array


@dataclass(frozen=True, slots=True)
class ThreadState:
    """What the identification remembers.

    Attributes:
        load: Torque at angle zero (offset), k_s (slope), and the readings' errors.
        theta: Of the last tick [rad].
        rate: Low-passed rate of theta [rad/s].
    """

    load: LoadState
    theta: float
    rate: float


@dataclass(frozen=True, slots=True)
class ThreadStiffness:
    """tau_s,z = offset + k_s theta, learned from the hand's torque about the tool's axis.

    Nothing is told of the law.  Where the thread is a spring, k_s is its stiffness and the offset stays near zero;
    where friction holds it, the offset follows what the hand happens to hold while it rests, and k_s is how the
    prevailing torque grows.  Before theta leaves zero, the blade has not met the slot's walls and the torque is zero:
    this moment tells the errors of the fingers that hold the tool first.  k_s is learned only while theta grows.

    What cannot be known: a gain error common to the fingers that turn makes k_s and the torque wrong by the same share.
    No fingertip tells it, for every torque in the cell is one that fingertips measured; so it is part of the stated
    variance, `gain_error`.

    Paper: k_s of III-B is given there.

    Attributes:
        load: The filter.  Offset: .02 N.m, a dry M4's prevailing torque.  Slope: .3 N.m/rad, a third of what a hard M3
            joint has.  Drift: .01 N.m in a second, the viscous part of a thread's friction as it comes and goes, and
            slip of a thread at rest.  Noise: 3e-3 N.m, .03 N of noise of each of two to four fingertips at 18 mm, and
            the torsion of their contact patches, which no fingertip feels (2 mm times squeeze changes of .5 N).
            With these the torque follows in 30 ms (5 Hz).
        gain_error: Bound of the relative error of a reading's magnitude.
        turning: Rate of theta above which it grows [rad/s]: ten times the drift that camera noise leaves in it.
        rate_time: Time constant of the rate's low-pass [s]: a tenth of a stroke.
        least: Fingers that must hold the tool for a reading to count: one alone slides.
    """

    load: BiasedLoad = field(default_factory=lambda: BiasedLoad(offset=0.02, slope=0.3, drift=0.01, noise=0.003))
    gain_error: float = 0.25
    turning: float = 0.1
    rate_time: float = 0.1
    least: int = 2

    def init(self) -> ThreadState:
        """Not turned yet."""
        return ThreadState(self.load.init(), 0.0, 0.0)

    def update(
        self, state: ThreadState, torque: float, lever: Array, theta: float, dt: float
    ) -> tuple[ThreadState, float]:
        """Take in one reading.

        Args:
            state: Of the last tick.
            torque: Of the hand on the tool about its z axis, turned round: what the screw must resist with [N.m].
            lever: (5,) squeeze of each finger times its distance from the axis [N.m], zero where it does not touch.
            theta: Angle by which the screw has been turned in [rad].
            dt: Time since the last tick [s].

        Returns:
            The new state, and the torque of the screw on the tool, tau_s,z [N.m].
        """
        rate = state.rate + dt / (self.rate_time + dt) * ((theta - state.theta) / dt - state.rate)
        load = state.load
        if np.count_nonzero(lever) >= self.least:
            load = self.load.update(
                load, torque, lever, theta, dt, loaded=theta > 0.0, learns=theta > 0.0 and rate > self.turning
            )
        return ThreadState(load, theta, rate), self.torque(load, theta)

    def torque(self, load: LoadState, theta: float) -> float:
        """tau_s,z at an angle [N.m]."""
        return float(load.x[0] + load.x[1] * theta) if theta > 0.0 else 0.0

    def stiffness(self, state: ThreadState) -> float:
        """k_s [N.m/rad]; not a number until turning has halved the doubt that there was at the start."""
        known = float(state.load.P[1, 1]) < (0.5 * self.load.slope) ** 2
        return float(state.load.x[1]) if known else np.nan

    def deviation(self, state: ThreadState) -> float:
        """Standard deviation of k_s [N.m/rad], with the gain error that no reading tells.

        A gain's error has a standard deviation of half its bound; two fingers turn.
        """
        gain = 0.5 * self.gain_error / np.sqrt(2.0) * float(state.load.x[1])
        return float(np.hypot(np.sqrt(state.load.P[1, 1]), gain))
