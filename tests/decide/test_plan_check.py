"""Shipped plans keep every requirement; plans that are spoilt in one way are caught at it."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from turnscrew.decide.plan import GaitPlan
from turnscrew.decide.plan_check import margins, slip, touch
from turnscrew.decide.plan_requirements import REQUIRED
from turnscrew.decide.plan_scene import HANDLE, Stance, gaps
from turnscrew.decide.plans import plan_for
from turnscrew.robot.chain import robot_chain
from turnscrew.robot.model import robot_spec

RADII = (0.010, 0.012, 0.015, 0.018)


@pytest.fixture(scope="module")
def plan() -> GaitPlan:
    return plan_for(0.018)


@pytest.mark.parametrize("radius", RADII)
def test_shipped_plan_keeps_every_requirement(radius: float) -> None:
    assert plan_for(radius).verify() == []


@pytest.mark.parametrize("radius", RADII)
def test_shipped_plan_turns_far_enough(radius: float) -> None:
    # 45 deg net a round are wanted, and less than 1 of the stroke is lost; 54 is what the planner stops at, as rounded
    assert np.degrees(plan_for(radius).stroke) >= 53.99


@pytest.mark.parametrize("radius", RADII)
def test_margins_in_the_file_are_those_of_the_plan(radius: float) -> None:
    shipped = plan_for(radius)
    for name, value in margins(shipped).items():
        # rounding of angles and lengths in the file moves a gap or a slip by less than a micron
        assert value == pytest.approx(shipped.margins[name], abs=1e-6), name


def test_other_radius_leaves_a_gap(plan: GaitPlan) -> None:
    found = replace(plan, handle=replace(plan.handle, radius=0.0178)).verify()
    assert any("gap 200 um" in line for line in found)


def test_wrong_stroke_slips(plan: GaitPlan) -> None:
    wrong = replace(plan, stroke=plan.stroke * 1.05)
    assert any("slips" in line for line in wrong.verify())
    # 5 % of the arc of 66 deg on a radius of 18 mm
    assert slip(wrong, "MF") == pytest.approx(0.05 * plan.stroke * 0.018, rel=0.05)


def test_rolling_the_other_way_slips_by_both_arcs(plan: GaitPlan) -> None:
    back = replace(plan, roll={finger: rows[::-1] for finger, rows in plan.roll.items()})
    # the handle's turn is measured as fastening, so a roll backwards misses it by twice the arc
    assert slip(back, "TH") == pytest.approx(2 * plan.stroke * 0.018, rel=0.05)


def test_support_that_never_retreats_is_caught(plan: GaitPlan) -> None:
    found = replace(plan, retreat=plan.hold).verify()
    assert any(line.startswith("removing") for line in found)


def test_joint_at_its_limit_is_caught(plan: GaitPlan) -> None:
    hold = {**plan.hold, "FF": np.array([0.34, *plan.hold["FF"][1:]])}
    assert any(line.startswith("FFJ4 comes within") for line in replace(plan, hold=hold).verify())


def test_handle_that_ends_below_the_fingers_is_caught(plan: GaitPlan) -> None:
    lower = replace(plan.handle, length=0.06)
    found = replace(plan, handle=lower).verify()
    assert any("inside the handle's end" in line for line in found)


def test_fingers_in_each_others_way_are_caught(plan: GaitPlan) -> None:
    middle = plan.roll["MF"].copy()
    middle[:, 0] -= 0.3
    found = replace(plan, roll={**plan.roll, "MF": middle}).verify()
    assert any("mf" in line and "rf" in line and "gap" in line for line in found)


@pytest.mark.parametrize("radius", [0.010, 0.018])
def test_gaps_are_those_that_mujoco_finds(radius: float) -> None:
    plan = plan_for(radius)
    spec = robot_spec()
    tool = spec.worldbody.add_body(pos=plan.centre)
    tool.add_geom(name=HANDLE, type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, plan.handle.length / 2, 0])
    model = spec.compile()
    data = mujoco.MjData(model)
    chain = robot_chain()
    for q in (plan.rolling(0.5), plan.adding(1.0), plan.relocating(0.5)):
        p, R = chain.place(q)
        p_WH, R_WH = p[chain.palm], R[chain.palm]
        found = gaps([Stance("now", q, ())], plan.handle, R_WH.T @ (plan.centre - p_WH), R_WH.T @ plan.R_WT[:, 2])
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        for (one, other), gap in zip(found.pairs, found.gap, strict=True):
            if other != "shaft" and abs(gap) < 0.02:
                theirs = mujoco.mj_geomDistance(model, data, model.geom(one).id, model.geom(other).id, 0.05, None)
                # MuJoCo's own convex collision converges to 1e-6
                assert gap == pytest.approx(theirs, abs=5e-6), (one, other)


def test_touch_finds_the_planned_contact(plan: GaitPlan) -> None:
    found = touch(plan, plan.rolling(0.0), "MF")
    # the planner's rows lie on the handle to rounding of the file
    assert abs(found.gap) < 1e-6
    assert found.side < REQUIRED.rolling_side
