"""Each step of the search, with what the fingers feel made up."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from rigs.messages import estimate_of

from turnscrew.decide.felt_force import FeltForce
from turnscrew.decide.gait import Gait
from turnscrew.decide.placing import Placing
from turnscrew.decide.plans import plan_for
from turnscrew.decide.reseat_pose import corner_T, leaning, seen_from, toward
from turnscrew.decide.reseat_search import DOWN, INSIDE_UP, UP, Search
from turnscrew.decide.reseat_state import ATTEMPTS, FOUR, Felt, ReseatState, Step
from turnscrew.decide.thread_guess import springs_back
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Estimate

PLAN, ROBOT = plan_for(0.018), RobotModel()
GAIT = Gait(PLAN, Placing(ROBOT, PLAN), speed=1.0)
WIDTH, DEPTH, HEADING, DT = 0.006, 0.0013, 0.3, 0.01
HELD = estimate_of(q=PLAN.rolling(0.0), p_WT=PLAN.p_WS, p_WS=PLAN.p_WS, touching=FOUR)


@dataclass(frozen=True)
class MadeUp(FeltForce):
    """Fingers that feel what they are told."""

    force: Array = field(default_factory=lambda: np.zeros(3))
    give: Array = field(default_factory=lambda: np.zeros(6))

    def update(self, felt: Felt, estimate: Estimate, gripping: Flags, dt: float) -> Felt:
        return replace(felt, force=self.force, slow=self.force, give=self.give)


def begun(step: Step, **changes: object) -> ReseatState:
    """A state in a step, its corner where the estimate has the tool's."""
    q = HELD.q
    start = ReseatState(Step.LOOK, 0.0, FOUR.copy(), GAIT.init(), (1.0,), False, False, q, q, heading=HEADING)
    search = Search(FeltForce(ROBOT), WIDTH, DEPTH)
    corner = search.over(start, HELD, 0.0)
    p_WT, R_WT = leaning(corner, HEADING, 1.0, search.lean, 0.5 * WIDTH)
    state = search.begin(start, replace(HELD, p_WT=p_WT, R_WT=R_WT), corner, q)
    top = float(corner[2])
    return replace(state.to(step), surface=top, rest=top, **changes)


def after(
    state: ReseatState, seconds: float, force: Array | None = None, give: Array | None = None,
    seen: Estimate = HELD,
) -> ReseatState:  # fmt: skip
    """The state after some time in which always the same is felt, and seen."""
    feel = MadeUp(ROBOT, force=np.zeros(3) if force is None else force, give=np.zeros(6) if give is None else give)
    search, step = Search(feel, WIDTH, DEPTH), state.step
    for _ in range(round(seconds / DT)):
        state = replace(state, clock=state.clock + DT)
        state, V = search.update(state, seen, DT)
        assert np.isfinite(V).all()
        if state.step is not step:
            break
    return state


def pressed(push: float = 0.0, state: ReseatState | None = None) -> Array:
    """Pressed as wanted, and pushed back along the slot [N]."""
    along = np.zeros(3) if state is None else state.along
    return np.array([0.0, 0.0, 0.7]) - push * along


def test_the_head_is_felt_where_it_is() -> None:
    assert after(begun(Step.LAND), 0.1).step is Step.LAND
    assert after(begun(Step.LAND), 0.1, pressed()).step is Step.REST


def test_where_the_head_is_not_felt_there_is_none() -> None:
    low = np.array([0.0, 0.0, -0.003, 0.0, 0.0, 0.0])
    state = after(begun(Step.LAND), 0.1, give=low)
    assert (state.step, state.attempt) == (Step.LIFT, 1)
    assert state.why == "no head below"


def test_fingers_that_come_to_rest_high_over_the_head_feel_nothing() -> None:
    high = np.array([0.0, 0.0, 0.0045, 0.0, 0.0, 0.0])
    assert after(begun(Step.LAND), 0.1, pressed(), high).step is Step.LAND


def test_rest_learns_what_is_felt_although_nothing_pushes() -> None:
    state = after(begun(Step.REST), 1.0, np.array([0.3, -0.2, 0.7]))
    assert state.step is Step.SWEEP
    assert state.felt is not None
    np.testing.assert_allclose(state.felt.zero, [0.3, -0.2, 0.0])
    np.testing.assert_allclose(state.felt.force, [0.0, 0.0, 0.7], atol=1e-15)


