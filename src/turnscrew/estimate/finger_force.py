"""Fingertip forces from the torques of the hand's drives, for a hand without sensors in its fingertips.

The dynamics of the robot (18), in the rows of one finger's drives and with the joints' damping D, leave of the
measured torques what the contact takes:

    J^T f = tau - (M a + C v + N + D v),

J (3, n) the Jacobian of the contact point for the finger's n drives: 3 of FF, MF, RF, 4 of LF, 5 of TH.  A tendon
that drives J1 and J2 works on both, so both rows add up in the leader's.  It is solved by weighted least squares with
a prior,

    f = argmin |J^T f - rest|^2_{1/sigma^2} + (f.n)^2 / s_n^2 + |f - (f.n) n|^2 / s_t^2,

sigma a drive's doubt and n the fingertip's outward normal at the contact.  It is solved twice: with a wide s_t for the
normal force, then with s_t = friction x normal force, since what rubs cannot be more than friction allows.  Where the
posture is well conditioned the gauges decide: with default ones and a lever of 60 mm the prior takes 1 % of what
presses and 6 % of what rubs.  Near a singular one, where a force along the finger makes no torque, and for a finger
that touches nothing, the answer stays short.

Lags.  The speeds come low-passed from the encoders; with D v and tau unmatched in time, a finger relocating at 3 rad/s
seems to press with 8 N.  So the torques pass the same low-pass, and the acceleration is the slope of the same speeds.
What is handed on is the force, low-passed by `lag`.  For the same reason a torque must be the mean over the tick, as
the speed is: the servos' steps make a sawtooth of it, whose last sample of a tick is low by a quarter while moving.

What remains with perfect gauges, for fingers that hold (four runs of five rounds, 95th percentiles): 6.6 % and 4.8 deg
while forces are steady; 18 % and 7 deg with the ramps of a squeeze, which the low-pass follows 25 ms late.  With exact
encoders and contact points the steady figures fall to 2.8 % and 3.1 deg: the torsion of the contact patch (up to 2 mm
times the normal force, 1 deg) and the joints' dry friction (.001 N.m, .5 deg); without both, and without the lag,
.4 % and .3 deg are left.  Left out besides: contacts of other links than the fingertip, and joint stops, so that a
finger that leans on its own stop reads as if it touched.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import COUPLED, DRIVEN, FINGERS, INDEX, JOINTS, finger_joints
from turnscrew.robot.model import RobotModel, driven_jacobian

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

K = len(FINGERS)
MOST = max(len(finger_joints(finger)) for finger in FINGERS)

_JOINTS = np.zeros((K, MOST), dtype=int)
"""Joint of each finger's drives, palm outwards; rows of shorter fingers end in joints that do not count."""
_DRIVES = np.zeros((K, MOST), dtype=int)
_COUNTS = np.zeros((K, MOST), dtype=bool)
for _row, _finger in enumerate(FINGERS):
    for _column, _joint in enumerate(finger_joints(_finger)):
        _JOINTS[_row, _column] = _joint
        _DRIVES[_row, _column] = DRIVEN.index(JOINTS[_joint])
        _COUNTS[_row, _column] = True
_FOLLOWERS = np.array([INDEX[follower] for follower in COUPLED])
_LEADERS = np.array([INDEX[leader] for leader in COUPLED.values()])


@dataclass(frozen=True, slots=True)
class FingerForceState:
    """What the estimate remembers between readings.

    Attributes:
        reading: (24,) last valid reading of each drive [N.m]; NaN before the first.
        age: (24,) time since then [s].
        tau: (24,) low-passed torques [N.m].
        v_slow: (28,) speeds, low-passed once more [rad/s]; NaN before the first reading.
    """

    reading: Array
    age: Array
    tau: Array
    v_slow: Array


