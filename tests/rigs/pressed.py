"""The robot alone in MuJoCo, under its servos, with forces put on its fingertips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np
from rigs.cells import PLAN

from turnscrew.actuate.position import DRIVEN_INDEX
from turnscrew.estimate.finger_force import normals
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import DRIVEN, FINGERS, INDEX, JOINTS
from turnscrew.robot.model import Fingertips, RobotModel, robot_spec
from turnscrew.robot.servos import STIFFNESSES, add_servos

ROBOT = RobotModel()
Q = PLAN.rolling(0.0)
# the plan leaves the little finger straight, next to its stops, against which a push would lean
Q[[INDEX[name] for name in ("LFJ5", "LFJ4", "LFJ3", "LFJ2", "LFJ1")]] = 0.3, 0.0, 0.5, 0.5, 0.5
STEPS = 10


def model(friction: float) -> mujoco.MjModel:
    """The robot alone, in free air."""
    spec = robot_spec()
    spec.option.timestep = 0.001
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    add_servos(spec)
    compiled = spec.compile()
    compiled.dof_frictionloss[:] = friction
    return compiled


@dataclass
class Rig:
    """The robot under its servos, with forces on its fingertips."""

    friction: float = 0.0
    model: mujoco.MjModel = field(init=False)
    data: mujoco.MjData = field(init=False)

    def __post_init__(self) -> None:
        self.model = model(self.friction)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = Q
        self.bodies = [self.model.body(f"{finger.lower()}distal").id for finger in FINGERS]
        bend = ROBOT.gravity(Q)[DRIVEN_INDEX] / STIFFNESSES
        self.rest = Q[DRIVEN_INDEX] + bend
        self.data.ctrl[:] = self.rest

    @property
    def q(self) -> Array:
        return np.array(self.data.qpos[: len(JOINTS)])

    def pads(self) -> tuple[Fingertips, Array]:
        """Fingertips and the points (5, 3) in the middle of their pads, 40 deg off their axes."""
        tips = ROBOT.fingertips(self.q)
        out = np.cos(0.7) * tips.R_WF[:, :, 2] - np.sin(0.7) * tips.R_WF[:, :, 1]
        return tips, tips.p_WF + tips.rho[:, None] * out

    def tick(self, f_F: Array, watch: Callable[[Array], None] | None = None) -> Array:
        """Ten steps with the fingertips pressing with f_F (5, 3); the mean torques (24,) of the drives.

        `watch` is told the torques of each step, after it.
        """
        torque = np.zeros(len(DRIVEN))
        for _ in range(STEPS):
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            tips, points = self.pads()
            for row, body in enumerate(self.bodies):
                reaction = -tips.R_WF[row] @ f_F[row]
                self.data.xfrc_applied[body, :3] = reaction
                self.data.xfrc_applied[body, 3:] = np.cross(points[row] - self.data.xipos[body], reaction)
            mujoco.mj_step(self.model, self.data)
            torque += self.data.actuator_force
            if watch is not None:
                watch(np.array(self.data.actuator_force))
        return torque / STEPS


def presses(rig: Rig) -> Array:
    """Forces (5, 3) in F: 4 N along the normal, 1 N across."""
    tips, points = rig.pads()
    n = (normals(tips, points)[:, None, :] @ tips.R_WF)[:, 0]
    return 4.0 * n + [1.0, 0.0, 0.0]
