"""A grasp that holds the tool in the simulated cell and puts on the torque that is asked of it.

The loop is that of a run by torques: (8)-(11), contact forces, (17) and (18).  But it is told the truth, and it does
not hold the tool's yaw: the torque about the axis is what is asked for, and nothing else.  So what is measured is what
the grasp can give, not what sensors or a stroke do to it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from turnscrew.actuate.torque import TorqueAdapter
from turnscrew.contact.envelope import Hold, Verdict, surest_forces
from turnscrew.control.optimal_distribution import OptimalDistribution, Shared
from turnscrew.control.servo import HybridServo, ServoState, torque_servo
from turnscrew.decide.gait import Gait
from turnscrew.decide.plan import GaitPlan
from turnscrew.estimate.handle_contacts import handle_contacts
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.euler import euler_from_matrix
from turnscrew.geometry.rotations import exp_so3
from turnscrew.plant.cell import Cell
from turnscrew.plant.truth import Truth
from turnscrew.robot.joints import FINGERS, JOINTS
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Effort, Estimate, Goal, Role
from turnscrew.task.envelope import Conditions, Grip, conditions, handle_of, hold_of
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.start import TIP_LIFT, Start
from turnscrew.task.wiring import believed_inertia, build_cell, slot_play

STIFFNESS = 5.0
"""Of the thread, elastic [N.m/rad]: the screw turns by 3 deg at .25 N.m, so a grasp hardly rolls meanwhile; with the
screw's and the tool's inertia it is a vibration of 500 rad/s, well sampled at 1 kHz."""

NOSLIP = 30
"""Passes of MuJoCo's second friction solver.  With a run's three, fingertips creep with the load, well inside their
cones: four of them by 1 mm in 2 s at .3 N.m, which no friction law has; with thirty by .05 mm."""

BEAT = 0.002
"""Period of servo and torques [s], as in a run."""

REFRESH, EASE = 0.01, 0.03
"""Period at which the surest forces are worked out, and time constant of going over to them [s]: the program's answer
may jump from corner to corner."""

SIDES = 32
"""Faces of the friction pyramids of the distribution that the surest forces lead."""


BEYOND, LOOSE = 1.2, 1e-4
"""What the distribution, led by the surest forces, counts on of the friction, and its price of other forces than the
wanted squeeze, a hundredth of the usual."""


ASIDE = np.array([True, True, False, True, True, False])
"""What of the tip's wrench a run wants to be nothing, and the surest forces have as they need it."""


class Forces(StrEnum):
    """Who chooses the contact forces."""

    SUREST = "surest"
    """The program that keeps all contacts as far inside their cones as it can."""
    CONTROLLER = "controller"
    """The distribution of a run, told the true friction: it keeps its margin, and wants no side force of the slot."""


@dataclass(frozen=True, slots=True)
class Case:
    """A grasp under a rising torque.

    Attributes:
        scenario: Tool, friction, robot.
        plan: Of the handle.
        grip: Which grasp.
        fraction: Of the stroke.
        most: Largest squeeze of a finger [N].
        forces: Who chooses them.
    """

    scenario: Scenario
    plan: GaitPlan
    grip: Grip
    fraction: float
    most: float
    forces: Forces = Forces.SUREST


