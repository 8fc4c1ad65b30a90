"""The control room's block: servo and distribution in one tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from turnscrew.control.servo import HybridServo, ServoState
from turnscrew.control.wanted_forces import WrenchSharing
from turnscrew.signals import Effort, Estimate, Goal


@dataclass(frozen=True, slots=True)
class ControllerState:
    """State of servo and distribution."""

    servo: ServoState
    shared: Any


@dataclass(frozen=True)
class Controller:
    """What the contacts are to do: (8)-(11), then (15)-(16) or the optimal forces in their place."""

    servo: HybridServo
    distribution: WrenchSharing

    def init(self, estimate: Estimate) -> ControllerState:
        """Nothing asked for yet."""
        return ControllerState(self.servo.init(estimate), self.distribution.init())

    def update(
        self, state: ControllerState, goal: Goal, estimate: Estimate, dt: float
    ) -> tuple[ControllerState, Effort]:
        """One tick; see `HybridServo.update` and `WrenchSharing.update`."""
        servo, nu_d, F_hd = self.servo.update(state.servo, goal, estimate, dt)
        shared, wanted = self.distribution.update(state.shared, goal, estimate, F_hd, dt)
        effort = Effort(nu_d, wanted.f_W, F_hd, servo.alpha, wanted.lost, wanted.margin, wanted.limited)
        return ControllerState(servo, shared), effort
