"""Forces put on fingertips in MuJoCo and read back from the servos' torques."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from rigs.cells import PLAN

from turnscrew.actuate.position import DRIVEN_INDEX
from turnscrew.estimate.finger_force import ForceFromTorque, normals
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import DRIVEN, FINGERS, INDEX, JOINTS
from turnscrew.robot.model import Fingertips, RobotModel, robot_spec
from turnscrew.robot.servos import STIFFNESSES, add_servos
from turnscrew.sense.encoders import Encoders

ROBOT = RobotModel()
Q = PLAN.rolling(0.0)
# the plan leaves the little finger straight, next to its stops, against which a push would lean
Q[[INDEX[name] for name in ("LFJ5", "LFJ4", "LFJ3", "LFJ2", "LFJ1")]] = 0.3, 0.0, 0.5, 0.5, 0.5
EXACT = ForceFromTorque(ROBOT, gauge_floor=0.0, gauge_share=0.0, model_floor=1e-4)
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

    def tick(self, f_F: Array) -> Array:
        """Ten steps with the fingertips pressing with f_F (5, 3); the mean torques (24,) of the drives."""
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
        return torque / STEPS


def presses(rig: Rig) -> Array:
    """Forces (5, 3) in F: 4 N along the normal, 1 N across."""
    tips, points = rig.pads()
    n = (normals(tips, points)[:, None, :] @ tips.R_WF)[:, 0]
    return 4.0 * n + [1.0, 0.0, 0.0]


def settled(rig: Rig, f_F: Array) -> Array:
    """The estimate (5, 3) after the finger has come to rest."""
    for _ in range(60):
        tau = rig.tick(f_F)
    tips, points = rig.pads()
    return EXACT.update(EXACT.init(), tau, rig.q, np.zeros(len(JOINTS)), tips, points, 0.01)[1]


def test_a_static_force_on_each_fingertip_is_read_from_the_torques() -> None:
    rig = Rig()
    f_F = presses(rig)
    # the prior's share of a doubt of 1e-4 N.m over 10 mm: (.01 N / 3 N)^2 of 5 N; and what has not settled in .6 s
    np.testing.assert_allclose(settled(rig, f_F), f_F, atol=1e-4)


def test_dry_friction_costs_what_it_can() -> None:
    rig = Rig(friction=0.001)
    f_F = presses(rig)
    # .001 N.m over the least lever of a pad's point in this posture, 10 mm
    np.testing.assert_allclose(settled(rig, f_F), f_F, atol=0.1)


def swing(lag: float, f_F: Array) -> tuple[Array, float]:
    """Errors (ticks, 5) of the estimate while all fingers swing by 3.4 deg at 3 Hz, and their highest speed."""
    rig = Rig()
    block = ForceFromTorque(ROBOT, gauge_floor=0.0, gauge_share=0.0, model_floor=1e-4, lag=lag)
    state, sensor = block.init(), Encoders(noise=np.zeros(len(JOINTS)), offset_sigma=np.zeros(len(JOINTS)))
    reading = sensor.init(np.random.default_rng(0))
    moves = np.array([name not in ("WAMJ1", "WAMJ2", "WAMJ3", "WAMJ4", "WRJ2", "WRJ1") for name in DRIVEN])
    errors, fastest = [], 0.0
    for k in range(150):
        rig.data.ctrl[:] = rig.rest + moves * 0.06 * np.sin(6.0 * np.pi * 0.01 * k)
        tau = rig.tick(f_F)
        reading, (q, v) = sensor.update(reading, rig.q, rig.data.time)
        tips, points = rig.pads()
        state, f = block.update(state, tau, q, v, tips, points, 0.01)
        if k > 50:
            errors.append(np.linalg.norm(f - f_F, axis=1))
            fastest = max(fastest, float(np.abs(v).max()))
    return np.array(errors), fastest


def test_a_moving_finger_presses_with_no_more_than_it_does() -> None:
    f_F = presses(Rig())
    errors, fastest = swing(EXACT.lag, f_F)
    assert fastest > 0.8
    # a steady force, so the low-pass costs nothing; the acceleration's own lag of 15 ms at 3 Hz is .3 of an inertia
    # torque of .001 kg.m2 x 20 rad/s2, so 6 mN.m on levers of 15 to 70 mm
    assert np.sqrt(np.mean(errors**2)) < 0.3
    # without the torques' low-pass to match the speeds', damping of .1 N.m.s/rad is felt 20 ms late
    unmatched, _ = swing(1e-6, f_F)
    assert np.sqrt(np.mean(unmatched**2)) > 2.0 * np.sqrt(np.mean(errors**2))


def test_names_of_the_drives_are_the_joints() -> None:
    assert [INDEX[name] for name in DRIVEN] == DRIVEN_INDEX.tolist()
