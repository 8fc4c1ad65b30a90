"""The gait's order, its hand-overs, and its aim at where the handle is."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from rigs.messages import estimate_of

from turnscrew.decide.gait import Gait, smooth
from turnscrew.decide.gait_state import FF_RF, ORDER, TH_MF, Phase
from turnscrew.decide.placing import Placing, carried_palm, knuckle_way
from turnscrew.decide.plans import plan_for
from turnscrew.decide.stroke_budget import StrokeBudget
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.robot.inverse_kinematics import place_palm
from turnscrew.robot.joints import FINGERS, finger_joints
from turnscrew.robot.model import RobotModel
from turnscrew.signals import Role

ROBOT = RobotModel()
PLAN = plan_for(0.018)
PLACING = Placing(ROBOT, PLAN)
GAIT = Gait(PLAN, PLACING, speed=1.0)
DT = 0.01
TOUCHING = {
    Phase.SETTLE: TH_MF, Phase.ROLL: TH_MF, Phase.ADD: TH_MF | FF_RF, Phase.SUPPORT: TH_MF | FF_RF,
    Phase.LEAVE: FF_RF, Phase.RELOCATE: FF_RF, Phase.RETURN: TH_MF | FF_RF, Phase.REGRIP: TH_MF | FF_RF,
    Phase.REMOVE: TH_MF,
}  # fmt: skip
"""Who touches in a world where all goes well."""


def standing(**changes):
    """The tool where the plan has it, the robot at the plan's start."""
    rest = {"q": PLAN.rolling(0.0), "p_WT": PLAN.p_WS, "p_WS": PLAN.p_WS, "radius": PLAN.radius}
    return estimate_of(**{**rest, **changes})


def play(rounds=1, touching=TOUCHING, gait=GAIT, follows=lambda goal: True, torque=lambda theta: 0.0):
    """Goals of an undisturbed gait whose free fingers are where they are sent, and whose screw turns if it follows."""
    state, goals, q, theta = gait.init(), [], PLAN.rolling(0.0), 0.0
    for _ in range(5000):
        F_s = np.array([0.0, 0.0, 0.0, 0.0, 0.0, torque(theta)])
        estimate = standing(q=q, theta=theta, touching=touching[state.phase], F_s=F_s)
        state, goal = gait.update(state, estimate, DT)
        q = goal.q_free
        theta -= goal.turn_rate * DT * follows(goal)
        goals.append(goal)
        if goal.round >= rounds:
            return goals
    raise AssertionError(f"stuck in {state.phase}")


def phases(goals):
    return [goals[0].phase, *(b.phase for a, b in pairwise(goals) if a.phase != b.phase)]


def test_two_rounds_go_through_all_phases_in_order():
    order = [str(phase) for phase in ORDER]
    assert phases(play(2)) == [*order, *order[1:], "roll"]


def test_rounds_that_do_not_turn_the_screw_do_not_count_and_are_made_firmer():
    goals = play(2, follows=lambda goal: goal.round == 0 or goal.vain == 2)
    rolls = [goal for goal in goals if goal.phase == Phase.ROLL]
    assert [(goal.round, goal.vain) for a, goal in pairwise(goals) if goal.phase == "roll" != a.phase] == [
        (0, 0), (1, 0), (1, 1), (1, 2), (2, 0),
    ]  # fmt: skip
    for vain in range(3):
        of = [goal for goal in rolls if goal.round == 1 and goal.vain == vain]
        # half as much again each time, and as much slower
        assert max(goal.squeeze[TH_MF].max() for goal in of) == pytest.approx((1.0 + 0.5 * vain) * GAIT.squeeze)
        assert min(goal.turn_rate for goal in of) == pytest.approx(-GAIT.speed / (1.0 + 0.5 * vain))


def test_a_round_takes_less_than_four_and_a_half_seconds_at_nominal_speed():
    first = [goal for goal in play(1) if goal.phase != Phase.SETTLE]
    # touching costs standoff / closing = .27 s a pair, which this world does not take
    assert len(first) * DT + 2 * GAIT.standoff / GAIT.closing < 4.5


def test_two_fingers_always_carry_the_tool():
    for goal in play(2):
        assert (goal.roles == Role.GRIP).sum() >= 2
        assert goal.share.sum() >= 1.9


def test_shares_and_squeezes_never_jump():
    goals = play(2)
    shares = np.array([goal.share for goal in goals])
    # a ramp of .2 s moves by 5 % a tick; a finger enters with a tenth and leaves with what is left of a tick
    assert np.abs(np.diff(shares, axis=0)).max() <= 0.1 + 1e-9


