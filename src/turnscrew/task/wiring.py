"""From a scenario to the blocks of the loop: the one place where a key becomes a parameter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.actuate.position import PositionAdapter
from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.control.controller import Controller
from turnscrew.control.distribution import Distribution
from turnscrew.control.servo import HybridServo
from turnscrew.decide.gait import Gait
from turnscrew.decide.placing import Placing
from turnscrew.decide.plan import GaitPlan
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.screw_angle import ScrewAngle
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.geometry.profiles import Cylinder
from turnscrew.plant.cell import Cell, CellDescription
from turnscrew.plant.contact import Friction
from turnscrew.plant.screw import Screw
from turnscrew.plant.thread import Thread
from turnscrew.plant.tool import Tool
from turnscrew.robot.model import RobotModel
from turnscrew.sense.encoders import Encoders, finger_offset_sigma
from turnscrew.sense.fingertip_force import FingertipForce
from turnscrew.sense.sensors import Sensors
from turnscrew.sense.vision import NoisyTruthVision
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.start import Start

FRICTION_USED = 0.6
"""Share of the believed friction that the squeeze counts on: the rest is margin for readings that err by 25 % and
30 deg, which at worst leave `.75 cos(30 deg) = .65` of what was asked for."""


@dataclass(frozen=True)
class Blocks:
    """The loop's blocks and their parameters."""

    sensors: Sensors
    estimator: ToolEstimator
    gait: Gait
    controller: Controller
    adapter: PositionAdapter


def build_cell(scenario: Scenario, start: Start) -> Cell:
    """The plant."""
    tool, screw, thread = scenario.tool, scenario.screw, scenario.screw.thread
    description = CellDescription(
        tool=Tool(
            radius=tool.handle.radius, length=tool.handle.length, middle=tool.contact_height, mass=tool.mass,
            shaft_radius=tool.shaft_radius, blade=(tool.blade_width, tool.blade_thickness),
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
    )  # fmt: skip
    return Cell(description, start.q, start.p_WT, start.R_WT)


def build_blocks(scenario: Scenario, plan: GaitPlan, robot: RobotModel, believed_radius: float) -> Blocks:
    """The loop's blocks, told what the robot is told."""
    inertia = believed_inertia(scenario, believed_radius)
    placing = Placing(robot, plan)
    return Blocks(
        sensors=build_sensors(scenario),
        estimator=build_estimator(scenario, plan, robot, inertia, believed_radius),
        gait=Gait(plan, placing, scenario.speed.turning),
        controller=Controller(
            HybridServo(inertia, scenario.screw.pitch),
            Distribution(FRICTION_USED * scenario.contact.finger_friction * (1.0 + scenario.model.friction_error)),
        ),
        adapter=PositionAdapter(robot),
    )


def build_sensors(scenario: Scenario) -> Sensors:
    """Simulated sensors."""
    sense, vision = scenario.sense, scenario.vision
    return Sensors(
        encoders=Encoders(sense.encoder_noise, finger_offset_sigma(sense.joint_offset)),
        force=FingertipForce(scenario.force.noise, scenario.force.direction_noise),
        camera=NoisyTruthVision(
            vision.rate, vision.position_noise, vision.rotation_noise, vision.latency, vision.dropout
        ),
    )


def build_estimator(
    scenario: Scenario, plan: GaitPlan, robot: RobotModel, inertia: ToolInertia, believed_radius: float
) -> ToolEstimator:
    """The estimator, with handle and screw as believed."""
    tool, thread = scenario.tool, scenario.screw.thread
    half = tool.handle.length / 2
    return ToolEstimator(
        fingertips=robot.fingertips,
        handle=Cylinder(believed_radius, tool.contact_height - half, tool.contact_height + half),
        p_WS=plan.p_WS,
        wrench=TipWrench(inertia, scenario.screw.pitch, thread.stiffness if thread.law == "elastic" else None),
        angle=ScrewAngle(play=slot_play(tool.blade_width, tool.blade_thickness, scenario.screw.slot_width)),
    )


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
    mass = tool.mass * (1.0 + scenario.model.mass_error)
    across = mass * (radius**2 / 4 + tool.handle.length**2 / 12)
    inertia = np.diag([across, across, mass * radius**2 / 2])
    return ToolInertia(mass, np.array([0.0, 0.0, tool.contact_height]), inertia)


def generators(seed: int) -> dict[str, Generator]:
    """Independent random streams, so that one sensor's settings do not change another's noise."""
    names = ("start", "encoders", "force", "camera")
    return dict(zip(names, (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(4)), strict=True))
