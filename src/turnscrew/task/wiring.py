"""From a scenario to the blocks of the loop: the one place where a key becomes a parameter."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from turnscrew.actuate.position import PositionAdapter
from turnscrew.actuate.sprung import SprungAdapter
from turnscrew.actuate.torque import TorqueAdapter
from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.control.controller import Controller
from turnscrew.control.distribution import Distribution
from turnscrew.control.optimal_distribution import OptimalDistribution
from turnscrew.control.servo import HybridServo, torque_servo
from turnscrew.decide.gait import Gait
from turnscrew.decide.placing import Placing
from turnscrew.decide.plan import GaitPlan
from turnscrew.decide.recovery import Decider
from turnscrew.decide.stroke_budget import LEAST, StrokeBudget, pinch_torque
from turnscrew.estimate.between_ticks import BetweenTicks
from turnscrew.estimate.blade_play import BladePlay
from turnscrew.estimate.contacts import TouchDetector
from turnscrew.estimate.driven_force import DrivenForce
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.filter_state import Prior
from turnscrew.estimate.finger_force import ForceFromTorque
from turnscrew.estimate.finger_slip import FingerSlip
from turnscrew.estimate.free_tip import FreeTip
from turnscrew.estimate.joint_smoothing import JointSmoother
from turnscrew.estimate.pose_ipopt import IpoptSolver
from turnscrew.estimate.pose_refine import PoseRefiner
from turnscrew.estimate.pose_solution import PoseSolver
from turnscrew.estimate.pose_sqp import SqpSolver
from turnscrew.estimate.reference import Reference
from turnscrew.estimate.screw_angle import ScrewAngle
from turnscrew.estimate.second_look import SecondLook
from turnscrew.estimate.slips import Slips
from turnscrew.estimate.tip_motion import TipMotion
from turnscrew.estimate.tip_out import TipOut
from turnscrew.estimate.tip_slip import TipSlip
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.geometry.profiles import Cylinder
from turnscrew.plant.cell import Cell, CellDescription
from turnscrew.plant.contact import Friction
from turnscrew.plant.screw import Screw
from turnscrew.plant.thread import Thread
from turnscrew.plant.tool import Tool
from turnscrew.robot.model import RobotModel
from turnscrew.sense.encoders import Encoders, finger_offset_sigma, reading_sigma
from turnscrew.sense.fingertip_force import FingertipForce
from turnscrew.sense.sensors import Sensors
from turnscrew.sense.strain_gauges import StrainGauges
from turnscrew.sense.vision import NoisyTruthVision
from turnscrew.task.camera_wiring import build_marker_camera, build_markers, build_scene_camera
from turnscrew.task.reseat_wiring import build_reseat
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.start import Start

COMMON, COMMON_TIME = 0.5, 0.06
"""Share of a marker camera's variance that neighbouring frames share, and for how long [s]: in two runs the errors of
neighbours correlated by .3, of the next ones by .17, which this gives."""

GAUGED_TOUCH = TouchDetector(on=1.2, off=0.7, time=0.015)
"""Touches by strain gauges: a free finger that moves reads up to 1 N, since a seventh of its damping torque goes
unseen; with thresholds of .8 and .5 N a guarded approach stops in free air in two of eight runs."""

GAUGED_SLIP = TipSlip(noise=0.15, force_walk=0.3, torque_walk=0.03, jump_error=0.15, quiet=0.12)
"""Slips by strain gauges, whose forces also hold what moving fingers leave, and come 25 ms late: fingers that let go
shake them twice as long.  Found by trial: five runs of five rounds stay below four tenths of an alarm; with the .06 s
of fingertip sensors each of them raises one."""

FELT = math.radians(40.0)
"""Error of the fingertip forces' directions up to which the axial force tells of a lost tip [rad]: a squeeze of 8 N
read that much askew looks like the 5 N that the tip is pressed with."""

FRAMES_KEPT = 3
"""Frames of a usual camera over which odometry is kept at least."""

THROUGH = JointSmoother(arm=1e-6, wrist=1e-6, finger=1e-6)
"""Hands readings on as they are: a robot that takes torques has smoothed them already, at its faster pace."""

SUPPORT_SPEED = 0.35
"""Turning speed while FF and RF hold the handle, for a robot that takes torques [rad/s]: 6 deg in .4 s.  In forty
trials no finger met another's, while fingers that felt before they had come to rest did so in one run of ten."""

DRIVEN_SIZE, DRIVEN_DIRECTION = 0.1, 0.01
"""Errors of forces that follow from the torques sent, as shares of a force and as an angle that lasts [rad].  Of forces
that hold the handle they err by 5 to 10 % in the median; what part of that is across the force changes with the
posture within a phase, so there is no angle to be learned."""

