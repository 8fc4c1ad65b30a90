"""The robot's own model of itself: kinematics and dynamics of arm and hand without the tool.

This is what the loop reasons with; the plant may be heavier or stickier (`model.mass_error`).
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.arm import LINKS, add_arm
from turnscrew.robot.body_jacobians import motion_table, point_jacobians, tip_frames
from turnscrew.robot.contact_jacobian import contact_jacobians
from turnscrew.robot.coupling import DRIVE_OF_JOINT
from turnscrew.robot.hand import TIP_RADIUS, attach_hand, check_joint_order, torque_limit
from turnscrew.robot.joints import ARM, COUPLED, DRIVEN, FINGERS, INDEX, JOINTS

BASE_HEIGHT = 0.346
"""Height of the shoulder (DH frame 0) above the arm's base B, which is W here [m] (Barrett's user guide)."""

_TIP_BODIES = tuple(f"{finger.lower()}distal" for finger in FINGERS)


@dataclass(frozen=True, slots=True)
class Fingertips:
    """Where the fingertips are and how the joints move them.

    Attributes:
        p_WF: (5, 3) centres of the distal half balls, the origins of the frames F, in W [m].
        R_WF: (5, 3, 3) orientations of F; z points along the distal phalanx to the tip.
        J: (5, 6, 28) Jacobians of the frames F: linear velocity of the origin, then angular velocity, in W.
        rho: (5,) capsule radii [m].
        length: (5,) lengths of the capsules' cylinders, which reach from F's origin along -z [m].
    """

    p_WF: Array
    R_WF: Array
    J: Array
    rho: Array
    length: Array


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What (17) and (18) need of the robot at one state.

    Attributes:
        tips: Fingertips and their Jacobians.
        M: (24, 24) mass matrix of the driven joints, `S^T M_r S`, with the drives' reflected inertia [kg.m2].
        bias: (24,) `S^T (C_r v + N)`, Coriolis, centrifugal and gravity torques at the drives [N.m].
        J_palm: (6, 28) Jacobian of the palm's origin, linear first, in W.
        Jdot_v: (5, 6) what the fingertips' frames accelerate by while no joint does, in W, linear first [m/s2, rad/s2].
    """

    tips: Fingertips
    M: Array
    bias: Array
    J_palm: Array
    Jdot_v: Array


