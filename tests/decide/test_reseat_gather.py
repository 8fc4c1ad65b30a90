"""Taking a tool that has been knocked out: where it belongs in the hand, and who is sent for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.messages import estimate_of

from turnscrew.decide.felt_force import FeltForce
from turnscrew.decide.gait import Gait
from turnscrew.decide.gait_state import FF_RF, TH_MF
from turnscrew.decide.placing import Placing
from turnscrew.decide.plans import plan_for
from turnscrew.decide.reseat import AIMS, CRAMPED, Reseat
from turnscrew.decide.reseat_gather import Gathering
from turnscrew.decide.reseat_pose import leaning
from turnscrew.decide.reseat_search import Search
from turnscrew.decide.reseat_state import FOUR, ReseatState, Step
from turnscrew.decide.reseat_walk import AirWalk
from turnscrew.geometry.arrays import Array
from turnscrew.robot.inverse_kinematics import rotation_vector
from turnscrew.robot.joints import INDEX
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate

PLAN, ROBOT = plan_for(0.018), RobotModel()
GAIT = Gait(PLAN, Placing(ROBOT, PLAN), speed=1.0)
GATHERING = Gathering(ROBOT, PLAN)
RESEAT = Reseat(ROBOT, GATHERING, AirWalk(GAIT, GATHERING, 0.0), Search(FeltForce(ROBOT), 0.006, 0.0013))
Q, DT = PLAN.rolling(0.0), 0.01
UP = PLAN.R_WT[:, 2]
HIGH = 0.02 * UP
"""Over the head."""


def carried(by: Array, **changes: object) -> Estimate:
    """A tool that stands elsewhere in the hand than planned, held by thumb and middle finger."""
    tips = ROBOT.fingertips(Q)
    rest = {"q": Q, "p_WT": PLAN.p_WS + by, "R_WT": PLAN.R_WT, "p_WS": PLAN.p_WS, "touching": TH_MF, "c_W": tips.p_WF}
    return estimate_of(**{**rest, **changes})


def begun(step: Step, **changes: object) -> ReseatState:
    """A state in a step, with two fingers on the handle."""
    return replace(ReseatState(step, 0.0, TH_MF.copy(), GAIT.init(), (0.0,), False, True, Q, Q), **changes)


@pytest.mark.parametrize("by", [(0.0, 0.0, 0.0), (0.0, 0.0, 0.015), (0.004, -0.003, -0.002)])
def test_a_tool_has_its_place_in_the_hand(by: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(GATHERING.off(begun(Step.LIFT), carried(np.array(by))), -np.array(by), atol=1e-9)


def test_two_fingers_bring_a_lifted_tool_back_to_its_place() -> None:
    slid = carried(HIGH)
    down = GATHERING.lifting(begun(Step.LIFT), slid, 0.02).tool
    assert down[:3] @ UP == pytest.approx(-GATHERING.placing)
    # on the head it stays where it is, and four fingers hold it where they are
    assert not GATHERING.lifting(begun(Step.LIFT), slid, 0.001).tool.any()
    assert not GATHERING.lifting(begun(Step.LIFT, gripping=FOUR.copy()), slid, 0.02).tool.any()


def test_a_hand_that_leans_is_righted_over_the_head_before_anything_else() -> None:
    q = Q.copy()
    q[INDEX["WRJ1"]] += 0.2
    (p, R), (_, R_plan) = ROBOT.palm(q), ROBOT.palm(Q)
    leant = carried(np.zeros(3), p_WS=PLAN.p_WS - HIGH, touching=FOUR, q=q)
    start = begun(Step.LIFT, gripping=FOUR.copy(), attempt=1)
    assert not GATHERING.lifting(start, leant, 0.001).palm[3:].any()
    V = GATHERING.lifting(start, leant, 0.02).palm
    # back to the plan, about the tip, which goes on up a little
    assert V[3:] @ rotation_vector(R_plan @ R.T) == pytest.approx(GATHERING.turning * 0.2, rel=1e-6)
    np.testing.assert_allclose(V[:3] + np.cross(V[3:], leant.p_WT - p), [0.0, 0.0, 0.1 * GATHERING.lift], atol=1e-12)
    took = []
    for estimate in (leant, replace(leant, q=Q)):
        state, ticks = start, 0
        while state.step is Step.LIFT:
            state, _ = RESEAT.update(state, estimate, DT)
            ticks += 1
        assert state.step is Step.LEVEL
        took.append(ticks * DT)
    # what cannot be righted is not waited for forever
    assert took == pytest.approx([RESEAT.level, RESEAT.settled], abs=2.0 * DT)


def test_fingers_that_have_not_found_the_handle_aim_anew() -> None:
    state, steps = begun(Step.FEEL), []
    while state.step is not Step.LEVEL:
        state, _ = RESEAT.update(state, carried(HIGH), DT)
        steps.append(state.step)
    assert steps.count(Step.AIM) > 0
    assert state.aims == AIMS


@pytest.mark.parametrize(
    ("attempt", "slid", "follows"),
    [(0, 0.0, Step.LEVEL), (0, 0.01, Step.RELEASE), (1, 0.01, Step.LEVEL), (2, 0.0, Step.RELEASE)],
)
def test_a_grasp_that_has_slid_or_failed_twice_is_taken_anew(attempt: int, slid: float, follows: Step) -> None:
    four = carried(slid * UP, p_WS=PLAN.p_WS - HIGH, touching=FOUR)
    state = begun(Step.LIFT, gripping=FOUR.copy(), attempt=attempt)
    while state.step is Step.LIFT:
        state, _ = RESEAT.update(state, four, DT)
    assert state.step is follows
    assert state.gripping[FOUR].all()


def test_two_fingers_give_up_their_load_before_they_let_go() -> None:
    four = carried(np.zeros(3), p_WS=PLAN.p_WS - HIGH, touching=FOUR)
    state, shares = begun(Step.RELEASE, gripping=FOUR.copy(), taken=1.0), []
    while state.step is Step.RELEASE:
        state, goal = RESEAT.update(state, four, DT)
        shares.append(goal.share[FOUR])
    passing, rest = np.array(shares)[:, FF_RF[FOUR]], np.array(shares)[:, TH_MF[FOUR]]
    np.testing.assert_array_equal(rest, np.ones(rest.shape))
    # from all of it to none, in no tick more than what a tick is of the time
    assert passing[0].min() > 1.0 - 1.01 * DT / RESEAT.take
    assert passing[-1].max() < 1.01 * DT / RESEAT.take
    assert np.abs(np.diff(passing, axis=0)).max() < 1.01 * DT / RESEAT.take
    assert state.gripping.tolist() == TH_MF.tolist()
    while state.step is Step.LIFT:
        state, _ = RESEAT.update(state, four, DT)
    assert state.step is Step.AIM


@pytest.mark.parametrize(("room", "follows"), [(0.5 * CRAMPED, Step.WALK), (2.0 * CRAMPED, Step.HOVER)])
def test_fingers_that_cannot_give_way_any_more_take_the_handle_anew(room: float, follows: Step) -> None:
    q = Q.copy()
    q[INDEX["MFJ3"]] = ROBOT.limits[INDEX["MFJ3"], 0] + room
    four = carried(np.zeros(3), touching=FOUR, q=q)
    state = begun(Step.LEVEL, gripping=FOUR.copy())
    while state.step is Step.LEVEL:
        state, _ = RESEAT.update(state, four, DT)
    assert state.step is follows


@pytest.mark.parametrize(("aside", "follows"), [(0.003, Step.LOOK), (0.03, Step.LIFT)])
def test_a_tool_that_does_not_come_over_the_slot_is_no_use_there(aside: float, follows: Step) -> None:
    state = begun(Step.HOVER, gripping=FOUR.copy())
    search = RESEAT.search
    p_WT, R_WT = leaning(search.over(state, carried(HIGH), search.hover + 0.003), 0.0, 1.0, search.lean, 0.003)
    stopped = carried(HIGH, p_WT=p_WT + np.array([aside, 0.0, 0.0]), R_WT=R_WT, touching=FOUR)
    while state.step is Step.HOVER:
        state, _ = RESEAT.update(state, stopped, DT)
    assert state.step is follows
