"""Position commands for a hand that takes nothing else, in the four steps of Section V-B."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.actuate.stops import Stops
from turnscrew.geometry.arrays import Array
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import ARM, COUPLED, FINGERS, INDEX, WRIST, finger_joints
from turnscrew.robot.model import Fingertips, RobotModel, driven_jacobian
from turnscrew.robot.servos import FINGER_STIFFNESS, STIFFNESSES
from turnscrew.signals import FREE, GRIP, REACH, Command, Effort, Estimate, Goal

PALM_JOINTS = np.array([INDEX[name] for name in (*ARM, *WRIST)])
STOP = FINGER_STIFFNESS
"""Stiffness of the soft stops [N.m/rad]: with the servo's own, 15 ms late, twice that leaves .3 of critical damping."""

FINGER_JOINTS = [np.array(finger_joints(finger)) for finger in FINGERS]


@dataclass(frozen=True)
class PositionAdapter:
    """Turns wanted contact motions and forces into joint positions.

    The paper's steps, for each finger that carries the tool: (1) X_d, where its contact would be without force, moves
    with the reference of the servo; (2) F'_d comes from (16); (3) X_c = X_d + k_m F'_d lies inside the handle;
    (4) X_c is taken to joint space by the inverse Jacobian, one damped Newton step a tick: of the .2 mm that
    a contact moves in 10 ms it leaves `.2^2 / (2 30)` mm, less than a micrometre.  Here k_m is not one number but the
    finger's own compliance `J K^-1 J^T`, K the stiffness of its servos, so that in joint space step (3) is
    `K^-1 J^T F'_d` and what is commanded is what is pressed.

    Attributes:
        robot: Kinematics and joint ranges.
        damping: Of the inverse Jacobian [m/rad]: a tenth of the least lever that the plan's postures have (20 mm, the
            thumb along itself): it costs them 1 % of a motion and bounds what lies beyond.
        guide: Rate at which a finger with a joint to spare (the thumb) keeps to the plan's posture [1/s].
        margin: Distance that commands keep from the joint limits [rad].
        push: How far a finger that feels for the handle may be commanded ahead of itself [m]: it then presses with
            some 4 N on whatever holds it up, such as another finger.
        speed: Fastest motion of a free joint's command [rad/s]: Shadow's 2-4 rad/s.
        settling: Time in which fingers that carry a tool in the air forget where they were told to be [s]: what a
            search has bent them by would stay in the grasp, and grow until a finger is pushed off.  Meanwhile they
            give way to what is not known of the tool, whose weight is off by half a newton, by .1 mm/s.
        stops: Before the limits of the fingers' joints.
    """

    robot: RobotModel
    damping: float = 0.002
    guide: float = 4.0
    margin: float = 0.005
    push: float = 0.003
    speed: float = 4.0
    settling: float = 0.5
    stops: Stops = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "stops", Stops(self.robot.limits, STOP))

    def init(self, q: Array) -> Array:
        """Commands begin where the joints are.

        Args:
            q: (28,) encoder readings [rad].

        Returns:
            (28,) the state: joint positions that realise X_d, in encoder angles [rad].
        """
        return q.copy()

    def update(self, state: Array, goal: Goal, effort: Effort, estimate: Estimate, dt: float) -> tuple[Array, Command]:
        """One tick.

        Args:
            state: (28,) joint positions that realise X_d [rad].
            goal: Roles of the fingers.
            effort: Reference motion and contact forces.
            estimate: Joint angles, encoder offsets and contacts.
            dt: Time since the last tick [s].

        Returns:
            The new state and the command.
        """
        tips = self.robot.fingertips(estimate.q)
        J = driven_jacobian(tips.J)
        q, offset = state.copy(), estimate.offset
        palm_rate = self._move_palm(q, goal, estimate, dt)
        bend = self.robot.gravity(estimate.q)
        for row, joints in enumerate(FINGER_JOINTS):
            role = goal.roles[row]
            if role == FREE:
                step = goal.q_free[joints] + offset[joints] - q[joints]
                q[joints] += np.clip(step, -self.speed * dt, self.speed * dt)
                continue
            if role == REACH:
                ahead = J[row, :3, joints].T @ (q - offset - estimate.q)[joints]
                J_c, v = J[row, :3], goal.approach[row] * (ahead @ ahead < self.push**2)
            else:
                J_c, v = self._contact_motion(row, effort, estimate, tips, J)
            slack = v - J_c[:, PALM_JOINTS] @ palm_rate
            rest = goal.q_guide[joints] + offset[joints] - q[joints]
            if role == GRIP and goal.tip_free and not goal.locked:
                q[joints] += dt / self.settling * (estimate.q + offset - q)[joints]
            q[joints] += dt * self._inverse(J_c[:, joints], slack, self.guide * rest)
            bend += effort.f_W[row] @ J_c
        return self._limit(state, q, bend, self.stops.pushed_back(estimate.q, estimate.v))

    def _contact_motion(
        self, row: int, effort: Effort, estimate: Estimate, tips: Fingertips, J: Array
    ) -> tuple[Array, Array]:
        """Jacobian (3, 28) of the finger's point at the contact, and that point's wanted velocity (3,) in W [m/s]."""
        contact = estimate.c_W[row]
        x, y, z = contact - tips.p_WF[row]
        arm = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        J_c = J[row, :3] + arm @ J[row, 3:]
        v, omega = estimate.R_WT @ effort.nu_d[:3], estimate.R_WT @ effort.nu_d[3:]
        x, y, z = contact - estimate.p_WT
        spin = np.array([omega[1] * z - omega[2] * y, omega[2] * x - omega[0] * z, omega[0] * y - omega[1] * x])
        return J_c, v + spin

    def _move_palm(self, q: Array, goal: Goal, estimate: Estimate, dt: float) -> Array:
        """Moves arm and wrist so that the palm has its twist; returns their rates (6,) [rad/s]."""
        J = self.robot.palm_jacobian(estimate.q)[:, PALM_JOINTS]
        rate = np.linalg.solve(J.T @ J + 1e-6 * np.eye(6), J.T @ goal.V_palm)
        q[PALM_JOINTS] += rate * dt
        return np.asarray(rate)

    def _inverse(self, J: Array, v: Array, rest: Array) -> Array:
        """Damped least squares, with a joint rate `rest` where the task leaves freedom."""
        regular = J @ J.T + self.damping**2 * np.eye(3)
        weights = np.linalg.solve(regular, np.column_stack([v, J @ rest]))
        if J.shape[1] == 3:
            return np.asarray(J.T @ weights[:, 0])
        return np.asarray(J.T @ (weights[:, 0] - weights[:, 1]) + rest)

    def _limit(self, before: Array, q: Array, bend: Array, back: Array) -> tuple[Array, Command]:
        """Adds the servos' bending under load and by the stops' springs, and keeps all within the joint ranges."""
        limits = self.robot.limits
        q = np.clip(q, limits[:, 0] + self.margin, limits[:, 1] - self.margin)
        for follower, leader in COUPLED.items():
            q[INDEX[follower]] = q[INDEX[leader]]
            bend[INDEX[leader]] += bend[INDEX[follower]]
        wanted = q[DRIVEN_INDEX] + (bend[DRIVEN_INDEX] + back) / STIFFNESSES
        low, high = limits[DRIVEN_INDEX].T
        return q, Command(np.clip(wanted, low, high), (wanted < low) | (wanted > high), motion=q - before)