OPPOSING = float(np.radians(5.0))
"""By how much FF and RF may be placed nearer to opposite than planned, for a robot that takes torques [rad]: half of
what plans may leave to opposite (`Requirements.hold_opposition`).  Position servos hold the handle against what is
missing; torques leave it to friction."""

LEARNING = FingerSlip(again=0.8, askew=0.02)
"""Slides of a robot that takes torques.  Its fingers slide away once friction gives way, where position servos stay:
after a slide they are never trusted more than with eight tenths of what they slid at.  And it rolls at up to 4.5 rad/s,
12 mm within the detector's memory; in first rolls, when axis and joints are believed askew by up to a degree, some of
that was taken for a slide in three runs of forty."""

STROKE_SQUEEZE = 10.0
"""Squeeze of thumb and middle finger in one long stroke, before the load asks for more [N]: they do not have to hand
over, and slide less the farther they are from the end of their friction."""


@dataclass(frozen=True)
class Blocks:
    """The loop's blocks and their parameters."""

    sensors: Sensors
    estimator: ToolEstimator
    decider: Decider
    controller: Controller
    adapter: PositionAdapter | SprungAdapter
    between: BetweenTicks | None = None


def build_cell(scenario: Scenario, start: Start, plan: GaitPlan) -> Cell:
    """The plant; its camera, if there is one, is aimed at where the tool is planned to be."""
    tool, screw, thread = scenario.tool, scenario.screw, scenario.screw.thread
    description = CellDescription(
        tool=Tool(
            radius=tool.handle.radius, length=tool.handle.length, middle=tool.contact_height, mass=tool.mass,
            shaft_radius=tool.shaft_radius, blade=(tool.blade_width, tool.blade_thickness),
            markers=build_markers(scenario),
        ),
        screw=Screw(screw.pitch, screw.slot_width, screw.slot_length, screw.slot_depth, screw.head_radius),
        thread=Thread(
            thread.law, thread.stiffness, thread.prevailing_torque, thread.seat_angle, thread.seat_torque
        ),
        friction=Friction(scenario.contact.finger_friction, scenario.contact.tip_friction),
        p_WS=start.p_WS,
        slot_yaw=scenario.screw.slot_yaw,
        timestep=1.0 / scenario.rate.plant,
        # the scenario says by how much the model is wrong; here the plant is what differs
        mass_error=1.0 / (1.0 + scenario.model.mass_error) - 1.0,
        camera=build_scene_camera(scenario, plan.p_WS),
        passes=scenario.contact.passes,
        motors=scenario.robot.actuation == "torque",
        patience=scenario.patience,
    )  # fmt: skip
    return Cell(description, start.q, start.p_WT, start.R_WT)


def build_blocks(scenario: Scenario, plan: GaitPlan, robot: RobotModel, believed_radius: float) -> Blocks:
    """The loop's blocks, told what the robot is told."""
    inertia = believed_inertia(scenario, believed_radius)
    torque = scenario.robot.actuation == "torque"
    placing = Placing(robot, plan, opposing=OPPOSING if torque else 0.0)
    gait = Gait(plan, placing, scenario.speed.turning, recentre=scenario.control.recentre)
    if torque:
        gait = replace(gait, support_speed=SUPPORT_SPEED)
    if scenario.goal.course == "stroke":
        gait = replace(gait, squeeze=STROKE_SQUEEZE)
    elif scenario.goal.rounds is not None:
        gait = replace(gait, budget=build_budget(scenario, scenario.goal.rounds, believed_radius, gait))
    return Blocks(
        sensors=build_sensors(scenario, plan),
        estimator=build_estimator(scenario, plan, robot, inertia, believed_radius),
        decider=Decider(gait.faster(scenario.speed.gait), build_reseat(scenario, plan, robot)),
        controller=build_controller(scenario, robot, inertia),
        adapter=build_adapter(scenario, robot),
        between=BetweenTicks(robot, scenario.screw.pitch) if torque else None,
    )


def build_adapter(scenario: Scenario, robot: RobotModel) -> PositionAdapter | SprungAdapter:
    """What makes commands of what the contacts are to do, by what the robot accepts."""
    positions = PositionAdapter(robot)
    if scenario.robot.actuation == "position":
        return positions
    return SprungAdapter(TorqueAdapter(robot, scenario.control.palm_weight), positions, 1.0 / scenario.rate.control)


def build_budget(scenario: Scenario, rounds: int, radius: float, gait: Gait) -> StrokeBudget:
    """What thumb and middle finger hold for long, with the friction that is counted on, for the rounds wanted."""
    friction = scenario.control.friction_used * believed_friction(scenario)
    torque = pinch_torque(radius, friction, Distribution.most, gait.tip_force)
    return StrokeBudget(rounds, torque, LEAST - gait.passed_on)


