"""Torques for a tool whose tip is out of its drive: fingers on springs, as position servos have them.

Under force control nothing keeps a tool in place but the drive that its tip stands in.  In the air, fingers have to
keep their posture, and in a slot that is searched for, what pushes the tip is told by how far they give way.  So a
robot that takes torques then works out itself what position servos would: it is told positions, and each finger drive
is sent the spring's torque towards them.  Arm and wrist, whose encoders are too noisy for servos as stiff, stay
under an impedance, but a stiffer one than they are under anyway: a tip that is tapped over the head is pushed aside by
an arm that gives way.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

import numpy as np

from turnscrew.actuate.position import PositionAdapter
from turnscrew.actuate.postures import CARRIERS, Gains, Posture, Postures
from turnscrew.actuate.torque import TorqueAdapter
from turnscrew.geometry.arrays import Array
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.model import RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.robot.servos import STIFFNESSES
from turnscrew.signals import Command, Effort, Estimate, Goal

ARM = Gains(625.0, 40.0, 200.0)
"""Of the arm: 25 rad/s [1/s2, 1/s, 1/s3].  With what is told late (`BetweenTicks.free_time`), and sent 3 ms late, it
keeps 40 deg of phase at 46 rad/s, and its swing is damped by .77 of critical.  At the 10 rad/s at which it is held
otherwise a newton at the tip moves that by a millimetre.  The encoders' noise, .005 deg, makes 1 N.m at the shoulder,
which moves 4 kg.m2 by a third of that noise.  The integral is the other impedance's, for it goes on with what that has
summed up."""

WRIST = Gains(1600.0, 30.0)
"""Of the wrist [1/s2, 1/s]: 40 rad/s, with the joint's own 33/s of damping .8 of critical.  At the 20 rad/s at which it
is held otherwise, a newton at the tip moves that by 7 mm, and a tip that comes free hops as far."""


@dataclass(frozen=True, slots=True)
class SprungState:
    """What is remembered.

    Attributes:
        posture: Of arm and wrist, and of all while the tip is in its drive.
        rest: (28,) joint positions at which the springs do not pull, loads apart, in encoder angles [rad]; None while
            the tip is in its drive.
        pulled: (24,) where the drives' springs pull to, loads included [rad],
        time: and when that was worked out: once a tick [s].
    """

    posture: Posture
    rest: Array | None = None
    pulled: Array | None = None
    time: float = -inf


@dataclass(frozen=True)
class SprungAdapter:
    """(17) and (18) while the tip is in its drive, springs while it is not.

    The fingers' damping is the joints' own: with the springs of the position servos, 8 N.m/rad on .001 kg.m2, its
    .1 N.m.s/rad are .56 of critical, and a measured speed comes 20 ms late, too late to add to that at 90 rad/s.

    Attributes:
        seated: Torques while the tip is in its drive.
        positions: What position servos would be told,
        tick: and how often [s].
        postures: Impedance of arm and wrist meanwhile.
    """

    seated: TorqueAdapter
    positions: PositionAdapter
    tick: float
    postures: Postures = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "postures", Postures(self.robot.limits, arm=ARM, wrist=WRIST))

    @property
    def robot(self) -> RobotModel:
        """Kinematics, dynamics and limits."""
        return self.seated.robot

    def init(self, q: Array) -> SprungState:
        """Postures begin where the joints are: angles (28,) [rad]."""
        return SprungState(self.seated.init(q))

    def update(
        self, state: SprungState, goal: Goal, effort: Effort, estimate: Estimate, dt: float
    ) -> tuple[SprungState, Command]:
        """One beat; arguments as for `TorqueAdapter.update`.

        Springs begin where the fingers are, and push with the forces that are wanted then: nothing jumps.
        """
        if not goal.tip_free:
            posture, command = self.seated.update(state.posture, goal, effort, estimate, dt)
            return SprungState(posture), command
        reading = estimate.q + estimate.offset
        rest, pulled = reading if state.rest is None else state.rest, state.pulled
        if pulled is None or estimate.time > state.time:
            # beats between two ticks keep what springs pull to, as servos do that are told positions once a tick
            rest, wanted = self.positions.update(rest, goal, effort, estimate, self.tick)
            pulled = reading[DRIVEN_INDEX] if wanted.q is None else wanted.q
        posture, tau = self._palm(state.posture, goal, effort, estimate, dt)
        tau[CARRIERS:] = (STIFFNESSES * (pulled - reading[DRIVEN_INDEX]))[CARRIERS:]
        within = np.clip(tau, -DRIVE_LIMITS, DRIVE_LIMITS)
        return SprungState(posture, rest, pulled, estimate.time), Command(None, tau != within, within)

    def _palm(
        self, posture: Posture, goal: Goal, effort: Effort, estimate: Estimate, dt: float
    ) -> tuple[Posture, Array]:
        """Postures after a beat, and torques (24,) that hold arm and wrist to them; nothing for the fingers [N.m]."""
        dynamics = self.robot.dynamics(estimate.q, estimate.v)
        posture, qddot = self.postures.update(posture, goal, dynamics, estimate.q, estimate.v, dt)
        J = self.robot.contact_jacobians(estimate.q, estimate.v, estimate.c_W)
        tau = np.zeros(len(qddot))
        palm = slice(CARRIERS)
        tau[palm] = dynamics.bias[palm] + dynamics.M[palm, palm] @ qddot[palm]
        tau[palm] += np.einsum("ki,kij->j", effort.f_W, J)[palm] + self.robot.damping[palm] * posture.rate[palm]
        return posture, tau
