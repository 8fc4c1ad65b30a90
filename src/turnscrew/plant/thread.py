"""How the thread resists: the torque of the substrate on the screw, a value of angle, speed and stick state."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Literal

PRESLIDING = radians(0.5)
"""Elastic twist of a sticking thread at its full friction torque [rad]; it also regularises Coulomb friction."""


@dataclass(frozen=True)
class Thread:
    """A thread law.

    `elastic`: `tau = k theta`, the paper's model of the clamping zone (Section III-B); the screw unwinds when let go.
    `self-locking`: friction opposes motion in both directions, as a metric thread's does (lead angle 3.4 deg, well
    below the friction angle): the screw stays when let go.  Its capacity is `prevailing_torque` until the head meets
    its seat, rises by k from there, and grows no further than `seat_torque`.  Friction is an elastic-plastic stick
    (Dahl's model in its stiff limit): it never drives the screw further in.

    Attributes:
        law: Which of the two.
        stiffness: k, rise of the torque with the angle turned in [N.m/rad].
        prevailing_torque: Friction torque of the free running thread [N.m]; the elastic law has none.
        seat_angle: Angle turned in at which the head meets its seat [rad].
        seat_torque: Torque at which the screw is tight [N.m].
    """

    law: Literal["elastic", "self-locking"]
    stiffness: float
    prevailing_torque: float
    seat_angle: float
    seat_torque: float

    def init(self) -> float:
        """A relaxed stick state: elastic twist 0 [rad]."""
        return 0.0

    def update(self, twist: float, yaw: float, rate: float, dt: float) -> tuple[float, float]:
        """One step of the law.

        Args:
            twist: Elastic twist of the sticking thread [rad].
            yaw: Angle of the screw's hinge [rad], negative when turned in.
            rate: Its rate [rad/s].
            dt: Step [s].

        Returns:
            The new twist [rad] and the torque on the screw about +z [N.m].
        """
        if self.law == "elastic":
            return 0.0, -self.stiffness * yaw
        clamping = self.stiffness * max(-yaw - self.seat_angle, 0.0)
        stiffness = min(self.prevailing_torque + clamping, self.seat_torque) / PRESLIDING
        twist = min(max(twist + rate * dt, -PRESLIDING), PRESLIDING)
        return twist, -stiffness * twist