def test_free_fingers_are_never_sent_faster_than_their_drives():
    goals = play(2)
    q = np.array([goal.q_free for goal in goals])
    free = np.array([goal.roles == Role.FREE for goal in goals])
    for row, finger in enumerate(FINGERS):
        joints = list(finger_joints(finger))
        stays_free = free[1:, row] & free[:-1, row]
        speed = np.abs(np.diff(q[:, joints], axis=0))[stays_free] / DT
        assert speed.max() < 4.0, finger  # Shadow's 2 to 4 rad/s


def test_the_stroke_is_the_plans():
    turned = -sum(goal.turn_rate for goal in play(1)) * DT
    # a tick at full speed: what is told and what is counted differ by when in the tick they are taken
    assert turned == pytest.approx(PLAN.stroke, abs=1.0 * DT)


def test_strokes_are_as_short_as_the_thread_demands_and_lift_off_from_where_they_end():
    budget = StrokeBudget(6, torque=0.05)
    gait = replace(GAIT, budget=budget)
    goals = play(6, gait=gait, torque=lambda theta: 0.014 * theta)
    ends = [a for a, b in pairwise(goals) if a.phase == Phase.ROLL != b.phase]
    turned = [-sum(g.turn_rate for g in goals if g.round == made) * DT for made in range(6)]
    # two full ones tell of the spring
    assert turned[:2] == pytest.approx([PLAN.stroke] * 2, abs=1.0 * DT)
    assert max(turned[2:]) < 0.75 * PLAN.stroke
    assert min(turned[2:]) > budget.least - 1.0 * DT
    for end, goal in zip(ends, (a for a, b in pairwise(goals) if a.phase == Phase.LEAVE != b.phase), strict=False):
        # lifted off by as much as from the end of a full stroke, to within what a tick turns
        lift = goal.q_free - end.q_guide
        np.testing.assert_allclose(lift[:6], 0.0, atol=1e-12)
        rows = [joint for finger in ("TH", "MF") for joint in finger_joints(finger)]
        np.testing.assert_allclose(lift[rows], (PLAN.leaving(1.0) - PLAN.rolling(1.0))[rows], atol=0.02)


def test_what_the_supporting_fingers_pass_on_does_not_depend_on_the_pace():
    gait = replace(GAIT, support_speed=0.3)
    for pace in (1.0, 2.5):
        goals = play(1, gait=gait.faster(pace))
        turned = -sum(goal.turn_rate for goal in goals if goal.phase == Phase.RELOCATE) * DT
        # up and down in `ramp`, to what a tick turns
        assert turned == pytest.approx(0.3 * (GAIT.relocate - GAIT.ramp), abs=0.3 * pace * DT)
        assert turned == pytest.approx(gait.passed_on, abs=0.3 * pace * DT)


def test_fingers_feel_for_the_handle_from_where_they_were_sent():
    def feels(state, **changes):
        return GAIT.update(state, standing(touching=TH_MF, **changes), DT)[1].approach.any(axis=1)

    state, q, sent, late = replace(GAIT.init(), phase=Phase.ADD), PLAN.rolling(0.0), PLAN.rolling(0.0), 0.0
    while not feels(state, q=q).any():
        state, goal = GAIT.update(state, standing(q=q, touching=TH_MF), DT)
        # they follow with a lag of 40 ms
        sent, late = goal.q_free, late + DT
        q = q + DT / 0.04 * (sent - q)
    joints = [joint for finger in ("FF", "RF") for joint in finger_joints(finger)]
    # the tick that feels is one later than the last that is counted
    assert late + DT >= GAIT.add
    assert np.abs(q - sent)[joints].max() <= GAIT.near
    np.testing.assert_array_equal(feels(state, q=q), FF_RF)
    # nor do those that are there, but have not stopped
    fast = np.zeros(28)
    fast[joints] = 1.5 * GAIT.slow
    assert not feels(state, q=sent, v=fast).any()
    # what has begun goes on, and what is kept away begins all the same, if not at once
    np.testing.assert_array_equal(feels(replace(state, near=True), q=PLAN.rolling(0.0)), FF_RF)
    for late in (0.9, 1.1):
        clock = GAIT.add + late * GAIT.standoff / GAIT.closing
        assert feels(replace(state, clock=clock), q=PLAN.rolling(0.0)).any() == (late > 1.0)


