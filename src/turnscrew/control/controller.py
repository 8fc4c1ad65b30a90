"""The control room's block: servo and distribution in one tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from turnscrew.control.servo import HybridServo, ServoState
from turnscrew.control.wanted_forces import WrenchSharing
from turnscrew.signals import Effort, Estimate, Goal


@dataclass(frozen=True, slots=True)
class ControllerState:
    """State of servo and distribution, and of the one for a tip that is out of its drive."""

    servo: ServoState
    shared: Any
    carried: Any = None


@dataclass(frozen=True)
class Controller:
    """What the contacts are to do: (8)-(11), then (15)-(16) or the optimal forces in their place.

    Attributes:
        servo: Of the tool.
        distribution: Shares the hand's wrench,
        carrying: and while the tip is out of its drive; None if in the same way.
    """

    servo: HybridServo
    distribution: WrenchSharing
    carrying: WrenchSharing | None = None

    def init(self, estimate: Estimate) -> ControllerState:
        """Nothing asked for yet."""
        return ControllerState(self.servo.init(estimate), self.distribution.init())

    def update(
        self, state: ControllerState, goal: Goal, estimate: Estimate, dt: float
    ) -> tuple[ControllerState, Effort]:
        """One tick; see `HybridServo.update` and `WrenchSharing.update`."""
        servo, nu_d, F_hd = self.servo.update(state.servo, goal, estimate, dt)
        shared, carried = state.shared, None
        if goal.tip_free and self.carrying is not None:
            carried = self.carrying.init() if state.carried is None else state.carried
            carried, wanted = self.carrying.update(carried, goal, estimate, F_hd, dt)
        else:
            shared, wanted = self.distribution.update(shared, goal, estimate, F_hd, dt)
        effort = Effort(nu_d, wanted.f_W, F_hd, servo.alpha, wanted.lost, wanted.margin, wanted.limited)
        return ControllerState(servo, shared, carried), effort
