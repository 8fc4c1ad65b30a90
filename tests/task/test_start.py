"""A run begins with the hand around the tool as planned, wherever that stands; the robot believes what it was told."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.decide.plan import ROLLING
from turnscrew.errors import PlanError
from turnscrew.robot.joints import FINGERS, finger_joints
from turnscrew.robot.model import RobotModel
from turnscrew.study.trials.variation import draw, override, table
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.start import ARM_MARGIN, draw_start, plan_of
from turnscrew.task.wiring import generators

ROBOT = RobotModel()
COURSES = {"rounds": [], "stroke": ["goal.course=stroke"]}
PLANS = {course: plan_of(load(None, wishes)) for course, wishes in COURSES.items()}


def drawn(course: str, seed: int, variation: str = "hard") -> Scenario:
    base = load(None, COURSES[course])
    values = draw(table(base, variation, ["goal.course"]), base, seed)
    return load(None, [*(override(key, value) for key, value in values.items()), *COURSES[course]], seed)


# the plan of a stroke bends the wrist farther: at 3 deg it is at its limit in one start of four
@pytest.mark.parametrize(("course", "variation", "leans"), [("rounds", "hard", 3.0), ("stroke", "standard", 1.5)])
@pytest.mark.parametrize("seed", range(8100, 8110))
def test_the_tool_sees_the_hand_as_planned(course: str, variation: str, leans: float, seed: int) -> None:
    plan, scenario = PLANS[course], drawn(course, seed, variation)
    start = draw_start(scenario, plan, ROBOT, generators(seed)["start"])
    yaw = scenario.screw.slot_yaw
    R_ZT = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    # the tool but for its yaw, which the plan does not know of
    lean = start.R_WT @ R_ZT.T
    assert np.degrees(np.arccos(lean[2, 2])) == pytest.approx(leans, abs=0.01)
    p, R = ROBOT.palm(start.q)
    p_plan, R_plan = ROBOT.palm(plan.rolling(0.0))
    # the inverse kinematics' tolerance, a micron, and the turn that it weighs the same
    np.testing.assert_allclose(lean.T @ (p - start.p_WT), p_plan - plan.p_WS, atol=2e-6)
    np.testing.assert_allclose(lean.T @ R, R_plan, atol=2e-5)
    np.testing.assert_allclose(start.q[6:], plan.rolling(0.0)[6:], atol=1e-4)
    rows = [FINGERS.index(finger) for finger in ROLLING]
    tips = (ROBOT.fingertips(start.q).p_WF[rows] - start.p_WT) @ lean
    np.testing.assert_allclose(tips, ROBOT.fingertips(plan.rolling(0.0)).p_WF[rows] - plan.p_WS, atol=3e-6)


@pytest.mark.parametrize("course", COURSES)
def test_every_start_of_the_hard_variation_is_within_reach(course: str) -> None:
    low, high = ROBOT.limits[:6].T
    for seed in range(8200, 8250):
        start = draw_start(drawn(course, seed), PLANS[course], ROBOT, generators(seed)["start"])
        assert (start.q[:6] >= low + ARM_MARGIN).all()
        assert (start.q[:6] <= high - ARM_MARGIN).all()


def test_fingers_reach_for_what_arm_and_wrist_cannot(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, scenario = PLANS["rounds"], load(None, ["start.tool_tilt=0.005", "sense.calibration_error=[0.0, 0.0, 0.0]"])
    narrow = RobotModel()
    # a wrist that cannot bend further than planned
    narrow.limits[4:6] = plan.arm[4:6, None] + np.array([-ARM_MARGIN, ARM_MARGIN])
    start = draw_start(scenario, plan, narrow, generators(8100)["start"])
    np.testing.assert_allclose(start.q[4:6], plan.arm[4:6], atol=1e-12)
    moved = np.abs(start.q - plan.rolling(0.0))
    assert max(moved[list(finger_joints(finger))].max() for finger in ROLLING) > 1e-3
    with pytest.raises(PlanError, match="cannot reach the handle"):
        draw_start(load(None, ["start.tool_tilt=0.15"]), plan, narrow, generators(8100)["start"])


def test_the_robot_believes_what_it_was_told() -> None:
    scenario = drawn("rounds", 8100)
    run = Run.begin(scenario)
    with run.cell:
        believed, truth = run.state.estimator.filter, run.cell.truth()
        np.testing.assert_array_equal(believed.p_WT, PLANS["rounds"].p_WS)
        np.testing.assert_allclose(believed.R_WT[:, 2], [0.0, 0.0, 1.0], atol=1e-12)
        np.testing.assert_array_equal(believed.b_W, np.zeros(3))
        # and that is wrong: sigmas are 3 and 4 mm here, the tool leans by 3 deg
        assert np.linalg.norm(truth.p_WS - believed.p_WT) > 5e-4
