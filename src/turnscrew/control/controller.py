"""The control room's block: servo and distribution in one tick."""

from __future__ import annotations

from dataclasses import dataclass

from turnscrew.control.distribution import Distribution
from turnscrew.control.servo import HybridServo, ServoState
from turnscrew.geometry.arrays import Array
from turnscrew.signals import Effort, Estimate, Goal


@dataclass(frozen=True, slots=True)
class ControllerState:
    """State of servo and distribution."""

    servo: ServoState
    squeeze: Array


@dataclass(frozen=True)
class Controller:
    """What the contacts are to do: (8)-(11), then (15)-(16)."""

    servo: HybridServo
    distribution: Distribution

    def init(self, estimate: Estimate) -> ControllerState:
        """Nothing asked for yet."""
        return ControllerState(self.servo.init(estimate), self.distribution.init())

    def update(
        self, state: ControllerState, goal: Goal, estimate: Estimate, dt: float
    ) -> tuple[ControllerState, Effort]:
        """One tick; see `HybridServo.update` and `Distribution.update`."""
        servo, nu_d, F_hd = self.servo.update(state.servo, goal, estimate, dt)
        squeeze, f_W = self.distribution.update(state.squeeze, goal, estimate, F_hd, dt)
        return ControllerState(servo, squeeze), Effort(nu_d, f_W, F_hd)
