"""The planner's parts against the robot's model and finite differences; the planner as a whole where time allows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from turnscrew.decide import planner, planner_refine
from turnscrew.decide.plan import Course, Handle
from turnscrew.decide.plan_requirements import REQUIRED
from turnscrew.decide.planner import grip_of, make_plan
from turnscrew.decide.planner_clearance import clearance, gap_rows
from turnscrew.decide.planner_kinematics import finger_kinematics
from turnscrew.decide.planner_problem import Program
from turnscrew.decide.planner_roll import contact, dense_roll
from turnscrew.decide.planner_round import axis, moments, sizes
from turnscrew.decide.planner_rows import Wish
from turnscrew.decide.plans import plan_for
from turnscrew.decide.plans.store import CACHE_VARIABLE, plan_path
from turnscrew.errors import PlanError
from turnscrew.robot.joints import COUPLED, FINGERS, INDEX, finger_joints
from turnscrew.robot.model import RobotModel, driven_jacobian


@pytest.mark.parametrize("finger", FINGERS)
def test_symbolic_kinematics_is_the_robot_models(finger: str) -> None:
    robot, rng = RobotModel(), np.random.default_rng(3)
    q = rng.uniform(robot.limits[:, 0], robot.limits[:, 1])
    for follower, leader in COUPLED.items():
        q[INDEX[follower]] = q[INDEX[leader]]
    joints, row = list(finger_joints(finger)), FINGERS.index(finger)
    p_WH, R_WH = robot.palm(q)
    tips = robot.fingertips(q)
    tip, z, J_p, J_w = (np.array(value) for value in finger_kinematics(finger).tip(q[joints]))
    # rounding of a dozen rotations
    np.testing.assert_allclose(p_WH + R_WH @ tip[:, 0], tips.p_WF[row], atol=1e-12)
    np.testing.assert_allclose(R_WH @ z[:, 0], tips.R_WF[row][:, 2], atol=1e-12)
    np.testing.assert_allclose(R_WH @ J_p, driven_jacobian(tips.J[row, :3])[:, joints], atol=1e-12)
    np.testing.assert_allclose(R_WH @ J_w, driven_jacobian(tips.J[row, 3:])[:, joints], atol=1e-12)


def test_gap_rows_give_the_gaps_and_their_first_derivatives() -> None:
    plan = plan_for(0.018)
    unknowns, watched = grip_of(plan), moments()
    near = clearance(watched, unknowns, plan.handle).points
    symbols = {name: ca.SX.sym(name, size) for name, size in sizes().items()}
    u = ca.vertcat(*axis(symbols["u"], ca.sqrt))
    rows = gap_rows(near, watched, symbols, plan.handle, u)
    x = ca.vertcat(*symbols.values())
    here = np.concatenate(list(unknowns.values()))
    evaluate = ca.Function("rows", [x], [rows, ca.jacobian(rows, x)])
    value, slope = (np.array(part) for part in evaluate(here))
    # golden section ends within 30 nm of the nearest point
    np.testing.assert_allclose(value[:, 0], [point.gap for point in near], atol=1e-7)
    rng, step = np.random.default_rng(0), 1e-4
    way = rng.normal(size=len(here))
    worst = int(np.argmin(value[:, 0]))
    moved = {}
    for sign in (-1, 1):
        there, place = {}, 0
        for name, size in sizes().items():
            there[name] = (here + sign * step * way)[place : place + size]
            place += size
        moved[sign] = min(clearance(watched, there, plan.handle).least.values())
    # central differences over 2e-4 of a gap with curvatures of 1/10 mm: errors of 1e-4 of the slope's size
    assert (moved[1] - moved[-1]) / (2 * step) == pytest.approx(float(slope[worst] @ way), abs=5e-3)


def test_shipped_grip_is_a_solution_of_the_program() -> None:
    plan = plan_for(0.018)
    unknowns, watched = grip_of(plan), moments()
    near = clearance(watched, unknowns, plan.handle).points
    wish = Wish(stroke=0.0, least_stroke=plan.stroke, most_stroke=plan.stroke)
    outcome = Program(plan.handle, REQUIRED, watched, near, unknowns, wish, 0.05).solve()
    # IPOPT's tolerance, summed over eleven groups of slacks
    assert outcome.missed < 1e-4
    assert outcome.status == planner_refine.SOLVED
    assert outcome.unknowns["stroke"][0] == pytest.approx(plan.stroke, abs=1e-9)


def test_dense_roll_touches_and_does_not_slip() -> None:
    plan = plan_for(0.012)
    unknowns = grip_of(plan)
    c, u = unknowns["c"], np.array(axis(unknowns["u"], np.sqrt))
    for finger, rows in dense_roll(plan.handle, unknowns).items():
        gap = [contact(finger, plan.handle, c, u, q)[0] for q in rows]
        # Newton from microns off
        assert np.abs(gap).max() < 1e-12
        # the shipped roll is this one, by way of the file's seven digits and of knots read back from it
        assert np.abs(rows - plan.roll[finger]).max() < 1e-5


def test_handle_that_nothing_fits_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planner_refine, "MOST_STEPS", 2)
    with pytest.raises(PlanError, match=r"^tool.handle.radius = 0.05: no finger gait fits this handle .* m work$"):
        make_plan(Handle(0.05), [plan_for(0.018)])


def test_plan_at_hand_needs_no_planner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("planned again")

    monkeypatch.setattr(planner, "make_plan", refuse)
    assert plan_for(0.018).radius == 0.018


def test_planned_once_then_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    made = []

    def pretend(handle: Handle, *_: object, **__: object) -> object:
        made.append(handle)
        return replace(plan_for(0.018), handle=handle)

    monkeypatch.setattr(planner, "make_plan", pretend)
    first, second = plan_for(0.0171), plan_for(0.0171)
    assert made == [Handle(0.0171)]
    assert first.handle == second.handle
    assert plan_path(Handle(0.0171)).is_relative_to(tmp_path)
    # a damaged file is planned anew
    plan_path(Handle(0.0171)).write_text("{")
    plan_for(0.0171)
    assert len(made) == 2


def test_cache_that_cannot_be_written_is_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv(CACHE_VARIABLE, str(blocked))
    monkeypatch.setattr(planner, "make_plan", lambda handle, *_, **__: replace(plan_for(0.018), handle=handle))
    assert plan_for(0.0171).radius == 0.0171


def test_cache_file_depends_on_every_dimension() -> None:
    handles = (Handle(0.017), Handle(0.0171), Handle(0.017, length=0.11), Handle(0.017, middle=0.12),
               Handle(0.017, shaft_radius=0.004))  # fmt: skip
    assert len({plan_path(handle) for handle in handles}) == len(handles)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [0.0112, 0.0138, 0.0165])
def test_plans_on_demand(radius: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    told: list[str] = []
    plan = plan_for(radius, progress=told.append)
    assert plan.verify() == []
    assert np.degrees(plan.stroke) >= 53.99
    assert told


@pytest.mark.slow
def test_shipped_stroke_is_what_its_command_makes() -> None:
    shipped = plan_for(0.0125, course=Course.STROKE)
    made = plan_for(0.0125, course=Course.STROKE, fresh=True)
    for finger, rows in made.roll.items():
        # IPOPT's tolerance; other builds of its linear solver differ in the last digits
        np.testing.assert_allclose(rows, shipped.roll[finger], atol=1e-3)


@pytest.mark.slow
def test_default_plan_is_what_its_command_makes() -> None:
    shipped, made = plan_for(0.018), plan_for(0.018, fresh=True)
    assert made.command == shipped.command
    for finger, rows in made.roll.items():
        # IPOPT's tolerance; other builds of its linear solver differ in the last digits
        np.testing.assert_allclose(rows, shipped.roll[finger], atol=1e-3)
