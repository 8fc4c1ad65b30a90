"""The hybrid servo of Section IV-A: what the tool is to do, and what wrench the hand must put on it for that."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from turnscrew.contact.tool_dynamics import ToolInertia, tool_wrench
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.euler import body_rate_matrix, body_rate_matrix_derivative, euler_from_matrix, euler_rates
from turnscrew.signals import Estimate, Goal
from turnscrew.values import changed

TurningGains: TypeAlias = tuple[float, float, float, float, float]
"""kp, kv, ki, and the limits of the yaw's error and of the integral."""

PressingGains: TypeAlias = tuple[float, float, float]
"""kf, and the limits of the tip force's correction and of tau_s,y."""


@dataclass(frozen=True, slots=True)
class ServoState:
    """What the servo remembers.

    Attributes:
        yaw_d: Wanted yaw, the integral of the goal's turn rate [rad].
        integral: (3,) of the Euler angles' error [rad.s].
        force_integral: Of the tip force's error along z [N.s].
        gammadot: (3,) Euler rates of the reference that alpha drives, or of the tool [rad/s].
        alpha: (6,) acceleration of T in T that was asked for, linear first [m/s2, rad/s2].
        age: Time since the servo began [s].
    """

    yaw_d: float
    integral: Array
    force_integral: float
    gammadot: Array
    alpha: Array
    age: float = 0.0


@dataclass(frozen=True)
class HybridServo:
    """Position control of the tool's rotation, force control of its translation, (8)-(11).

    For position commands the reference is what alpha gives when it is integrated: its own rate is the `gammadot` of
    (10), because the rate of an estimate that is refreshed by a 30 Hz camera lags too far for damping.  For torques
    (`measured`) it is the tool's own, as the fingers' joints tell it.

    Attributes:
        tool: Mass properties as believed.
        pitch: Of the thread [m].
        kp: Stiffness of (10) [1/s2]: the square of 7.7 rad/s, a tenth of the finger servos' 90 rad/s, and slow enough
            for an estimate that a camera frame of 33 ms latency corrects (.25 rad of phase).
        kv: Damping [1/s]: `2 sqrt(kp)`, critical.
        ki: Integral gain [1/s3]: none, since alpha is integrated to positions here, where an error at rest already
            moves the reference on; torque control needs it.
        kf: Integral gain of the tip force in (11) [1/s].
        force_limit: Largest correction of the tip force by its integral [N]: half of what is wanted, so that
            a biased fingertip reading cannot lift the tip or crush it.
        yaw_limit: Largest yaw error acted on [rad]: the play of the blade in the slot, twice.
        integral_limit: Largest integral of an angle's error [rad.s].
        side_limit: Largest tau_s,y that is fed on [N.m].
        ease: Time in which the gains grow to their values [s]: the estimate's first camera frames err by degrees.
        measured: Whether (10) damps the tool's rate rather than that of the reference.
    """

    tool: ToolInertia
    pitch: float
    kp: float = 60.0
    kv: float = 16.0
    ki: float = 0.0
    kf: float = 1.0
    force_limit: float = 2.5
    yaw_limit: float = 0.2
    integral_limit: float = np.inf
    side_limit: float = np.inf
    ease: float = 0.0
    measured: bool = False
    _turning: TurningGains = field(init=False, repr=False, compare=False)
    _pressing: PressingGains = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        turning = (float(self.kp), float(self.kv), float(self.ki), float(self.yaw_limit), float(self.integral_limit))
        object.__setattr__(self, "_turning", turning)
        object.__setattr__(self, "_pressing", (float(self.kf), float(self.force_limit), float(self.side_limit)))

    def init(self, estimate: Estimate) -> ServoState:
        """The reference stands where the tool is."""
        return ServoState(float(euler_from_matrix(estimate.R_WT)[2]), np.zeros(3), 0.0, np.zeros(3), np.zeros(6))

    def update(self, state: ServoState, goal: Goal, estimate: Estimate, dt: float) -> tuple[ServoState, Array, Array]:
        """One tick.

        Args:
            state: Of the last tick.
            goal: Wanted turn rate and tip force.
            estimate: Pose of the tool and wrench at its tip.
            dt: Time since the last tick [s].

        Returns:
            The new state, alpha in it; nu_d (6,), velocity of the reference in T, linear first [m/s, rad/s], or with
            `measured` the goal's; and F_hd (6,), the wanted wrench of the hand on the tool at T's origin, in T, force
            first [N, N.m].

        Paper: (8)-(11).  Departures: (10) in its exact form (`d/dt(R^T T) gammadot` for `Lambda-dot xdot`), and the
            yaw error is measured to a target that waits when the tool falls behind by more than `yaw_limit`.
        """
        if goal.tip_free:
            return self._carry(state, goal, estimate)
        age = state.age + dt
        ease = 1.0 if age >= self.ease else age / self.ease
        tool, lead = self.tool, self.pitch / (2 * np.pi)
        yaw_d, force_integral, integral, gammadot, alpha, nu_d, F_hd = _servo(
            estimate.R_WT, estimate.nu, estimate.F_s, state.yaw_d, state.force_integral, state.integral, state.gammadot,
            float(goal.turn_rate), float(goal.tip_force), ease, dt, lead, self._turning, self._pressing, self.measured,
            tool.mass, tool.com, tool.M,
        )  # fmt: skip
        return ServoState(yaw_d, integral, force_integral, gammadot, alpha, age), nu_d, F_hd

    def _carry(self, state: ServoState, goal: Goal, estimate: Estimate) -> tuple[ServoState, Array, Array]:
        """A tool whose tip is free goes with the goal's twist: nothing is integrated, and the hand bears its weight.

        What the tip is to be pressed with is added: the hand's wrench is the tool's weight less `tip_force` along z.
        """
        R, tool = estimate.R_WT, self.tool
        nu_d = np.concatenate([R.T @ goal.V_tool[:3], R.T @ goal.V_tool[3:]])
        F_hd = tool_wrench(tool.mass, tool.com, tool.M, R, np.zeros(6), np.zeros(6))
        F_hd[2] -= goal.tip_force
        rested = changed(self.init(estimate), age=state.age)
        return rested, nu_d, F_hd


