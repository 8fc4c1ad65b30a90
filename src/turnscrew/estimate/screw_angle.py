"""Screw angle from the tool's yaw, through the play of the blade in the slot."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians


@dataclass(frozen=True, slots=True)
class AngleState:
    """What the angle's bookkeeping remembers.

    Attributes:
        elapsed: Time since the start [s].
        yaw: Tool yaw at the last tick [rad], in (-pi, pi].
        turned: How far the tool has turned in the fastening sense since the start, unwrapped [rad].
        theta: How far the screw has followed [rad].
    """

    elapsed: float
    yaw: float
    turned: float
    theta: float


@dataclass(frozen=True, slots=True)
class ScrewAngle:
    """theta follows the tool within the slot's play: |theta - turned| <= play / 2, and moves only when pushed.

    While the filter settles, its yaw still moves towards the truth with the tool at rest, and that is no turning: then
    odometry alone is counted.

    Attributes:
        play: Angle by which the blade can turn in the slot, from wall to wall [rad]; a blade .2 mm thinner than
            a slot and 4 mm wide has 6 deg, and the tool leads the screw by half of it, starting centred.
        settle: Time in which the yaw is not yet counted [s]: 30 frames bring 2 deg to .4 deg.

    Paper: theta of III-B, "estimated from the rotation of the screwdriver"; the paper does not mention the play.
    """

    play: float = radians(6.0)
    settle: float = 1.0

    def init(self, yaw: float) -> AngleState:
        """Start with the blade in the middle of its play and the screw's angle counted from here."""
        return AngleState(0.0, yaw, 0.0, 0.0)

    def update(self, state: AngleState, yaw: float, rolled: float, dt: float) -> AngleState:
        """Follow the tool.

        Args:
            state: Of the last tick.
            yaw: Tool yaw now [rad].
            rolled: What odometry alone said of its change since the last tick [rad].
            dt: [s].
        """
        change = rolled if state.elapsed < self.settle else (yaw - state.yaw + pi) % (2.0 * pi) - pi
        turned = state.turned - change
        theta = min(max(state.theta, turned - 0.5 * self.play), turned + 0.5 * self.play)
        return AngleState(state.elapsed + dt, yaw, turned, theta)