def test_only_the_roll_turns_and_moves_the_palm():
    for goal in play(1):
        if goal.phase not in (Phase.ROLL, Phase.SETTLE):
            assert goal.turn_rate == 0.0
            assert not goal.V_palm.any()


def test_nobody_lets_go_before_the_others_have_touched():
    never = {**TOUCHING, Phase.ADD: TH_MF}
    with pytest.raises(AssertionError, match="add"):
        play(1, never)


def test_a_roll_ends_before_a_joint_meets_its_limit():
    state = replace(GAIT.init(), phase=Phase.ROLL, clock=0.5, rolled=0.3)
    q = PLAN.rolling(0.3)
    q[finger_joints("MF")[0]] = ROBOT.limits[finger_joints("MF")[0], 0] + 0.5 * GAIT.stop
    towards, away = np.zeros(28), np.zeros(28)
    towards[finger_joints("MF")[0]], away[finger_joints("MF")[0]] = -0.5, 0.5
    assert GAIT.update(state, standing(q=q, v=towards, touching=TH_MF), DT)[0].phase is Phase.ADD
    assert GAIT.update(state, standing(q=q, v=away, touching=TH_MF), DT)[0].phase is Phase.ROLL
    # a joint that is as far away as it goes on by in braking
    fast, far = 4.0 * towards, q.copy()
    far[finger_joints("MF")[0]] += 0.9 * 2.0 * GAIT.braking
    assert GAIT.update(state, standing(q=far, v=fast, touching=TH_MF), DT)[0].phase is Phase.ADD
    assert GAIT.update(state, standing(q=far, v=towards, touching=TH_MF), DT)[0].phase is Phase.ROLL
    # when a roll begins, joints still move by what went before
    first = replace(state, rolled=0.0)
    assert GAIT.update(first, standing(q=q, v=towards, touching=TH_MF), DT)[0].phase is Phase.ROLL


@pytest.mark.parametrize("standoff", [0.0, 0.004])
def test_postures_are_carried_to_where_the_tool_is(standoff):
    tilt, shift = exp_so3(np.array([0.02, -0.015, 0.7])), np.array([0.002, -0.003, 0.001])
    estimate = standing(R_WT=tilt, p_WT=PLAN.p_WS + shift)
    q = PLACING.before_handle(PLAN.adding(1.0), ("FF", "RF"), estimate, standoff)
    rows = [FINGERS.index("FF"), FINGERS.index("RF")]
    p = (ROBOT.fingertips(q).p_WF[rows] - estimate.p_WT) @ tilt
    planned = ROBOT.fingertips(PLAN.adding(1.0)).p_WF[rows] - PLAN.p_WS
    # heights and distances from the axis are the plan's, whatever the tool's yaw
    np.testing.assert_allclose(p[:, 2], planned[:, 2], atol=1e-5)
    reach = np.linalg.norm(planned[:, :2], axis=1) + standoff
    np.testing.assert_allclose(np.linalg.norm(p[:, :2], axis=1), reach, atol=1e-5)


def test_the_palm_is_moved_over_the_tool_no_faster_than_allowed():
    shift = np.array([0.004, -0.002, 0.001])
    V = PLACING.palm_twist(standing(p_WS=PLAN.p_WS + shift))
    np.testing.assert_allclose(V[:3] / np.linalg.norm(V[:3]), shift / np.linalg.norm(shift), atol=1e-9)
    assert np.linalg.norm(V[:3]) == pytest.approx(PLACING.arm_speed)
    assert not V[3:].round(12).any()
    assert not PLACING.palm_twist(standing()).round(12).any()


def test_a_palm_that_was_carried_along_with_a_leaning_tool_is_brought_back_upright():
    tilt, shift = exp_so3(np.array([0.03, -0.04, 0.0])), np.array([0.002, -0.003, 0.001])
    p_WH, R_WH = carried_palm(ROBOT, PLAN, PLAN.p_WS + shift, tilt[:, 2])
    q = place_palm(ROBOT, p_WH, R_WH, PLAN.rolling(0.0), np.random.default_rng(0), starts=1).q
    # believed to lean or not, the tool is to stand upright over the screw
    estimate = standing(q=q, R_WT=tilt, p_WT=PLAN.p_WS + shift, p_WS=PLAN.p_WS + shift)
    error, V = PLACING.palm_error(estimate), PLACING.palm_twist(estimate)
    # a micron and what it counts as a turn is the inverse kinematics' tolerance
    np.testing.assert_allclose(error[3:], -log_so3(tilt), atol=1e-5)
    upright = ROBOT.palm(PLAN.rolling(0.0))[0] - PLAN.p_WS
    np.testing.assert_allclose(error[:3], upright - tilt @ upright, atol=2e-6)
    assert knuckle_way(V) == pytest.approx(PLACING.arm_speed)
    np.testing.assert_allclose(V / np.linalg.norm(V), error / np.linalg.norm(error), atol=1e-9)


