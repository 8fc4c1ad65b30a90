"""Contact forces of a robot that takes torques, from the torques that it has sent: a disturbance observer.

What a drive is sent it gives.  So what the contacts take follows from (18) as it does from gauges in the drives
(`finger_force`), but from torques that nothing has read wrong:

    J^T f = tau_sent - (M a + C v + N + D v).

It holds for tau, v and a at the same time.  The speeds come low-passed from the encoders (`BetweenTicks`); the
torques have passed the very same low-pass (`BetweenTicks.sent`).  A last one, of both, gives the acceleration.

A finger in mid-air seems to press with what the model errs by, up to some newtons where it is flung about; whether one
touches is therefore asked of the sensors in the fingertips.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.estimate.finger_force import ForceFromTorque
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import DRIVEN, FINGERS, JOINTS

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

ALL = np.ones(len(DRIVEN), dtype=bool)


@dataclass(frozen=True, slots=True)
class DrivenState:
    """What is remembered.

    Attributes:
        tau: (24,) low-passed torques [N.m]; NaN before the first.
        v: (28,) low-passed speeds [rad/s]; NaN before the first.
        f_W: (5, 3) force of each fingertip on what it touches, in W [N].
    """

    tau: Array
    v: Array
    f_W: Array


@dataclass(frozen=True)
class DrivenForce:
    """Parameters of the observer.

    Attributes:
        force: What contacts take of torques.
        time: Time constant of the last low-pass [s]: a tick, over which the acceleration is told; the encoders' noise
            then makes .03 N.
    """

    force: ForceFromTorque
    time: float = 0.01

    def init(self) -> DrivenState:
        """Nothing sent yet."""
        nothing = np.full(len(DRIVEN), np.nan), np.full(len(JOINTS), np.nan)
        return DrivenState(*nothing, np.zeros((len(FINGERS), 3)))

    def update(
        self, state: DrivenState, tau: Array, q: Array, v: Array, tips: Fingertips, tip_W: Array, dt: float
    ) -> DrivenState:
        """One tick.

        Args:
            state: Of the last tick.
            tau: (24,) torques sent, low-passed as the speeds are [N.m].
            q: (28,) joint angles [rad].
            v: (28,) joint speeds [rad/s].
            tips: Fingertips at q.
            tip_W: (5, 3) points where the fingertips touch, or would, in W [m].
            dt: Time since the last tick [s].
        """
        if np.isnan(state.v[0]):
            return DrivenState(tau, v, state.f_W)
        share = dt / (self.time + dt)
        low, slow = state.tau + share * (tau - state.tau), state.v + share * (v - state.v)
        return DrivenState(low, slow, self.force.left(low, ALL, q, slow, (slow - state.v) / dt, tips, tip_W))