def test_a_corner_that_falls_is_in_the_slot() -> None:
    fallen = np.array([0.0, 0.0, -0.0005, 0.0, 0.0, 0.0])
    assert after(begun(Step.SWEEP), 0.4, pressed(), fallen).step is Step.ALIGN
    assert after(begun(Step.SWEEP), 0.4, pressed()).step is Step.SWEEP
    # the slot is not where the corner is seen to fall
    beside = replace(HELD, p_WT=HELD.p_WT - 0.003 * begun(Step.SWEEP).across)
    assert after(begun(Step.SWEEP), 0.4, pressed(), fallen, beside).step is Step.SWEEP


def test_a_sweep_is_kept_from_walking_off_along_the_slot() -> None:
    start, search, moment = begun(Step.SWEEP), Search(FeltForce(ROBOT), WIDTH, DEPTH), 0.2
    on_line = search.over(start, HELD, 0.0) - HELD.R_WT @ corner_T(1.0, 0.5 * WIDTH)

    def way(off: float) -> tuple[float, float]:
        """How far the corner goes along and across if it is seen to rest ahead of its line by `off` [m]."""
        after_it = after(start, moment, pressed(), seen=replace(HELD, p_WT=on_line + off * start.along))
        gone = after_it.corner - start.corner
        return float(gone @ start.along), float(gone @ start.across)

    assert way(0.0) == pytest.approx((0.0, search.sweep * moment), abs=1e-9)
    assert way(-0.0004) == pytest.approx((search.steer * 0.0004 * moment, search.sweep * moment))
    # no faster than it sweeps
    assert way(0.005) == pytest.approx((-search.sweep * moment, search.sweep * moment))


def test_a_corner_that_is_stopped_is_in_the_slot() -> None:
    start = begun(Step.SWEEP)
    assert after(start, 0.4, pressed() - 1.5 * start.across).step is Step.ALIGN
    # that may be friction, and what is felt may be wrong
    assert after(start, 0.4, pressed() - 1.2 * start.across).step is Step.SWEEP
    # what pushes the way that it goes does not stop it
    assert after(start, 0.4, pressed() + 1.5 * start.across).step is Step.SWEEP


@pytest.mark.parametrize(
    ("step", "most"), [(Step.REST, UP), (Step.ALIGN, INSIDE_UP), (Step.DRAG, INSIDE_UP), (Step.RIGHT, INSIDE_UP)]
)
def test_a_push_lifts_a_corner_that_is_in_the_slot_slowly(step: Step, most: float) -> None:
    start, moment = begun(step), 0.1
    state = after(start, moment, np.array([0.0, 0.0, 6.0]))
    assert state.step is step
    assert state.corner[2] - start.corner[2] == pytest.approx(most * moment)
    # a slot's bottom that gives way is followed as fast as ever
    lower = after(start, moment, np.array([0.0, 0.0, -6.0]))
    assert lower.corner[2] - start.corner[2] == pytest.approx(-DOWN * moment)


def test_a_blade_that_sinks_tells_the_slots_heading() -> None:
    start = begun(Step.ALIGN)
    search = Search(FeltForce(ROBOT), WIDTH, DEPTH)
    state = after(start, search.ease + 0.5, pressed())
    assert state.step is Step.ALIGN
    deep = np.array([0.0, 0.0, -0.0009, 0.0, 0.0, 0.0])
    found = after(state, 0.2, pressed(), deep)
    assert found.step is Step.DRAG
    # .5 s of turning, what is felt for, and as far again as a slot's play
    turned = search.scan * (0.5 + 0.11) + search.past
    assert found.heading - HEADING == pytest.approx(turned, abs=0.003)
    assert found.theta == pytest.approx(1.0 - (found.heading - HEADING))
    # if that comes to nothing, it was felt wrong
    assert found.failed("its end has let go").theta == 1.0


