"""What is done about trouble: by the table, not for ever, and never but for trouble."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rigs.messages import estimate_of

from turnscrew.decide.gait import Gait
from turnscrew.decide.gait_state import FF_RF, TH_MF, Phase
from turnscrew.decide.placing import Placing
from turnscrew.decide.plans import plan_for
from turnscrew.decide.recovery import LATE, OUT, POLICY, ROLL_LAG, Action, Decider, DeciderState
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel
from turnscrew.signals import FREE, GRIP, REACH, TIP_LAG, Estimate, Fault, FaultKind, Goal
from turnscrew.task.reseat_wiring import build_reseat
from turnscrew.task.scenario import load

PLAN = plan_for(0.018)
ROBOT = RobotModel()
GAIT = Gait(PLAN, Placing(ROBOT, PLAN), speed=1.0)
DECIDER = Decider(GAIT, build_reseat(load(None, [], 0), PLAN, ROBOT))
DT = 0.01
NOBODY = np.zeros(5, dtype=bool)
TH, FF, MF, RF, LF = range(len(FINGERS))


PAGE = Path(__file__).parents[2] / "docs" / "loop.md"


def standing(touching: np.ndarray = TH_MF, q: np.ndarray | None = None) -> Estimate:
    q = PLAN.rolling(0.0) if q is None else q
    pressed = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    return estimate_of(
        q=q, p_WT=PLAN.p_WS, p_WS=PLAN.p_WS, radius=PLAN.radius, touching=touching, theta=1.0, F_s=pressed
    )


def into(phase: Phase, clock: float = 0.5, touching: np.ndarray = TH_MF) -> DeciderState:
    """The state at some time in a phase."""
    start = DECIDER.init()
    holding = {Phase.RELOCATE: FF_RF, Phase.RETURN: FF_RF, Phase.CATCH: NOBODY}.get(phase, TH_MF)
    gait = replace(start.gait, phase=phase, clock=clock, gripping=holding.copy())
    state, _ = DECIDER.update(replace(start, gait=gait), standing(touching), (), DT)
    return state


def trouble(kind: FaultKind, ends: bool = True) -> tuple[Fault, ...]:
    return (Fault(kind, 1.0, "", ends),)


def for_a_while(
    state: DeciderState, seconds: float, faults: tuple[Fault, ...] = (), touching: np.ndarray = TH_MF
) -> tuple[DeciderState, list[Goal]]:
    """What happens when the free fingers are where they are sent."""
    goals, q = [], PLAN.rolling(0.0)
    for _ in range(round(seconds / DT)):
        state, goal = DECIDER.update(state, standing(touching, q), faults, DT)
        q = goal.q_free
        goals.append(goal)
    return state, goals


@pytest.mark.parametrize("phase", list(Phase))
@pytest.mark.parametrize("kind", list(FaultKind))
def test_every_fault_in_every_phase_is_answered_by_the_table(kind: FaultKind, phase: Phase) -> None:
    # early enough for no phase to be over
    state, goal = DECIDER.update(into(phase, 0.01, NOBODY), standing(NOBODY), trouble(kind), DT)
    action = POLICY.get(kind, {}).get(phase, Action.STOP)
    assert state.action is action
    assert goal.action == action
    assert [done.action for done in state.made] == ([] if action is Action.STOP else [action])


@pytest.mark.parametrize("kind", list(FaultKind))
def test_trouble_that_a_run_lives_with_changes_nothing(kind: FaultKind) -> None:
    state, goal = DECIDER.update(into(Phase.ROLL), standing(), trouble(kind, ends=False), DT)
    assert (state.action, goal.action, goal.turn_rate) == (None, "", -1.0)


def test_nothing_turns_in_the_dark_and_the_roll_goes_on_after_it() -> None:
    state = into(Phase.ROLL)
    rolled = state.gait.rolled
    state, goals = for_a_while(state, 3.0, trouble(FaultKind.VISION_LOST))
    assert {goal.turn_rate for goal in goals} == {0.0}
    assert state.gait.rolled == rolled
    assert len(state.made) == 1
    state, goals = for_a_while(state, 0.1)
    assert {(goal.action, goal.turn_rate) for goal in goals} == {("", -1.0)}


def test_waiting_has_an_end() -> None:
    state, _ = for_a_while(into(Phase.ROLL), DECIDER.patience + DECIDER.stop + 0.1, trouble(FaultKind.VISION_LOST))
    over = DECIDER.over(state)
    assert over is not None
    assert over.kind is FaultKind.VISION_LOST


def test_nothing_is_tried_about_what_is_hopeless() -> None:
    fault = Fault(FaultKind.VISION_LOST, 1.0, "no pose since the start", hopeless=True)
    state, _ = for_a_while(into(Phase.ROLL), DT, (fault,))
    assert state.action is Action.STOP


def test_lost_finger_feels_for_the_handle_and_the_others_take_over() -> None:
    only_thumb = TH_MF & (np.arange(5) == TH)
    state, goals = for_a_while(into(Phase.ROLL), DT, trouble(FaultKind.CONTACT_LOST), only_thumb)
    assert goals[0].roles.tolist() == [GRIP, FREE, REACH, FREE, FREE]
    # one finger alone may hardly press
    assert goals[0].squeeze[TH] < 1.0
    state, goals = for_a_while(state, 0.3, (), only_thumb)
    assert all(goal.phase == Phase.CATCH for goal in goals)
    assert {goal.turn_rate for goal in goals} == {0.0}
    state, goals = for_a_while(state, 0.3)
    assert [*dict.fromkeys(goal.phase for goal in goals)] == [Phase.CATCH, Phase.GRASP, Phase.ADD]
    grasp = [goal.squeeze[MF] for goal in goals if goal.phase == Phase.GRASP]
    assert grasp[0] < 1.0
    # in .2 s from a tenth to all of it, in steps of a twentieth
    assert max(np.diff(grasp)) < 0.06 * DECIDER.gait.squeeze
    assert state.action is None


def test_a_phase_that_ends_as_it_is_named_stalled_has_not() -> None:
    all_four = TH_MF | FF_RF
    state, goals = for_a_while(into(Phase.ADD), DT, (), all_four)
    assert goals[-1].phase == Phase.ADD
    assert state.gait.phase is Phase.SUPPORT
    state, goals = for_a_while(state, DT, trouble(FaultKind.STALLED), all_four)
    assert (state.action, goals[-1].phase) == (None, Phase.SUPPORT)
    # what is named once more stops the run
    state, _ = for_a_while(state, DT, trouble(FaultKind.STALLED), all_four)
    assert state.action is Action.STOP


def test_fingers_that_find_nothing_go_back_before_they_feel_again() -> None:
    supports = ~TH_MF
    state, goals = for_a_while(into(Phase.RETURN, touching=supports), 1.0, (), supports)
    assert goals[-1].roles[TH] == REACH
    state, goals = for_a_while(state, DT, trouble(FaultKind.STALLED), supports)
    state, more = for_a_while(state, 0.5, (), supports)
    roles = [goal.roles[TH] for goal in (*goals, *more)]
    away = roles.count(FREE)
    # to a tick
    assert away * DT == pytest.approx(DECIDER.gait.add, abs=1.5 * DT)
    assert roles == [FREE] * away + [REACH] * (len(roles) - away)


def test_handle_is_turned_back_out_of_the_way_and_the_others_come_again() -> None:
    rolled = into(Phase.ADD)
    rolled = replace(rolled, gait=replace(rolled.gait, rolled=0.9, gripping=TH_MF | (np.arange(5) == FF)))
    state, goals = for_a_while(rolled, 1.0, (), TH_MF)
    state, goals = for_a_while(state, DT, trouble(FaultKind.STALLED), TH_MF)
    state, more = for_a_while(state, 0.6, (), TH_MF)
    goals += more
    assert [*dict.fromkeys(goal.phase for goal in goals)] == [Phase.BACK, Phase.ADD]
    back = [goal for goal in goals if goal.phase == Phase.BACK]
    # to a tick
    turned = sum(goal.turn_rate for goal in back) * DT
    assert turned == pytest.approx(DECIDER.gait.back, abs=1.5 * DT * DECIDER.gait.back_speed)
    assert state.gait.rolled == pytest.approx(0.9 - turned)
    assert all(goal.roles[FF] == FREE for goal in back)


def test_the_same_trouble_is_not_answered_for_ever() -> None:
    state = into(Phase.RETURN, touching=~TH_MF)
    for answered in range(1, DECIDER.tries + 1):
        state, _ = for_a_while(state, DT, trouble(FaultKind.STALLED), ~TH_MF)
        assert len(state.made) == answered
        assert state.action is Action.AIM
        state, _ = for_a_while(replace(state, action=None), 1.0, (), ~TH_MF)
    state, _ = for_a_while(state, DT, trouble(FaultKind.STALLED), ~TH_MF)
    assert state.action is Action.STOP


def test_a_run_that_ends_holds_the_tool_still_first() -> None:
    state, before = for_a_while(into(Phase.ROLL), 0.1)
    state, goals = for_a_while(state, DECIDER.stop - DT, trouble(FaultKind.TOOL_DROPPED))
    assert DECIDER.over(state) is None
    for goal in goals:
        assert goal.turn_rate == 0.0
        assert np.array_equal(goal.roles, before[-1].roles)
        assert np.array_equal(goal.squeeze, before[-1].squeeze)
    state, _ = for_a_while(state, 3 * DT, trouble(FaultKind.TOOL_DROPPED))
    over = DECIDER.over(state)
    assert over is not None
    assert over.kind is FaultKind.TOOL_DROPPED


def test_the_documentation_prints_the_table() -> None:
    rows = re.findall(r"^\| `([A-Z_]+)`[^|]*\| ([^|]+) \| ([a-z ]+):", PAGE.read_text(), flags=re.MULTILINE)
    printed: dict[FaultKind, dict[Phase, Action]] = {}
    for kind, phases, action in rows:
        named = Phase if phases == "any" else map(Phase, phases.split(", "))
        printed.setdefault(FaultKind(kind), {}).update(dict.fromkeys(named, Action(action)))
    assert printed == {kind: dict(answers) for kind, answers in POLICY.items()}


@pytest.mark.parametrize("kind", OUT)
def test_who_stops_for_a_lost_tip_presses_on_nothing(kind: FaultKind) -> None:
    state, goal = replace(DECIDER, reseat=None).update(into(Phase.ROLL), standing(), trouble(kind), DT)
    assert state.action is Action.STOP
    assert goal.tip_force == 0.0
    _, others = for_a_while(into(Phase.ROLL), 0.1, trouble(FaultKind.DIVERGED))
    assert others[-1].tip_force == DECIDER.gait.tip_force


def test_a_round_that_ended_with_the_tip_perhaps_out_does_not_count() -> None:
    state = into(Phase.ROLL)
    for tick in range(20):
        known = replace(standing(), tip_sure=tick <= 10)
        state, _ = DECIDER.update(state, known, (), DT)
    state = replace(state, gait=replace(state.gait, round=state.gait.round + 1))
    assert state.gait.round == 1
    # counted .07 s after the last tick without a doubt, or sooner
    lost = replace(standing(), tip_sure=False)
    doubted, goal = DECIDER.update(state, lost, trouble(FaultKind.CAM_OUT), DT)
    assert (doubted.gait.round, goal.round) == (0, 0)
    # one that was made before stays
    for _ in range(TIP_LAG):
        state, _ = DECIDER.update(state, standing(), (), DT)
    later, goal = DECIDER.update(state, lost, trouble(FaultKind.CAM_OUT), DT)
    assert (later.gait.round, goal.round) == (1, 1)


def test_a_tip_that_is_lost_between_rolls_is_searched_for_where_it_was_last_sure_to_be_in() -> None:
    state = into(Phase.SUPPORT)
    for _ in range(ROLL_LAG):
        state, _ = DECIDER.update(state, replace(standing(), theta=1.0), (), DT)
        state = replace(state, gait=replace(state.gait, phase=Phase.SUPPORT, clock=DT))
    state, _ = DECIDER.update(state, replace(standing(), theta=1.5, tip_sure=False), trouble(FaultKind.CAM_OUT), DT)
    assert state.reseat is not None
    assert state.reseat.lost == (1.0,)


def lost_in_a_roll(ticks: int) -> tuple[DeciderState, Estimate]:
    """So long a roll, and the tip not sure to be in its drive after 11 ticks: the tool turns on without the screw."""
    state = into(Phase.ROLL)
    for tick in range(ticks):
        known = replace(standing(), theta=1.0 + 0.02 * tick, tip_sure=tick <= 10)
        state, _ = DECIDER.update(state, known, (), DT)
        state = replace(state, gait=replace(state.gait, phase=Phase.ROLL, clock=DT))
    return state, known


def test_a_tip_that_is_lost_in_a_roll_is_searched_for_at_two_angles_in_turn() -> None:
    state, known = lost_in_a_roll(20)
    state, goal = DECIDER.update(state, known, trouble(FaultKind.CAM_OUT), DT)
    assert state.action is Action.RESEAT
    assert state.reseat is not None
    assert state.reseat.lost[-1] == pytest.approx(1.0 + 0.02 * (10 - TIP_LAG + 1))
    # in a roll, it is likelier where it was when such a loss happens that is named now
    assert state.reseat.lost[0] == pytest.approx(1.0 + 0.02 * (21 - ROLL_LAG))
    assert state.reseat.theta == state.reseat.lost[0]
    again = state.reseat.failed("nothing there")
    assert again.theta == state.reseat.lost[1]
    assert goal.tip_free
    assert goal.tip_force == 0.0
    assert goal.phase.startswith("reseat")


def test_a_loss_that_is_named_late_is_searched_for_where_the_tip_was_last_sure_to_be_in() -> None:
    state, known = lost_in_a_roll(10 + LATE + 2)
    state, _ = DECIDER.update(state, known, trouble(FaultKind.CAM_OUT), DT)
    assert state.reseat is not None
    assert state.reseat.lost[0] == pytest.approx(1.0 + 0.02 * (10 - TIP_LAG + 1))


def test_fingers_that_have_all_lost_the_tool_press_on_to_find_it_again() -> None:
    def lost(touching: np.ndarray) -> Goal:
        return DECIDER.update(into(Phase.ROLL), standing(touching), trouble(FaultKind.CAM_OUT), DT)[1]

    np.testing.assert_array_equal(lost(NOBODY).roles[TH_MF], GRIP)
    # one that has lost it while others hold it would push them about
    four = np.array([True, True, True, True, False])
    state = into(Phase.SUPPORT, touching=four)
    state = replace(state, gait=replace(state.gait, gripping=four.copy()))
    held = four & (np.arange(len(FINGERS)) != RF)
    _, goal = DECIDER.update(state, standing(held), trouble(FaultKind.CAM_OUT), DT)
    np.testing.assert_array_equal(goal.roles == GRIP, held)