def build_controller(scenario: Scenario, robot: RobotModel, inertia: ToolInertia) -> Controller:
    """Servo and distribution for what the robot accepts."""
    friction = scenario.control.friction_used * believed_friction(scenario)
    if scenario.robot.actuation == "position":
        sharing = Distribution(friction, fixed=scenario.control.squeeze)
        return Controller(HybridServo(inertia, scenario.screw.pitch), sharing)
    servo = torque_servo(inertia, scenario.screw.pitch, scenario.control.frequency, scenario.control.damping)
    if scenario.control.forces == "null-space":
        # torques press as told: there is nothing to make up for by an integral, and no posture that would be bent away
        most = scenario.control.largest_squeeze
        sharing = Distribution(friction, most=most, rate=0.0, fixed=scenario.control.squeeze)
        return Controller(servo, sharing, Distribution(friction))
    most, expected = scenario.control.largest_squeeze, believed_friction(scenario)
    return Controller(servo, OptimalDistribution(robot, friction, expected, most=most), Distribution(friction))


def build_sensors(scenario: Scenario, plan: GaitPlan) -> Sensors:
    """Simulated sensors."""
    sense, vision = scenario.sense, scenario.vision
    return Sensors(
        encoders=Encoders(
            reading_sigma(sense.encoder_noise, sense.arm_encoder_noise), finger_offset_sigma(sense.joint_offset)
        ),
        force=build_gauges(scenario)
        if scenario.force.source == "strain"
        else FingertipForce(scenario.force.noise, scenario.force.direction_noise),
        camera=build_marker_camera(scenario, plan.p_WS)
        if vision.source == "rendered"
        else NoisyTruthVision(
            vision.rate, vision.position_noise, vision.rotation_noise, vision.latency, vision.dropout
        ),
    )


def build_gauges(scenario: Scenario) -> StrainGauges:
    """The strain gauges of the hand's drives."""
    gauges = scenario.force.gauges
    return StrainGauges(
        gain_error=gauges.gain_error,
        offset=gauges.offset,
        hysteresis=gauges.hysteresis,
        drift=gauges.drift,
        noise=gauges.noise,
        loads=gauges.loads,
        load_accuracy=gauges.load_accuracy,
    )


def build_forces(scenario: Scenario, robot: RobotModel) -> tuple[ForceFromTorque | None, TouchDetector]:
    """How fingertip forces become known, and when one counts as a touch."""
    if scenario.force.source == "tip":
        return None, TouchDetector()
    floor, share = build_gauges(scenario).doubt()
    return ForceFromTorque(robot, gauge_floor=floor, gauge_share=share), GAUGED_TOUCH


def build_estimator(
    scenario: Scenario, plan: GaitPlan, robot: RobotModel, inertia: ToolInertia, believed_radius: float
) -> ToolEstimator:
    """The estimator, with handle and screw as believed."""
    tool = scenario.tool
    half = tool.handle.length / 2
    forces, touch = build_forces(scenario, robot)
    torque = scenario.robot.actuation == "torque"
    return ToolEstimator(
        fingertips=robot.fingertips,
        free_tip=FreeTip(robot.palm),
        handle=Cylinder(believed_radius, tool.contact_height - half, tool.contact_height + half),
        p_WS=plan.p_WS,
        wrench=build_wrench(scenario, inertia),
        slips=build_slips(scenario),
        out=build_out(scenario),
        forces=forces,
        driven=DrivenForce(ForceFromTorque(robot, gauge_floor=0.0, gauge_share=0.0)) if torque else None,
        touch=touch,
        joints=THROUGH if torque else JointSmoother(),
        filter=build_filter(scenario),
        prior=build_prior(scenario),
        memory=max(FRAMES_KEPT / 30.0, scenario.vision.latency + 2.0 / scenario.vision.rate),
        refiner=build_refiner(scenario),
        reference=Reference(scenario.estimate.reference),
        angle=ScrewAngle(play=slot_play(tool.blade_width, tool.blade_thickness, scenario.screw.slot_width)),
    )


def build_out(scenario: Scenario) -> TipOut:
    """The test of a lost tip, told whether the contact forces are known well enough to feel the loss."""
    if (
        scenario.robot.actuation == "position"
        and scenario.force.source == "tip"
        and scenario.force.direction_noise > FELT
    ):
        return TipOut(least=-math.inf)
    return TipOut()


