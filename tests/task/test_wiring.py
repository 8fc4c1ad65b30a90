"""A key of the scenario reaches the block that it is for."""

from __future__ import annotations

import math

import pytest

from turnscrew.actuate.position import PositionAdapter
from turnscrew.actuate.sprung import SprungAdapter
from turnscrew.control.distribution import Distribution
from turnscrew.control.optimal_distribution import OptimalDistribution
from turnscrew.decide.plans import plan_for
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.filter_state import Prior
from turnscrew.estimate.tip_out import OutState, TipOut
from turnscrew.robot.model import RobotModel
from turnscrew.task.scenario import load
from turnscrew.task.wiring import Blocks, believed_friction, believed_inertia, build_blocks, build_out

PLAN = plan_for(0.018)
ROBOT = RobotModel()


def blocks(*overrides: str) -> Blocks:
    return build_blocks(load(None, list(overrides), 0), PLAN, ROBOT, 0.018)


def test_positions_are_the_default():
    built = blocks()
    assert isinstance(built.adapter, PositionAdapter)
    assert isinstance(built.controller.distribution, Distribution)
    assert built.between is None
    assert not built.controller.servo.measured
    assert built.decider.gait.support_speed == 0.0
    assert built.decider.gait.recentre
    assert not blocks("control.recentre=false").decider.gait.recentre


def test_torques_come_with_their_servo_and_optimal_forces():
    built = blocks("robot.actuation=torque")
    assert isinstance(built.adapter, SprungAdapter)
    assert isinstance(built.controller.distribution, OptimalDistribution)
    assert isinstance(built.controller.carrying, Distribution)
    assert built.between is not None
    assert built.controller.servo.measured


def test_null_space_forces_press_as_told_without_an_integral():
    distribution = blocks("robot.actuation=torque", "control.forces=null-space").controller.distribution
    assert isinstance(distribution, Distribution)
    assert distribution.rate == 0.0


def test_friction_is_believed_with_its_error():
    plain, wrong = (blocks("robot.actuation=torque", *more) for more in ((), ("model.friction_error=0.2",)))
    assert wrong.controller.distribution.friction == 1.2 * plain.controller.distribution.friction


def test_friction_and_mass_may_be_told_whatever_is_true():
    true = ["contact.finger_friction=0.6", "tool.mass=0.1", "model.mass_error=0.1", "model.friction_error=0.1"]
    told = load(None, [*true, "model.finger_friction=0.85", "model.tool_mass=0.08"], 0)
    assert believed_friction(told) == 0.85
    assert believed_inertia(told, 0.018).mass == 0.08
    assert blocks("robot.actuation=torque", "model.finger_friction=0.5").controller.distribution.friction == 0.6 * 0.5


def test_beats_divide_the_plants_steps():
    assert load(None, [], 0).beats_per_tick == 1
    assert load(None, ["robot.actuation=torque"], 0).beats_per_tick == 5
    assert load(None, ["robot.actuation=torque", "rate.torque=1000"], 0).beats_per_tick == 10
    assert load(None, ["robot.actuation=torque", "rate.torque=100"], 0).beats_per_tick == 1


def test_the_estimator_is_told_of_a_late_camera_and_of_a_cell_that_is_calibrated_badly() -> None:
    def told(*overrides: str) -> ToolEstimator:
        return blocks(*overrides).estimator

    usual, bad = told(), told("vision.latency=0.12", "sense.calibration_error=[0.003, 0.001, 0.004]")
    # a frame that is .12 s late must be turned forward to now
    assert usual.memory < 0.12 < bad.memory
    assert usual.prior == Prior()
    # better than usual is not believed
    assert bad.prior.screw == (0.003, 0.0015, 0.004)


def test_a_lost_tip_is_felt_only_by_fingertips_that_read_well_enough():
    usual, askew = load(None), load(None, [f"force.direction_noise={math.radians(60.0)}"])
    assert build_out(usual) == TipOut()
    # whatever is read then, nothing is concluded from it
    assert build_out(askew).felt(OutState(age=10.0), -50.0, 0.0, 0.01).unloaded == math.inf
    assert build_out(usual).felt(OutState(age=10.0), -50.0, 0.0, 0.01).unloaded == 0.0


def test_strokes_are_budgeted_for_the_rounds_wanted_by_what_two_fingers_hold():
    gait = blocks("goal.rounds=20", "contact.finger_friction=1.0").decider.gait
    assert gait.budget is not None
    assert gait.budget.rounds == 20
    # .6 of the friction, 9 N of squeeze, 2.5 N of thrust each, at 18 mm
    assert gait.budget.torque == pytest.approx(2 * 0.018 * math.sqrt((0.6 * 9.0) ** 2 - 2.5**2))
    assert blocks("goal.course=stroke").decider.gait.budget is None
    # a round of a robot that takes torques is as short, what first and ring finger turn included
    torques = blocks("goal.rounds=20", "robot.actuation=torque", "speed.gait=2.5").decider.gait
    assert torques.passed_on > 0.0
    assert torques.budget is not None
    assert torques.budget.least + torques.passed_on == pytest.approx(gait.budget.least)
