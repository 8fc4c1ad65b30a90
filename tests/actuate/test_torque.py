"""(17) and (18): what the torques make of arm, hand and contacts, by MuJoCo's own dynamics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.grips import planned
from rigs.messages import goal_of

from turnscrew.actuate.joint_motion import consistent_inverse, joint_accelerations, joint_speeds
from turnscrew.actuate.postures import FINGER_DRIVES, PALM
from turnscrew.actuate.torque import TorqueAdapter
from turnscrew.contact.grasp import grasp_matrix
from turnscrew.contact.rolling_motion import contact_accelerations
from turnscrew.decide.plans import plan_for
from turnscrew.robot.contact_jacobian import contact_bias, contact_jacobian
from turnscrew.robot.coupling import DRIVEN_INDEX, SELECTION
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.signals import Effort, Role

ROBOT = RobotModel()
ADAPTER = TorqueAdapter(ROBOT)
PLAN = plan_for(0.018)
Q = PLAN.rolling(0.3)
V = SELECTION @ (np.random.default_rng(2).normal(size=24) * 0.05)
REST = np.zeros(28)
DT = 0.002
TH_MF = np.array([finger in ("TH", "MF") for finger in FINGERS])
ROWS = np.flatnonzero(TH_MF)
NO_EFFORT = Effort(np.zeros(6), np.zeros((5, 3)), np.zeros(6))


def held(v=REST, **changes):
    return planned(Q, v=v, **changes)


def grip(**changes):
    return goal_of(roles=np.where(TH_MF, Role.GRIP, Role.FREE), q_free=Q, q_guide=Q, **changes)


def torque(goal, effort, estimate):
    _, command = ADAPTER.update(ADAPTER.init(Q), goal, effort, estimate, DT)
    return command.tau


def accelerations(tau, f_W, estimate):
    """Joint accelerations (24,) by MuJoCo's inverse dynamics, one unit acceleration at a time."""
    q, v = estimate.q, estimate.v
    still = SELECTION.T @ ROBOT.inverse_dynamics(q, v, REST)
    M = np.column_stack([SELECTION.T @ ROBOT.inverse_dynamics(q, v, unit) - still for unit in SELECTION.T])
    J = contact_jacobian(ROBOT.fingertips(q), ROWS, estimate.c_W[ROWS])
    return np.linalg.solve(M, tau - still - J.T @ f_W[ROWS].ravel())


def test_contacts_accelerate_with_the_tool_and_press_as_told():
    estimate = held(V, nu=np.array([0.0, 0.0, 1e-5, 0.02, -0.01, -0.3]))
    f_W = np.zeros((5, 3))
    f_W[TH_MF] = [[3.0, 0.5, -2.0], [-3.0, -0.4, -2.0]]
    alpha = np.array([0.0, 0.0, 1e-3, 3.0, -2.0, 10.0])
    # the speeds that (18) compensates the damping at are the true ones here, so that what is left is (17)
    V_c = contact_jacobian(ROBOT.fingertips(Q), ROWS, estimate.c_W[ROWS]) @ V[DRIVEN_INDEX]
    tau = torque(grip(), Effort(np.zeros(6), f_W, np.zeros(6), alpha), estimate)
    braked = tau + ROBOT.damping @ SELECTION * V[DRIVEN_INDEX]
    qddot = accelerations(braked, f_W, estimate)
    dynamics = ROBOT.dynamics(estimate.q, estimate.v)
    tips, c_W = dynamics.tips, estimate.c_W[ROWS]
    cdot = (grasp_matrix(c_W, PLAN.p_WS).T @ estimate.nu).reshape(-1, 3)
    J = contact_jacobian(dynamics.tips, ROWS, c_W)
    got = J @ qddot + contact_bias(tips.J[ROWS], dynamics.Jdot_v[ROWS], tips.p_WF[ROWS], V, c_W, cdot)
    wanted = contact_accelerations(c_W, cdot, PLAN.p_WS, np.eye(3), estimate.nu, alpha)
    assert V_c.any()
    # both dynamics are MuJoCo's: what is left is rounding of 24 solves
    np.testing.assert_allclose(got, wanted, atol=1e-7)


def palm_and_contacts(weight):
    """Largest acceleration of a drive of arm and wrist, and those of the contacts, while the tool is to turn."""
    alpha = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -40.0])
    effort = Effort(np.zeros(6), np.zeros((5, 3)), np.zeros(6), alpha)
    adapter = TorqueAdapter(ROBOT, weight)
    _, command = adapter.update(adapter.init(Q), grip(), effort, held(), DT)
    qddot = accelerations(command.tau, np.zeros((5, 3)), held())
    return np.abs(qddot[PALM]).max(), contact_jacobian(ROBOT.fingertips(Q), ROWS, held().c_W[ROWS]) @ qddot


def test_a_heavy_palm_stays_and_the_contacts_move_all_the_same():
    (light, by_all), (heavy, by_fingers) = palm_and_contacts(1.0), palm_and_contacts(100.0)
    np.testing.assert_allclose(by_fingers, by_all, atol=1e-7)
    assert heavy < 0.1 * light


def test_contacts_roll_at_the_tools_speed():
    J = contact_jacobian(ROBOT.fingertips(Q), ROWS, held().c_W[ROWS])
    inverse = consistent_inverse(SELECTION.T @ ROBOT.mass_matrix(Q) @ SELECTION, J)
    V_c = grasp_matrix(held().c_W[ROWS], PLAN.p_WS).T @ np.array([0.0, 0, 1e-4, 0, 0, -1.0])
    rest = np.random.default_rng(0).normal(size=24)
    np.testing.assert_allclose(J @ joint_speeds(inverse, J, V_c, rest), V_c, atol=1e-12)