@dataclass(frozen=True)
class ForceFromTorque:
    """Parameters of the estimate in the module's docstring.

    Attributes:
        robot: The robot's own model.
        gauge_floor: Doubt of a drive's torque at no load [N.m]: the gauge's noise and drift.
        gauge_share: Doubt that grows with the load, as a share of the torque: the gauge's gain after calibration.
        model_floor: Doubt of the unloaded finger's torque [N.m]: a damping of .1 N.m.s/rad times the encoders' speed
            noise of .044 rad/s, and dry friction.
        press: s_n, size of normal forces [N]: what the hand's fingertips safely bear.
        rub: The wide s_t [N]: a normal force of 5 N with friction .6.
        friction: Size of what rubs as a share of what presses: what the squeeze counts on, of a friction of 1.
        least: Smallest s_t [N], of a finger without normal force: half the smallest force that counts as a touch.
        lag: Low-pass of the force [s]; must be the time constant of the encoders' speeds.
        slope: Time constant of the acceleration, the slope of the speeds [s]: the encoders' .05 deg at 100 Hz then make
            4 rad/s2, which is .004 N.m at a drive's inertia of .001 kg.m2; 20 ms halve that, but a finger that jumps
            off at 3 rad/s then seems to press with .9 instead of .5 N.
        hold: How long a gauge's last reading stands in for missing ones [s]: five ticks; then it is blind, and the
            watch ends the run.
    """

    robot: RobotModel
    gauge_floor: float = 0.0075
    gauge_share: float = 0.15
    model_floor: float = 0.005
    press: float = 10.0
    rub: float = 3.0
    friction: float = 0.6
    least: float = 0.2
    lag: float = 0.02
    slope: float = 0.01
    hold: float = 0.05

    def init(self) -> FingerForceState:
        """Nothing read yet."""
        nothing = np.full(len(DRIVEN), np.nan)
        return FingerForceState(nothing, np.full(len(DRIVEN), np.inf), nothing, np.full(len(JOINTS), np.nan))

    def update(
        self, state: FingerForceState, tau: Array, q: Array, v: Array, tips: Fingertips, tip_W: Array, dt: float
    ) -> tuple[FingerForceState, Array]:
        """Takes one reading.

        Args:
            state: Of the last reading.
            tau: (24,) torques of the drives in the order of `DRIVEN` [N.m]; NaN where a gauge says nothing.
            q: (28,) joint angles [rad].
            v: (28,) joint speeds [rad/s].
            tips: Fingertips at q.
            tip_W: (5, 3) points where the fingertips touch, or would, in W [m].
            dt: Time since the last reading [s].

        Returns:
            The new state, and the force (5, 3) of each fingertip on what it touches, in its frame F [N].  It is always
            finite: a blind gauge loses its weight, and what the finger's others leave open the prior keeps short.
            That a gauge is blind is for the watch to name.

        Paper: Section V-B, "fed to forward dynamics for estimating the contact forces on fingertips".
        """
        state, a = self._advance(state, tau, v, dt)
        f_W = self.left(state.tau, state.age <= self.hold, q, v, a, tips, tip_W)
        return state, np.asarray(f_W[:, None, :] @ tips.R_WF)[:, 0]

    def left(self, tau: Array, known: Flags, q: Array, v: Array, a: Array, tips: Fingertips, tip_W: Array) -> Array:
        """What the contacts take of torques, the module's docstring's f.

        Args:
            tau: (24,) torques of the drives [N.m].
            known: (24,) which of them are known.
            q: (28,) joint angles [rad].
            v: (28,) joint speeds at the same time as the torques [rad/s].
            a: (28,) joint accelerations, likewise [rad/s2].
            tips: Fingertips at q.
            tip_W: (5, 3) points where the fingertips touch, or would, in W [m].

        Returns:
            The force (5, 3) of each fingertip on what it touches, in W [N].
        """
        measured = tau[_DRIVES]
        sees = _COUNTS & known[_DRIVES]
        rest = np.where(sees, measured - self._unloaded(q, v, a)[_JOINTS], 0.0)
        doubt = self.gauge_floor**2 + self.model_floor**2 + (self.gauge_share * measured) ** 2
        weight = np.where(sees, 1.0 / doubt, 0.0)
        J, n = contact_jacobians(tips, tip_W), normals(tips, tip_W)
        normal = (self._solve(J, rest, weight, n, np.full(K, self.rub)) * n).sum(axis=1)
        return self._solve(J, rest, weight, n, np.maximum(self.friction * normal, self.least))

    def _advance(self, state: FingerForceState, tau: Array, v: Array, dt: float) -> tuple[FingerForceState, Array]:
        """The low-passes; also the acceleration (28,) [rad/s2]."""
        seen = np.isfinite(tau)
        reading = np.where(seen, tau, state.reading)
        age = np.where(seen, 0.0, state.age + dt)
        # a speed is a difference of angles, so it belongs to the middle of the tick: the mean torque does too
        started = np.isfinite(state.tau)
        low = np.where(started, state.tau + dt / (self.lag + dt) * (reading - state.tau), reading)
        v_slow = np.where(np.isfinite(state.v_slow), state.v_slow, v)
        v_slow = v_slow + dt / (self.slope + dt) * (v - v_slow)
        return FingerForceState(reading, age, low, v_slow), (v - v_slow) / self.slope

    def _unloaded(self, q: Array, v: Array, a: Array) -> Array:
        """(28,) torques of the motion if nothing were touched, a coupled pair's on its leader [N.m]."""
        torque = self.robot.inverse_dynamics(q, v, a)
        torque[_LEADERS] += torque[_FOLLOWERS]
        return torque

    def _solve(self, J: Array, rest: Array, weight: Array, n: Array, rub: Array) -> Array:
        """The least squares of all fingers: J (5, 3, m), rest and weight (5, m), n (5, 3), s_t (5,); f_W (5, 3) [N]."""
        weighted = J * weight[:, None, :]
        along, across = self.press**-2, rub[:, None, None] ** -2
        prior = across * np.eye(3) + (along - across) * n[:, :, None] * n[:, None, :]
        solved = np.linalg.solve(weighted @ J.transpose(0, 2, 1) + prior, weighted @ rest[:, :, None])
        return np.asarray(solved[:, :, 0])


def contact_jacobians(tips: Fingertips, tip_W: Array) -> Array:
    """Jacobians (5, 3, 5) of points of the fingertips for their fingers' drives, palm outwards, in W [m].

    Args:
        tips: Fingertips.
        tip_W: (5, 3) the points in W [m].
    """
    x, y, z = (tip_W - tips.p_WF).T
    o = np.zeros(K)
    arm = np.array([[o, z, -y], [-z, o, x], [y, -x, o]]).transpose(2, 0, 1)
    J = driven_jacobian(tips.J[:, :3] + arm @ tips.J[:, 3:])
    picked = np.take_along_axis(J, _JOINTS[:, None, :].repeat(3, axis=1), axis=2)
    return np.asarray(picked * _COUNTS[:, None, :])


def normals(tips: Fingertips, tip_W: Array) -> Array:
    """Outward unit normals (5, 3) of the fingertips' capsules at points of theirs, in W.

    Args:
        tips: Fingertips.
        tip_W: (5, 3) the points in W [m].
    """
    axis = tips.R_WF[:, :, 2]
    out = tip_W - tips.p_WF
    along = np.clip((out * axis).sum(axis=1), -tips.length, 0.0)
    out = out - along[:, None] * axis
    return np.asarray(out / np.maximum(np.sqrt((out * out).sum(axis=1)), 1e-9)[:, None])