class Bench:
    """The cell with a grasp in it, and a loop that is told the truth.

    Attributes:
        cell: The plant.
    """

    def __init__(self, case: Case) -> None:
        """Puts the fingers on the handle as planned; the blade stands at the wall that it will turn."""
        plan, scenario = case.plan, case.scenario
        angle = case.fraction * plan.stroke
        play = slot_play(scenario.tool.blade_width, scenario.tool.blade_thickness, scenario.screw.slot_width)
        thread = scenario.screw.thread.model_copy(update={"law": "elastic", "stiffness": STIFFNESS})
        screw = scenario.screw.model_copy(update={"thread": thread, "slot_yaw": play / 2 - angle})
        contact = scenario.contact.model_copy(update={"passes": NOSLIP})
        scenario = scenario.model_copy(update={"screw": screw, "contact": contact})
        self._case, self._plan = case, plan
        self._q = posture(plan, case.grip, case.fraction)
        R_WT = plan.R_WT @ exp_so3(np.array([0.0, 0.0, -angle]))
        start = Start(self._q, plan.p_WS, plan.p_WS + np.array([0.0, 0.0, TIP_LIFT]), R_WT, plan.radius)
        self.cell: Cell = build_cell(scenario, start, plan)
        self._robot = RobotModel()
        self._under: Conditions = conditions(scenario, case.most)
        self._rows = [FINGERS.index(finger) for finger in case.grip.fingers]
        self._servo: HybridServo = torque_servo(believed_inertia(scenario, plan.radius), screw.pitch)
        self._adapter = TorqueAdapter(self._robot)
        self._sharing = sharing_of(case, self._robot, self._under.friction)
        first = self.estimate(self.cell.truth())
        self._state = self._servo.init(first)
        self._posture = self._adapter.init(first.q)
        self._shared: Shared = self._sharing.init()
        self._surest, self._possible, self._due = np.zeros((5, 3)), 0.0, 0.0
        self._f_W, self._aside, self._beside = np.zeros((5, 3)), np.zeros(6), np.zeros(6)

    def beat(self, truth: Truth, asked: float) -> Estimate:
        """Servo, contact forces and torques for a torque on the screw [N.m], written to the plant."""
        estimate = self.estimate(truth, asked)
        goal = self._goal()
        self._state, nu_d, F_hd = self._servo.update(self._freed(estimate), goal, estimate, BEAT)
        if self._case.forces is Forces.SUREST:
            # the distribution keeps as near as the wrench lets it to the forces it has been told of
            self._shared = replace(self._shared, f_W=self._surely(estimate, asked))
            F_hd = F_hd - self._beside
        self._shared, wanted = self._sharing.update(self._shared, goal, estimate, F_hd, BEAT)
        effort = Effort(nu_d, wanted.f_W, F_hd, self._state.alpha)
        self._posture, command = self._adapter.update(self._posture, goal, effort, estimate, BEAT)
        if command.tau is not None:
            self.cell.write(command.tau)
        return estimate

    def estimate(self, truth: Truth, asked: float = 0.0) -> Estimate:
        """The truth as the loop's message; the torque that is to be overcome is the one asked for."""
        q, v = self.cell.q, np.array(self.cell.data.qvel[: len(JOINTS)])
        tips = self._robot.dynamics(q, v).tips
        found = handle_contacts(*handle_of(self._plan, tips), tips, truth.p_WT, truth.R_WT)
        R = truth.R_WT
        none = np.full(3, np.nan)
        return Estimate(
            time=self.cell.time, q=q, v=v, offset=np.zeros(len(JOINTS)), p_WT=truth.p_WT, R_WT=R,
            nu=np.concatenate([R.T @ truth.V_WT[:3], R.T @ truth.V_WT[3:]]), radius=self._plan.radius,
            p_WS=truth.p_WS, theta=truth.theta, touching=truth.touching, f_W=truth.f_W, c_W=found.c_W, n_W=found.n_W,
            gap=found.gap, F_s=np.array([0.0, 0.0, Gait.tip_force, 0.0, 0.0, asked]), stiffness=STIFFNESS,
            tip_slip=0.0, finger_slip=np.zeros(len(FINGERS)), grip=np.ones(len(FINGERS)),
            hung=np.zeros(len(FINGERS), dtype=bool), P=np.zeros((6, 6)),
            frame="none", status="filter", p_WT_seen=none, R_WT_seen=np.eye(3), p_WT_refined=none,
            R_WT_refined=np.eye(3),
        )  # fmt: skip

    def hold(self, estimate: Estimate) -> Hold:
        """The grasp as it stands, for the programs of statics."""
        q, p_WT, R_WT, c_W, n_W = estimate.q, estimate.p_WT, estimate.R_WT, estimate.c_W, estimate.n_W
        return hold_of(self._robot, q, p_WT, R_WT, c_W, n_W, self._under, self._case.grip.fingers)

    def _surely(self, estimate: Estimate, asked: float) -> Array:
        """The surest forces (5, 3) [N]; of a torque that no forces give, those of the last that some did, grown."""
        if self.cell.time >= self._due:
            self._due += REFRESH
            found = surest_forces(self.hold(estimate), asked)
            if found.verdict is Verdict.SOLVED:
                self._surest[self._rows], self._possible = found.f_W, asked
                self._aside = np.where(ASIDE, found.F_s, 0.0)
            elif self._possible > 0.0:
                self._surest, self._possible = self._surest * (asked / self._possible), asked
        self._f_W = self._f_W + BEAT / EASE * (self._surest - self._f_W)
        self._beside = self._beside + BEAT / EASE * (self._aside - self._beside)
        return self._f_W

    def _freed(self, estimate: Estimate) -> ServoState:
        integral = self._state.integral * [1.0, 1.0, 0.0]
        return replace(self._state, yaw_d=float(euler_from_matrix(estimate.R_WT)[2]), integral=integral)

    def _goal(self) -> Goal:
        """The grasp holds, all other fingers stay."""
        roles = np.full(len(FINGERS), Role.FREE)
        roles[self._rows] = Role.GRIP
        share = np.where(roles == Role.GRIP, 1.0, 0.0)
        return Goal(
            phase="hold", round=0, vain=0, roles=roles, share=share, squeeze=Gait.squeeze * share,
            approach=np.zeros((5, 3)), q_free=self._q, q_guide=self._q, turn_rate=0.0, tip_force=Gait.tip_force,
            V_palm=np.zeros(6),
        )  # fmt: skip


def sharing_of(case: Case, robot: RobotModel, friction: float) -> OptimalDistribution:
    """The distribution of a run, told the true friction, with all of the drives' torque and the case's squeeze.

    Led by the surest forces it keeps no margins and may count on more friction than there is: it is the plant that says
    where friction ends.
    """
    if case.forces is Forces.CONTROLLER:
        return OptimalDistribution(robot, friction, most=case.most, torque=1.0)
    led = OptimalDistribution(
        robot, BEYOND * friction, margin=0.0, doubt=0.0, most=case.most, most_reflex=0.0, torque=1.0
    )
    return replace(led, sharing=replace(led.sharing, sides=SIDES, rest=LOOSE))


def posture(plan: GaitPlan, grip: Grip, fraction: float) -> Array:
    """Joint angles (28,) of a grasp at a fraction of the stroke, all other fingers off the handle."""
    if grip is Grip.ROLLING:
        return plan.rolling(fraction)
    return plan.relocating(1.0 - fraction) if grip is Grip.HOLDING else plan.adding(1.0, rolled=fraction)