def test_torques_in_the_null_space_disturb_no_contact():
    M = SELECTION.T @ ROBOT.mass_matrix(Q) @ SELECTION
    J = contact_jacobian(ROBOT.fingertips(Q), ROWS, held().c_W[ROWS])
    inverse = consistent_inverse(M, J)
    pushed = np.random.default_rng(0).normal(size=24)
    free = joint_accelerations(inverse, J, np.zeros(6), pushed)
    # as torques: they accelerate no contact, whatever the joints' inertias
    np.testing.assert_allclose(J @ np.linalg.solve(M, M @ free), 0.0, atol=1e-11)
    assert np.linalg.norm(free) > 0.5 * np.linalg.norm(pushed)


def test_at_rest_the_torques_hold_the_robot_up():
    tau = torque(goal_of(q_free=Q, q_guide=Q), NO_EFFORT, held())
    np.testing.assert_allclose(tau, SELECTION.T @ ROBOT.gravity(Q), atol=1e-12)


def test_wanted_forces_go_by_the_transposed_jacobian():
    f_W = np.zeros((5, 3))
    f_W[TH_MF] = [[2.0, 0.1, -1.0], [-2.0, 0.0, -1.0]]
    rest = torque(grip(), NO_EFFORT, held())
    pressing = torque(grip(), Effort(np.zeros(6), f_W, np.zeros(6)), held())
    J = contact_jacobian(ROBOT.fingertips(Q), ROWS, held().c_W[ROWS])
    np.testing.assert_allclose(pressing - rest, J.T @ f_W[ROWS].ravel(), atol=1e-12)


def test_a_finger_let_go_at_no_force_feels_no_jump():
    gripping = torque(grip(share=np.where(TH_MF, 0.0, 0.0)), NO_EFFORT, held())
    free = torque(goal_of(q_free=Q, q_guide=Q), NO_EFFORT, held())
    np.testing.assert_allclose(gripping, free, atol=1e-12)


def test_a_free_finger_is_driven_towards_its_posture_and_the_others_are_not():
    target = Q.copy()
    drives = FINGER_DRIVES[1]
    target[DRIVEN_INDEX[drives]] += 0.05
    tau = torque(goal_of(q_free=target, q_guide=Q), NO_EFFORT, held())
    more = tau - SELECTION.T @ ROBOT.gravity(Q)
    assert (more[drives] > 0.0).all()
    others = [drives for row, drives in enumerate(FINGER_DRIVES) if row != 1]
    # a finger's acceleration is felt by the arm that carries it, and by no finger
    assert np.abs(more[np.concatenate(others)]).max() < 1e-3 * np.abs(more[drives]).max() + 2e-3


def test_a_feeling_finger_is_told_no_further_ahead_than_its_push():
    approach = np.zeros((5, 3))
    approach[1] = [0.0, 0.015, 0.0]
    goal = goal_of(roles=np.array([0, Role.REACH, 0, 0, 0]), approach=approach, q_free=Q, q_guide=Q)
    state, drives, estimate = ADAPTER.init(Q), FINGER_DRIVES[1], held()
    for _ in range(1000):
        state, _ = ADAPTER.update(state, goal, NO_EFFORT, estimate, DT)
    J = (ROBOT.fingertips(Q).J[1, :3] @ SELECTION)[:, drives]
    ahead = np.linalg.norm(J @ (state.q - Q[DRIVEN_INDEX])[drives])
    # one beat of 15 mm/s beyond the leash
    assert ADAPTER.postures.push <= ahead <= ADAPTER.postures.push + 0.015 * DT * 1.5


def test_moving_the_palm_moves_arm_and_wrist_only():
    V = np.array([0.003, -0.004, 0.002, 0.01, -0.02, 0.03])
    state, _ = ADAPTER.update(ADAPTER.init(Q), grip(V_palm=V), NO_EFFORT, held(), DT)
    moved = (state.q - Q[DRIVEN_INDEX]) / DT
    # 1e-6 of damping beside the least of J^T J's values, .05^2 m2
    np.testing.assert_allclose(ROBOT.palm_jacobian(Q) @ SELECTION @ moved, V, atol=5e-5)
    np.testing.assert_allclose(moved[PALM.stop :], 0.0, atol=1e-12)


def test_torques_stay_within_the_drives_and_say_so():
    f_W = np.zeros((5, 3))
    f_W[TH_MF] = [[60.0, 0.0, 0.0], [-60.0, 0.0, 0.0]]
    _, command = ADAPTER.update(ADAPTER.init(Q), grip(), Effort(np.zeros(6), f_W, np.zeros(6)), held(), DT)
    assert (np.abs(command.tau) <= DRIVE_LIMITS).all()
    assert command.saturated.any()
    np.testing.assert_array_equal(np.abs(command.tau[command.saturated]), DRIVE_LIMITS[command.saturated])


@pytest.mark.parametrize("joint", [0, 5])
def test_an_arm_pushed_aside_is_brought_back(joint):
    pushed = Q.copy()
    pushed[joint] += 0.01
    estimate = replace(held(), q=pushed)
    tau = torque(goal_of(q_free=Q, q_guide=Q), NO_EFFORT, estimate)
    assert (tau - SELECTION.T @ ROBOT.gravity(pushed))[joint] < 0.0
