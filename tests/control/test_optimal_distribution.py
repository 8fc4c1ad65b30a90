"""Optimal contact forces, with fingers that come and go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.grips import FOUR_HELD, PINCHED
from rigs.messages import goal_of

from turnscrew.contact.friction import cone_margin, split
from turnscrew.contact.grasp import grasp_matrix
from turnscrew.control.optimal_distribution import OptimalDistribution
from turnscrew.robot.contact_jacobian import contact_jacobian
from turnscrew.robot.coupling import SELECTION
from turnscrew.robot.joints import DRIVEN
from turnscrew.robot.model import RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.signals import Role

ROBOT = RobotModel()
# as it is once the friction's doubt has faded
BLOCK = OptimalDistribution(ROBOT, doubt=0.0)
TH_MF = np.array([True, False, True, False, False])
FOUR = np.array([True, True, True, True, False])
DT = 0.002


def gripping(who, share=None, squeeze=4.0):
    share = who.astype(float) if share is None else share
    return goal_of(roles=np.where(who, Role.GRIP, Role.FREE), share=share, squeeze=share * squeeze)


def run(goals, F_hd, estimate=FOUR_HELD, block=BLOCK):
    state, track = block.init(), []
    for goal in goals:
        state, wanted = block.update(state, goal, estimate, F_hd, DT)
        track.append(wanted)
    return track


def wrench(f_W):
    return grasp_matrix(FOUR_HELD.c_W, FOUR_HELD.p_WT) @ f_W.ravel()


def test_four_fingers_give_the_wanted_wrench():
    F_hd = np.array([0.0, 0.0, -4.2, 0.0, 0.0, -0.08])
    wanted = run([gripping(FOUR)] * 30, F_hd)[-1]
    np.testing.assert_allclose(wrench(wanted.f_W)[[2, 5]], F_hd[[2, 5]], rtol=0.02)
    assert (wanted.margin[FOUR] >= -1e-9).all()
    assert np.isnan(wanted.margin[~FOUR]).all()
    assert not wanted.limited.any()


def test_a_finger_that_leaves_takes_its_force_along_without_a_jump():
    F_hd = np.array([0, 0, -4.2, 0, 0, -0.02])
    steps = np.linspace(1.0, 0.0, 101)
    goals = [gripping(FOUR)] * 50 + [gripping(FOUR, np.where(TH_MF, s, FOUR.astype(float))) for s in steps]
    forces = np.array([wanted.f_W for wanted in run(goals, F_hd)])
    jumps = np.abs(np.diff(forces[50:], axis=0)).max()
    # 4 N of squeeze and 2 N of thrust leave in 100 steps; five times an even step would be a jump
    assert jumps < 5 * 6.0 / 100
    assert np.abs(forces[-1][TH_MF]).max() < 1e-6


def test_a_finger_that_has_just_touched_presses_with_its_share_of_the_most():
    wanted = run([gripping(FOUR, np.where(TH_MF, 1.0, 0.1) * FOUR)] * 30, np.array([0, 0, -4.2, 0, 0, -0.1]))[-1]
    pressing = -(wanted.f_W * FOUR_HELD.n_W).sum(axis=1)
    assert (pressing[[1, 3]] <= BLOCK.first + 1e-5).all()


def test_more_than_the_drives_can_give_is_left_out_and_named():
    F_hd = np.array([0, 0, -5.0, 0, 0, -0.8])
    wanted = run([gripping(TH_MF)] * 50, F_hd, PINCHED)[-1]
    assert np.linalg.norm(wanted.lost) > 0.1
    J = contact_jacobian(ROBOT.fingertips(PINCHED.q), np.array([0, 2]), PINCHED.c_W[[0, 2]])
    torque = np.abs(J.T @ wanted.f_W[[0, 2]].ravel())
    assert (torque[4:] <= DRIVE_LIMITS[4:]).all()
    strong = OptimalDistribution(ROBOT, most=60.0)
    state = strong.init()
    for _ in range(50):
        state, wanted = strong.update(state, gripping(TH_MF), PINCHED, F_hd, DT)
    assert {name[:2] for name, full in zip(DRIVEN, wanted.limited, strict=True) if full} <= {"TH", "MF", "WR"}
    assert wanted.limited.any()


def test_without_a_grip_nothing_is_asked():
    wanted = run([goal_of()], np.ones(6))[0]
    assert not wanted.f_W.any()
    np.testing.assert_array_equal(wanted.lost, np.ones(6))


def test_the_squeeze_rises_with_a_tool_that_leans_and_fades_again():
    def pressing(wanted):
        return -(wanted.f_W * PINCHED.n_W).sum(axis=1)[TH_MF].mean()

    goal, F_hd = gripping(TH_MF, squeeze=6.0), np.array([0.0, 0.0, -4.2, 0.0, 0.0, 0.0])
    pushed = replace(PINCHED, nu=np.array([0.0, 0, 0, 0.8, 0, 0]))
    state, track = BLOCK.init(), []
    for estimate in [PINCHED] * 50 + [pushed] * 10 + [PINCHED] * 750:
        state, wanted = BLOCK.update(state, goal, estimate, F_hd, DT)
        track.append(pressing(wanted))
    # 6 N.s/rad above .1 rad/s are 4.2 N; within ten ticks nearly all of it
    assert track[59] - track[49] > 3.5
    # 1.5 s are five times the time in which it fades
    assert abs(track[-1] - track[49]) < 0.1


def test_every_contact_keeps_its_margin():
    wanted = run([gripping(TH_MF, squeeze=1.0)] * 60, np.array([0, 0, -4.2, 0, 0, -0.03]), PINCHED)[-1]
    assert (wanted.margin[TH_MF] >= BLOCK.margin - 1e-5).all()


def test_what_is_spare_is_told_by_the_friction_that_is_expected():
    goal, F_hd = [gripping(TH_MF, squeeze=1.0)] * 60, np.array([0, 0, -4.2, 0, 0, -0.03])
    for expected in (BLOCK.friction, 0.85):
        wanted = run(goal, F_hd, PINCHED, replace(BLOCK, expected=expected))[-1]
        # the pyramid that counts lies inside the cone that tells: by what its sides fall short, a sixteenth at most
        room = cone_margin(wanted.f_W, PINCHED.n_W, expected)[TH_MF]
        pressing = split(wanted.f_W, PINCHED.n_W)[0][TH_MF]
        assert (wanted.margin[TH_MF] <= room + 1e-5).all()
        assert (wanted.margin[TH_MF] >= room - 0.08 * BLOCK.friction * pressing - 1e-5).all()


def test_friction_is_doubted_at_first_by_what_the_drives_have_to_spare():
    goal, light = gripping(TH_MF, squeeze=1.0), np.array([0.0, 0.0, -4.2, 0.0, 0.0, -0.01])
    doubting = OptimalDistribution(ROBOT)
    state, track = doubting.init(), []
    for _ in range(4000):
        state, wanted = doubting.update(state, goal, PINCHED, light, 15.0 * DT)
        pressing, along = split(wanted.f_W, PINCHED.n_W)
        track.append(float((along[TH_MF] / pressing[TH_MF]).max()))
    # the cone is three tenths narrower, and as usual after 120 s, four times what the doubt fades in
    settled = split(run([goal] * 60, light, PINCHED)[-1].f_W, PINCHED.n_W)
    assert track[50] < 0.75 * BLOCK.friction
    assert track[50] < 0.8 * track[-1]
    assert track[-1] == pytest.approx(float((settled[1][TH_MF] / settled[0][TH_MF]).max()), rel=0.02)
    # drives at their limits take the doubt, too: what is asked for then is what is asked for without it
    heavy = np.array([0.0, 0.0, -5.0, 0.0, 0.0, -0.8])
    spent = doubting.init()
    for _ in range(50):
        spent, wanted = doubting.update(spent, gripping(TH_MF), PINCHED, heavy, DT)
    assert spent.spare < 0.05
    assert wanted.lost[5] == pytest.approx(run([gripping(TH_MF)] * 50, heavy, PINCHED)[-1].lost[5], rel=0.02)


def test_a_finger_that_is_trusted_less_presses_more_and_stays_inside_its_smaller_cone():
    F_hd = np.array([0.0, 0.0, -4.2, 0.0, 0.0, -0.04])
    doubted = replace(PINCHED, grip=np.array([1.0, 1.0, 0.6, 1.0, 1.0]))
    whole = run([gripping(TH_MF)] * 30, F_hd, PINCHED)[-1]
    wary = run([gripping(TH_MF)] * 30, F_hd, doubted)[-1]
    pressing, along = split(wary.f_W, PINCHED.n_W)
    # it presses a fifth more; the rest of what it can no longer carry goes to the thumb
    assert pressing[2] > 1.1 * split(whole.f_W, PINCHED.n_W)[0][2]
    assert along[2] <= 0.6 * BLOCK.friction * pressing[2]


def test_the_program_in_one_pass_is_the_one_of_its_parts():
    goal, F_hd, rows = (
        gripping(FOUR, np.where(TH_MF, 1.0, 0.4) * FOUR),
        np.array([0.1, 0, -4, 0, 0, -0.05]),
        np.arange(4),
    )
    state, _ = BLOCK.update(BLOCK.init(), goal, FOUR_HELD, F_hd, DT)
    weights, sharing = BLOCK.sharing.weights(FOUR_HELD.radius), BLOCK.sharing
    posed = BLOCK._posed(state, goal, FOUR_HELD, F_hd, rows, 0.5, state.active)
    k, n_W = 4, FOUR_HELD.n_W[:4]
    G = grasp_matrix(FOUR_HELD.c_W[:4], FOUR_HELD.p_WT)
    R = np.kron(np.eye(2), FOUR_HELD.R_WT)
    np.testing.assert_allclose(posed.A, weights[:, None] * (R.T @ G), atol=1e-12)
    dear = (sharing.follow + sharing.rest) * np.eye(3 * k)
    np.testing.assert_allclose(posed.H, posed.A.T @ posed.A + dear, atol=1e-12)
    squeeze = goal.squeeze[:4] + 0.5 * goal.share[:4]
    pull = sharing.follow * state.f_W[:4] - sharing.rest * squeeze[:, None] * n_W
    np.testing.assert_allclose(posed.slope, -(posed.A.T @ (weights * F_hd)) - pull.ravel(), atol=1e-12)
    torques = (sharing.sides + 1) * k
    J = contact_jacobian(ROBOT.fingertips(FOUR_HELD.q), rows, FOUR_HELD.c_W[:4])
    np.testing.assert_allclose(posed.rows[torques:], J.T[4:], atol=1e-12)
    # what the drives may give is about what they need to hold the hand
    middle = -(SELECTION.T @ ROBOT.bias(FOUR_HELD.q, FOUR_HELD.v))[4:]
    np.testing.assert_allclose(0.5 * (posed.low + posed.high)[torques:], middle, atol=1e-12)