def test_a_slot_that_holds_the_blade_back_is_where_the_blade_is() -> None:
    search, held_back = Search(FeltForce(ROBOT), WIDTH, DEPTH), 0.04
    state = after(begun(Step.ALIGN), search.ease + 0.5, pressed())
    deep = np.array([0.0, 0.0, -0.0009, 0.0, 0.0, -held_back])
    free = after(state, 0.2, pressed(), deep * [1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    assert after(state, 0.2, pressed(), deep).heading == pytest.approx(free.heading - held_back)


@pytest.mark.parametrize("parallel", [-0.06, 0.0, 0.06])
def test_a_blade_that_never_sinks_far_is_parallel_where_it_sinks_most(parallel: float) -> None:
    search, state = Search(FeltForce(ROBOT), WIDTH, DEPTH), begun(Step.ALIGN, sure=True)
    rng = np.random.default_rng(1)
    while state.step is Step.ALIGN:
        # play of .07 mm lets it in so far, .6 mm at most; what is felt errs by .1 mm, and is never enough at once
        depth = min(0.035e-3 / np.tan(abs(state.turn - parallel) + 1e-9), 0.0006) + 0.0001 * rng.standard_normal()
        state = after(state, DT, pressed(), np.array([0.0, 0.0, -min(depth, 0.00074), 0.0, 0.0, 0.0]))
    assert state.step is Step.DRAG
    # it is drawn towards the middle by what is felt elsewhere
    assert abs(state.heading - HEADING - parallel) < 0.03
    assert abs(state.heading - HEADING) < abs(parallel) + 0.01
    assert search.sunk > 0.00074
    # that is too little to say that the screw stands elsewhere
    assert state.off == 0.0


def test_a_blade_that_has_sunk_at_once_is_parallel() -> None:
    state = after(begun(Step.ALIGN), 2.0, pressed(), np.array([0.0, 0.0, -0.0009, 0.0, 0.0, 0.0]))
    assert state.step is Step.DRAG
    assert state.heading == HEADING


def test_a_blade_that_sinks_nowhere_is_turned_to_the_other_heading() -> None:
    state = after(begun(Step.ALIGN), 10.0, pressed(), np.array([0.0, 0.0, -0.0004, 0.0, 0.0, 0.0]))
    assert (state.step, state.spring) == (Step.LIFT, True)


def test_what_stops_a_blade_that_never_sinks_is_no_slot() -> None:
    assert after(begun(Step.ALIGN), 10.0, pressed()).step is Step.LIFT


def test_a_sweep_that_finds_nothing_is_made_again() -> None:
    beyond = replace(HELD, p_WT=HELD.p_WT + 0.006 * begun(Step.SWEEP).across)
    state = after(begun(Step.SWEEP), 0.01, pressed(), seen=beyond)
    assert (state.step, state.sweeps, state.attempt) == (Step.HOVER, 1, 0)
    state = after(begun(Step.SWEEP, sweeps=2), 0.01, pressed(), seen=beyond)
    assert (state.step, state.sweeps, state.attempt) == (Step.LIFT, 0, 1)


@pytest.mark.parametrize("step", [Step.ALIGN, Step.DRAG, Step.RIGHT, Step.TURN])
@pytest.mark.parametrize(("along", "across"), [(0.0075, 0.0), (0.0, 0.006), (0.0, -0.006)])
def test_a_corner_that_is_seen_beside_the_slot_is_not_in_it(along: float, across: float, step: Step) -> None:
    state = begun(step)
    state = replace(state, held=state.corner, clock=3.0)
    astray = replace(HELD, p_WT=HELD.p_WT + along * state.along + across * state.across)
    assert after(state, 0.1, pressed(0.4, state)).step is step
    assert after(state, 0.1, pressed(0.4, state), seen=astray).step is Step.LIFT


def test_a_wall_pushes_the_hand_aside() -> None:
    start = begun(Step.RIGHT)
    state = after(start, 0.5, pressed(0.9, start) + 0.2 * start.across)
    assert (state.corner - start.corner) @ state.across == pytest.approx(0.012 * 0.2 * 0.5)


def test_a_wall_that_is_not_there_leads_the_hand_only_so_far() -> None:
    start = begun(Step.RIGHT)
    feel = MadeUp(ROBOT, force=pressed(0.3, start) + 0.5 * start.across)
    search, state = Search(feel, WIDTH, DEPTH, drift=0.004), start
    while state.step is Step.RIGHT:
        state, _ = search.update(replace(state, clock=state.clock + DT), HELD, DT)
    assert float((state.corner - state.slot) @ state.across) == pytest.approx(0.004)


def test_the_hand_slackens_before_it_rights_the_blade() -> None:
    start = begun(Step.RIGHT)
    state = after(start, 1.0, pressed(1.5, start))
    assert (state.corner - start.corner) @ state.along == pytest.approx(-0.004, rel=0.05)
    assert state.lean == start.lean
    assert after(state, 4.5, pressed(0.3, start)).lean == 0.0


SUNK = np.array([0.0, 0.0, -0.0009, 0.0, 0.0, 0.0])


def test_only_a_tip_that_is_held_deep_in_the_head_while_the_hand_stays_is_in() -> None:
    start = begun(Step.TURN, lean=0.0)
    start = replace(start, held=start.corner)
    assert after(start, 6.0, pressed(1.2, start), SUNK).step is Step.PRESS
    pressed_down = replace(start, lean=0.05, down=0.0009).to(Step.PRESS)
    assert after(pressed_down, 3.0, pressed(0.3, start), SUNK).step is Step.DONE
    assert after(start, 6.0, pressed(0.2, start), SUNK).step is Step.LIFT
    # what friction gives, over which the hand runs away
    assert after(start, 6.0, pressed(0.7, start), SUNK).step is Step.LIFT
    # or beside which the camera sees it
    beside = replace(HELD, p_WT=HELD.p_WT + 0.005 * start.across)
    assert after(pressed_down, 3.0, pressed(0.3, start), SUNK, beside).step is Step.LIFT
    # whatever is felt upwards, the blade is not lifted out
    up = pressed(1.2, start) + np.array([0.0, 0.0, 5.0])
    assert after(start, 6.0, up, SUNK).corner[2] == start.corner[2]


@pytest.mark.parametrize("step", [Step.TURN, Step.PRESS])
def test_a_tip_that_friction_holds_on_the_head_is_not_in(step: Step) -> None:
    start = begun(step, lean=0.0)
    state = after(replace(start, held=start.corner), 6.0, pressed(1.2, start), 0.2 * SUNK)
    assert (state.step, state.why) == (Step.LIFT, "the tip is held, but lies on the head")


def test_an_attempt_that_ends_with_the_tool_turned_is_followed_by_one_that_begins_unturned() -> None:
    assert replace(begun(Step.ALIGN), turn=0.1).failed("nothing").turn == 0.0


def test_attempts_try_both_headings_and_end() -> None:
    state, tried = begun(Step.SWEEP), []
    while state.step is not Step.FAILED:
        tried.append(state.theta)
        state = state.failed("nothing")
    assert tried == pytest.approx([1.0, 1.0, 0.0, 0.0] * 4)
    assert len(tried) == ATTEMPTS


@pytest.mark.parametrize("other", [False, True])
def test_a_heading_beyond_doubt_is_doubted_after_two_attempts(other: bool) -> None:
    state, tried = begun(Step.SWEEP, sure=True), []
    for _ in range(4):
        tried.append(state.theta)
        state = state.failed("nothing", other=other)
    assert tried == pytest.approx([1.0, 1.0, 0.0, 1.0] if other else [1.0, 1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("falls", "guess"),
    [
        ((), (False, False)),
        # the roll has been over for too short a time before others touched
        ((np.nan,), (False, False)),
        ((0.004,), (True, False)),
        ((0.010,), (False, False)),
        # readings are still being learned in the first stroke
        ((0.015, 0.001, 0.002), (True, True)),
        ((0.001, 0.015, 0.020), (False, True)),
        ((0.001, 0.008, 0.009), (False, False)),
    ],
)
def test_friction_is_told_by_the_torque_that_falls_when_others_take_over(
    falls: tuple[float, ...], guess: tuple[bool, bool]
) -> None:
    assert springs_back(falls) == guess


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_leaning_blade_has_one_corner_lowest(side: float) -> None:
    corner = np.array([0.1, 0.2, 0.3])
    p, R = leaning(corner, 0.7, side, 0.2, 0.003)
    np.testing.assert_allclose(p + R @ corner_T(side, 0.003), corner, atol=1e-15)
    other = p + R @ corner_T(-side, 0.003)
    assert other[2] - corner[2] == pytest.approx(0.006 * np.sin(0.2))
    assert np.arccos(R[2, 2]) == pytest.approx(0.2)
    np.testing.assert_allclose(R[:2, 0] / np.hypot(*R[:2, 0]), [np.cos(0.7), np.sin(0.7)], atol=1e-12)


def test_twists_lead_straight_and_not_too_fast() -> None:
    here, there = (np.zeros(3), np.eye(3)), (np.array([0.1, 0.0, 0.0]), np.eye(3))
    V, off = toward(here, there, 2.0, 0.03, 0.3)
    np.testing.assert_allclose(V, [0.03, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert off == pytest.approx(0.1)
    turned = seen_from(np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0]), np.zeros(3), np.array([0.1, 0.0, 0.0]))
    np.testing.assert_allclose(turned, [0.0, 0.2, 0.0, 0.0, 0.0, 2.0])