def build_filter(scenario: Scenario) -> ToolFilter:
    """The filter, told how well encoders read and whether the camera's frames err alike."""
    common = COMMON if scenario.vision.source == "rendered" else 0.0
    sense = scenario.sense
    filter_ = ToolFilter(
        encoder=sense.encoder_noise, arm_encoder=sense.arm_encoder_noise, common=common, common_time=COMMON_TIME
    )
    if scenario.robot.actuation == "position":
        return filter_
    return replace(filter_, arm_time=BetweenTicks.arm_time, wrist_time=BetweenTicks.time)


def build_prior(scenario: Scenario) -> Prior:
    """The filter's doubt at the start, told how well the cell is calibrated: as usual, or worse."""
    sense, usual = scenario.sense, Prior()
    x, y, z = map(max, usual.screw, sense.calibration_error)
    return Prior(
        screw=(x, y, z), radius=max(usual.radius, sense.radius_error), offset=max(usual.offset, sense.joint_offset)
    )


def build_refiner(scenario: Scenario) -> PoseRefiner | None:
    """Who solves III-A: nobody where the filter's pose is handed on as it is."""
    solvers: dict[str, PoseSolver] = {"sqp": SqpSolver(), "ipopt": IpoptSolver()}
    solver = solvers.get(scenario.estimate.solver)
    return None if solver is None else PoseRefiner(solver=solver)


def build_wrench(scenario: Scenario, inertia: ToolInertia) -> TipWrench:
    """The tip's wrench, told how well the fingertips read but nothing of the thread's resistance."""
    wrench = TipWrench(inertia, scenario.screw.pitch)
    if scenario.robot.actuation == "torque":
        size, direction = DRIVEN_SIZE, DRIVEN_DIRECTION
    elif scenario.force.source == "strain":
        return wrench
    else:
        size, direction = scenario.force.noise, scenario.force.direction_noise
    load = replace(wrench.thread.load, direction_error=direction)
    return replace(
        wrench,
        thread=replace(wrench.thread, load=load, gain_error=size),
        axial=replace(wrench.axial, direction_error=direction),
    )


def build_slips(scenario: Scenario) -> Slips:
    """Tests for slips, told how well fingertips and joints read, how loose the blade sits, and the pace of the gait."""
    tool, slot = scenario.tool, scenario.screw.slot_width
    haste, height = max(scenario.speed.gait, 1.0), tool.contact_height
    play = BladePlay(slot_play(tool.blade_width, tool.blade_thickness, slot), scenario.force.direction_noise)
    if scenario.force.source == "strain":
        tip = replace(GAUGED_SLIP, height=height, haste=haste, look=SecondLook(play))
    else:
        direction = scenario.force.direction_noise
        tip = TipSlip(direction_error=direction, height=height, haste=haste, look=SecondLook(play))
    encoder = 0.5 * scenario.sense.encoder_noise
    fingers = LEARNING if scenario.robot.actuation == "torque" else FingerSlip()
    return Slips(fingers=fingers, tip=tip, motion=TipMotion(encoder=encoder, play=slot - tool.blade_thickness))


def slot_play(width: float, thickness: float, slot: float) -> float:
    """Angle by which a blade can turn in its slot, from corners on one pair of walls to the other [rad].

    A blade turned by `a` reaches across the slot by `width sin(a) + thickness cos(a)`, which is `slot` at the walls.

    Args:
        width: Of the blade, along its edge [m].
        thickness: Of the blade [m].
        slot: Width of the slot [m].
    """
    diagonal = float(np.hypot(width, thickness))
    return 2.0 * float(np.arcsin(min(slot / diagonal, 1.0)) - np.arctan2(thickness, width))


def believed_inertia(scenario: Scenario, radius: float) -> ToolInertia:
    """Mass properties of the tool as the robot knows them: a solid handle carries the mass."""
    tool = scenario.tool
    weighed = scenario.model.tool_mass
    mass = tool.mass * (1.0 + scenario.model.mass_error) if weighed is None else weighed
    across = mass * (radius**2 / 4 + tool.handle.length**2 / 12)
    inertia = np.diag([across, across, mass * radius**2 / 2])
    return ToolInertia(mass, np.array([0.0, 0.0, tool.contact_height]), inertia)


def believed_friction(scenario: Scenario) -> float:
    """Coulomb coefficient of the fingertips on the handle as the robot knows it."""
    told = scenario.model.finger_friction
    return scenario.contact.finger_friction * (1.0 + scenario.model.friction_error) if told is None else told


def generators(seed: int) -> dict[str, Generator]:
    """Independent random streams, so that one sensor's settings do not change another's noise."""
    names = ("start", "encoders", "force", "camera")
    return dict(zip(names, (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(4)), strict=True))