def robot_spec() -> mujoco.MjSpec:
    """Arm and hand on the base, without actuators, tool or screw; joints in the order of `JOINTS`."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    base = spec.worldbody.add_body(name="base", pos=[0, 0, BASE_HEIGHT])
    attach_hand(spec, add_arm(base))
    return spec


class RobotModel:
    """M, C, N, J and Jdot of arm and hand, (17) and (18), by MuJoCo's own algorithms.

    Attributes:
        limits: (28, 2) joint ranges [rad].
        torque_limits: (28,) peak drive torques [N.m]; a coupled J1 has none of its own.
        damping: (28,) viscous damping of the joints [N.m.s/rad].
    """

    def __init__(self) -> None:
        self._model = robot_spec().compile()
        check_joint_order(self._model)
        self._data = mujoco.MjData(self._model)
        self._bodies = [self._model.body(name).id for name in _TIP_BODIES]
        self._followed = np.array([*self._bodies, self._model.body("palm").id])
        self._moves = np.array([_moved_by(self._model, body) for body in self._followed])
        # views of the simulator's memory, which it fills anew each time, and room for more of what it works out
        self._qpos, self._qvel = self._data.qpos, self._data.qvel
        self._xpos, self._xmat = self._data.xpos, self._data.xmat
        self._axes, self._axes_rate = self._data.cdof, self._data.cdof_dot
        self._com = self._data.subtree_com[self._model.body_rootid[self._followed[-1]]]
        self._M, self._bias = np.empty((len(JOINTS), len(JOINTS))), np.empty(len(JOINTS))
        capsules = [self._model.geom(f"C_{name}") for name in _TIP_BODIES]
        half = np.array([float(capsule.size[1]) for capsule in capsules])
        self._length = 2.0 * half
        self._offset = half + np.array([float(capsule.pos[2]) for capsule in capsules])
        self.rho = np.array([TIP_RADIUS[finger] for finger in FINGERS])
        self.limits = self._model.jnt_range[: len(JOINTS)].copy()
        self.damping = self._model.dof_damping[: len(JOINTS)].copy()
        self._dynamics: tuple[Array, Array, Dynamics] | None = None
        self._contacts: tuple[Dynamics, Array, Array] | None = None
        self.torque_limits = np.array(
            [*(link.torque for link in LINKS), *(0.0 if n in COUPLED else torque_limit(n) for n in JOINTS[len(ARM) :])]
        )

    def _place(self, q: Array) -> None:
        self._qpos[:] = q
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)

    def fingertips(self, q: Array) -> Fingertips:
        """Fingertip frames and Jacobians at joint angles q (28,) [rad]."""
        self._place(q)
        return self._tips()

    def _tips(self) -> Fingertips:
        p_W, R = self._points()
        return Fingertips(p_W[:-1], R, self._jacobians(p_W)[:-1], self.rho, self._length)

    def _points(self) -> tuple[Array, Array]:
        """Origins (6, 3) of the fingertips' frames and of the palm's, in W [m], and R_WF (5, 3, 3)."""
        return tip_frames(self._xpos, self._xmat, self._followed, self._offset)

    def _jacobians(self, p_W: Array) -> Array:
        """Jacobians (6, 6, 28) of the fingertips' frames and the palm's."""
        return point_jacobians(p_W, self._moves, self._axes, self._com)

    def palm(self, q: Array) -> tuple[Array, Array]:
        """Palm frame H at joint angles q (28,): p_WH (3,) [m] and R_WH (3, 3)."""
        self._place(q)
        palm = self._followed[-1]
        return self._xpos[palm].copy(), self._xmat[palm].reshape(3, 3).copy()

    def palm_jacobian(self, q: Array) -> Array:
        """Jacobian (6, 28) of H's origin, linear first, in W."""
        self._place(q)
        J = np.empty((6, len(JOINTS)))
        body = self._model.body("palm").id
        mujoco.mj_jacBody(self._model, self._data, J[:3], J[3:], body)
        return J

    def point_jacobian_rate(self, q: Array, v: Array, finger: str, p_W: Array) -> Array:
        """Time derivative (3, 28) of the linear Jacobian of a point fixed to a fingertip, for (17).

        Args:
            q: (28,) [rad].
            v: (28,) [rad/s].
            finger: Which fingertip.
            p_W: (3,) the point in W [m].
        """
        self._place(q)
        self._data.qvel[:] = v
        mujoco.mj_comVel(self._model, self._data)
        Jdot = np.empty((3, len(JOINTS)))
        body = self._bodies[FINGERS.index(finger)]
        mujoco.mj_jacDot(self._model, self._data, Jdot, None, p_W, body)
        return Jdot

    def dynamics(self, q: Array, v: Array) -> Dynamics:
        """Kinematics and dynamics at joint angles q (28,) [rad] and speeds v (28,) [rad/s], in one pass.

        Asked for the same two arrays again, it gives the same answer without work: servo and actuation of one tick
        share it.  So neither array may be changed in place.
        """
        if self._dynamics is not None and self._dynamics[0] is q and self._dynamics[1] is v:
            return self._dynamics[2]
        model, data = self._model, self._data
        self._place(q)
        self._qvel[:] = v
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_fullM(model, data, self._M)
        mujoco.mj_rne(model, data, 0, self._bias)
        p_W, R, J, Jdot_v, M, bias = motion_table(
            self._xpos, self._xmat, self._followed, self._offset, self._moves, self._axes, self._axes_rate, self._com,
            v, self._M, self._bias, DRIVE_OF_JOINT, len(DRIVEN),
        )  # fmt: skip
        tips = Fingertips(p_W[:-1], R, J[:-1], self.rho, self._length)
        result = Dynamics(tips, M, bias, J[-1], Jdot_v[:-1])
        self._dynamics = q, v, result
        return result

    def contact_jacobians(self, q: Array, v: Array, c_W: Array) -> Array:
        """`contact_jacobians` (5, 3, 24) of all fingertips at contacts c_W (5, 3) [m]; kept as `dynamics` is."""
        dynamics = self.dynamics(q, v)
        if self._contacts is None or self._contacts[0] is not dynamics or self._contacts[1] is not c_W:
            self._contacts = dynamics, c_W, contact_jacobians(dynamics.tips, c_W)
        return self._contacts[2]

    def mass_matrix(self, q: Array) -> Array:
        """M_r (28, 28) of (18) with the drives' reflected inertia [kg.m2]."""
        self._data.qpos[:] = q
        mujoco.mj_fwdPosition(self._model, self._data)
        M = np.empty((len(JOINTS), len(JOINTS)))
        mujoco.mj_fullM(self._model, self._data, M)
        return M

    def bias(self, q: Array, v: Array) -> Array:
        """C_r v + N (28,) of (18): Coriolis, centrifugal and gravity torques [N.m]."""
        self._place(q)
        self._data.qvel[:] = v
        mujoco.mj_comVel(self._model, self._data)
        torque = np.empty(len(JOINTS))
        mujoco.mj_rne(self._model, self._data, 0, torque)
        return torque

    def coriolis(self, q: Array, v: Array) -> Array:
        """C_r v (28,) of (18): Coriolis and centrifugal torques [N.m]."""
        return self.bias(q, v) - self.gravity(q)

    def inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        """M_r a + C_r v + N + D v (28,) of (18): torques of a motion in which nothing touches the robot [N.m].

        D is the joints' damping.  Their dry friction of .001 N.m is left out: it is 15 mN at a fingertip.

        Args:
            q: (28,) [rad].
            v: (28,) [rad/s].
            a: (28,) accelerations [rad/s2].
        """
        self._place(q)
        self._data.qvel[:], self._data.qacc[:] = v, a
        mujoco.mj_comVel(self._model, self._data)
        torque = np.empty(len(JOINTS))
        mujoco.mj_rne(self._model, self._data, 1, torque)
        # the recursion knows links only: the drives' reflected inertia and the damping act in the joints
        return np.asarray(torque + self._model.dof_armature * a + self._model.dof_damping * v)

    def gravity(self, q: Array) -> Array:
        """N (28,) of (18): torques that hold the robot against gravity [N.m]."""
        return self.bias(q, np.zeros(len(JOINTS)))


def _moved_by(model: mujoco.MjModel, body: int) -> Flags:
    """Which joints (28,) move a body: its own and those of the bodies it hangs from."""
    moved = np.zeros(len(JOINTS), dtype=bool)
    while body:
        first = model.body_dofadr[body]
        if first >= 0:
            moved[first : first + model.body_dofnum[body]] = True
        body = model.body_parentid[body]
    return moved


def driven_jacobian(J: Array) -> Array:
    """Adds each coupled joint's columns to its leader's and zeroes them, on the last axis of J (..., 28)."""
    J = J.copy()
    for follower, leader in COUPLED.items():
        J[..., INDEX[leader]] += J[..., INDEX[follower]]
        J[..., INDEX[follower]] = 0.0
    return J