def torque_servo(tool: ToolInertia, pitch: float, frequency: float = 32.0, damping: float = 1.0) -> HybridServo:
    """The servo for a robot that takes torques, its gains placed.

    With `kp = frequency^2` and `kv = 2 damping frequency` an error of the angles dies as that of a mass on a spring
    does.  32 rad/s is a third of the 100 rad/s at which the finger joints' own damping brakes them (.1 N.m.s/rad on
    .001 kg.m2), which adds to kv, and leaves 20 ms of delay (the joints' speeds) .6 rad of phase.  The integral takes
    over at 3 rad/s, a tenth of that.

    Torques press as told to a tenth, and the contact forces are estimated from the same torques.  So (11) has little to
    correct, and what it feeds on is held to that: half a newton along z, and 5 mN.m of tau_s,y, the torque that the
    estimate holds at its limit most of the time.

    Args:
        tool: Mass properties as believed.
        pitch: Of the thread [m].
        frequency: Natural frequency of the angles' errors [rad/s].
        damping: Their damping ratio.
    """
    return HybridServo(
        tool, pitch, kp=frequency**2, kv=2.0 * damping * frequency, ki=3.0 * frequency**2, integral_limit=0.04,
        force_limit=0.5, side_limit=0.005, ease=0.4, measured=True,
    )  # fmt: skip


@compiled
def _servo(
    R_WT: Array, nu: Array, F_s: Array, yaw_d: float, force_integral: float, integral: Array, gammadot: Array,
    turn_rate: float, tip_force: float, ease: float, dt: float, lead: float, turning: TurningGains,
    pressing: PressingGains, measured: bool, mass: float, com: Array, M: Array,
) -> tuple[float, float, Array, Array, Array, Array, Array]:  # fmt: skip
    """(8)-(11) at once: wanted yaw, integrals of tip force and angles, Euler rates; alpha, nu_d and F_hd, all in T.

    `lead` is the way along the thread with a turn of one radian [m]; `mass`, `com` and `M` are the tool's.
    """
    rate = nu[3:] if measured else gammadot
    yaw_d, integral, gammadot, omega, omegadot = _turn(
        R_WT, rate, yaw_d + turn_rate * dt, turn_rate, integral, ease, dt, turning, measured
    )
    alpha = np.array([0.0, 0.0, lead * omegadot[2], omegadot[0], omegadot[1], omegadot[2]])
    nu_d = np.array([0.0, 0.0, lead * omega[2], omega[0], omega[1], omega[2]])
    force_integral, F_sc = _press(F_s, tip_force, force_integral, dt, pressing)
    return yaw_d, force_integral, integral, gammadot, alpha, nu_d, tool_wrench(mass, com, M, R_WT, nu_d, alpha) - F_sc


@compiled
def _press(F_s: Array, tip_force: float, integral: float, dt: float, gains: PressingGains) -> tuple[float, Array]:
    """(11): the integral of the tip force's error [N.s], and the wrench F_sc (6,) that the screw is to answer with."""
    kf, force_limit, side_limit = gains
    limit = force_limit / kf
    integral = min(max(integral + (tip_force - F_s[2]) * dt, -limit), limit)
    side = min(max(F_s[4], -side_limit), side_limit)
    return integral, np.array([0.0, 0.0, tip_force + kf * integral, F_s[3], side, F_s[5]])


@compiled
def _turn(
    R_WT: Array,
    rate: Array,
    yaw_d: float,
    turn_rate: float,
    integral: Array,
    ease: float,
    dt: float,
    gains: TurningGains,
    measured: bool,
) -> tuple[float, Array, Array, Array, Array]:
    """(9) and (10) for the rotation: wanted yaw, integral, Euler rates, wanted omega and omegadot in T."""
    kp, kv, ki, yaw_limit, integral_limit = gains
    gamma = euler_from_matrix(R_WT)
    ahead = (yaw_d - gamma[2] + np.pi) % (2.0 * np.pi) - np.pi
    ahead = min(max(ahead, -yaw_limit), yaw_limit)
    error = ease * np.array([-gamma[0], -gamma[1], ahead])
    integral = np.minimum(np.maximum(integral + error * dt, -integral_limit), integral_limit)
    wanted = np.array([0.0, 0.0, turn_rate])
    gammadot = euler_rates(gamma, rate) if measured else rate
    gammaddot = kv * (wanted - gammadot) + kp * error + ki * integral
    if not measured:
        gammadot = gammadot + gammaddot * dt
        wanted = gammadot
    rates, change = body_rate_matrix(gamma), body_rate_matrix_derivative(gamma, gammadot)
    omega, omegadot = np.zeros(3), np.zeros(3)
    for i in range(3):
        for j in range(3):
            omega[i] += rates[i, j] * wanted[j]
            omegadot[i] += rates[i, j] * gammaddot[j] + change[i, j] * gammadot[j]
    return gamma[2] + ahead, integral, gammadot, omega, omegadot