def settled(off, recentre=True):
    """Time of the first grip with a palm that never comes nearer than `off` [m]."""
    gait, ticks, away = replace(GAIT, recentre=recentre), 0, np.array([off, 0.0, 0.0])
    state = gait.init()
    while state.phase is Phase.SETTLE:
        estimate = standing(p_WS=PLAN.p_WS + away, touching=TH_MF)
        state, goal = gait.update(state, estimate, DT)
        assert goal.V_palm.any() == (recentre and off > 0.0)
        ticks += 1
    return ticks * DT


def test_the_first_roll_waits_for_the_palm_but_not_for_ever():
    # a tick more or less is rounding of the clock
    assert settled(0.9 * GAIT.centred) == pytest.approx(GAIT.settle, abs=1.5 * DT)
    assert settled(1.1 * GAIT.centred) == pytest.approx(GAIT.settle_most, abs=1.5 * DT)
    assert settled(1.1 * GAIT.centred, recentre=False) == pytest.approx(GAIT.settle, abs=1.5 * DT)


def test_four_fingers_that_have_settled_hand_over():
    state, held = replace(GAIT.init(), gripping=TH_MF | FF_RF), standing(touching=TH_MF | FF_RF)
    while state.phase is Phase.SETTLE:
        state, _ = GAIT.update(state, held, DT)
    assert state.phase is Phase.SUPPORT


def test_fingers_pushed_off_a_tool_that_four_should_hold_let_go_of_it_and_come_anew():
    state, ticks = replace(GAIT.init(), gripping=TH_MF | FF_RF), 0
    off = (TH_MF | FF_RF) & (np.array(FINGERS) != "FF")
    # without waiting for the palm, which is far off
    away = standing(touching=off, p_WS=PLAN.p_WS + np.array([2.0 * GAIT.centred, 0.0, 0.0]))
    while state.phase is Phase.SETTLE:
        state, _ = GAIT.update(state, away, DT)
        ticks += 1
    assert ticks * DT == pytest.approx(GAIT.settle, abs=1.5 * DT)
    phases = [state.phase]
    while state.phase is not Phase.ADD:
        state, goal = GAIT.update(state, standing(touching=off), DT)
        phases.append(state.phase)
        assert (goal.roles[TH_MF] == Role.GRIP).all()
    assert list(dict.fromkeys(phases)) == [Phase.REMOVE, Phase.ROLL, Phase.ADD]
    assert not state.gripping[FF_RF].any()
    assert state.round == 0


def test_the_blend_is_flat_at_both_ends():
    h = 1e-4
    assert (smooth(-1.0), smooth(0.0), smooth(0.5), smooth(1.0), smooth(2.0)) == (0.0, 0.0, 0.5, 1.0, 1.0)
    # the slope grows with the square of the distance from an end: 30 h^2
    assert smooth(h) / h < 31 * h**2


@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_the_supporting_pair_may_turn_on_while_the_others_go_back(factor):
    goals = play(1, gait=replace(GAIT, support_speed=0.2).faster(factor))
    assert {goal.phase for goal in goals if goal.turn_rate != 0.0} == {Phase.ROLL, Phase.RELOCATE}
    back = np.array([goal.turn_rate for goal in goals if goal.phase == Phase.RELOCATE])
    # two ramps of .1 s take a quarter of .4 s; ticks of .01 s are coarse for a way back of .16 s
    assert -back.sum() * DT == pytest.approx(0.2 * 0.3, rel=0.1)
    assert np.abs(np.diff(back)).max() <= 0.2 * factor * DT / (0.1 / factor) + 1e-9


def test_a_faster_gait_takes_its_times_divided():
    fast = [goal for goal in play(1, gait=GAIT.faster(2.5)) if goal.phase not in (Phase.SETTLE, Phase.ROLL)]
    slow = [goal for goal in play(1) if goal.phase not in (Phase.SETTLE, Phase.ROLL)]
    # eight phases, each a tick longer than its time at most
    assert len(fast) == pytest.approx(len(slow) / 2.5, abs=8)
