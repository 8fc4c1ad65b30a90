"""Position commands: the servo, bent by the load, does what the contacts are to do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.messages import estimate_of, goal_of

from turnscrew.actuate.position import DRIVEN_INDEX, PositionAdapter
from turnscrew.decide.plans import plan_for
from turnscrew.geometry.closest import closest_points
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import log_so3
from turnscrew.robot.joints import DRIVEN, FINGERS, finger_joints
from turnscrew.robot.model import RobotModel, driven_jacobian
from turnscrew.robot.servos import STIFFNESSES
from turnscrew.signals import Effort, Role

ROBOT = RobotModel()
ADAPTER = PositionAdapter(ROBOT)
PLAN = plan_for(0.018)
Q = PLAN.rolling(0.3)
DT = 0.005
TH_MF = np.array([finger in ("TH", "MF") for finger in FINGERS])
NO_EFFORT = Effort(np.zeros(6), np.zeros((5, 3)), np.zeros(6))


def held(q=Q):
    """The plan's tool with contacts at its fingertips."""
    tips = ROBOT.fingertips(q)
    points = [
        closest_points(Cylinder(0.018, 0.075, 0.175), Capsule(tips.rho[i], tips.length[i]), PLAN.p_WS, np.eye(3),
                       tips.p_WF[i], tips.R_WF[i])
        for i in range(5)
    ]  # fmt: skip
    return estimate_of(
        q=q, p_WT=PLAN.p_WS, c_W=np.array([p.c_W for p in points]), n_W=np.array([p.n_W for p in points])
    )


def update(goal, effort, estimate=None, state=Q, offset=None):
    estimate = estimate or held()
    estimate = estimate if offset is None else replace(estimate, offset=offset)
    return ADAPTER.update(state, goal, effort, estimate, DT)


def grip(**changes):
    return goal_of(roles=np.where(TH_MF, Role.GRIP, Role.FREE), q_free=Q, q_guide=Q, **changes)


def test_what_is_commanded_is_what_the_servos_press():
    f_W = np.zeros((5, 3))
    f_W[TH_MF] = [[3.0, 0.5, -2.0], [-3.0, -0.4, -2.0]]
    estimate = held()
    _, command = update(grip(), Effort(np.zeros(6), f_W, np.zeros(6)))
    _, rest = update(grip(), NO_EFFORT)
    torque = (command.q - rest.q) * STIFFNESSES
    tips = ROBOT.fingertips(Q)
    J = driven_jacobian(tips.J)
    expected = np.zeros(28)
    for row in np.flatnonzero(TH_MF):
        arm = estimate.c_W[row] - tips.p_WF[row]
        expected += (J[row, :3] + np.cross(J[row, 3:].T, arm).T).T @ f_W[row]
    np.testing.assert_allclose(torque, expected[DRIVEN_INDEX], atol=1e-9)


def test_the_contacts_move_with_the_reference():
    nu_d = np.array([0.0, 0.0, 1e-4, 0.01, -0.02, -1.0])
    estimate = held()
    state, _ = update(grip(), Effort(nu_d, np.zeros((5, 3)), np.zeros(6)))
    tips = ROBOT.fingertips(Q)
    J = driven_jacobian(tips.J)
    for row in np.flatnonzero(TH_MF):
        arm = estimate.c_W[row] - tips.p_WF[row]
        J_c = J[row, :3] + np.cross(J[row, 3:].T, arm).T
        wanted = nu_d[:3] + np.cross(nu_d[3:], estimate.c_W[row] - estimate.p_WT)
        got = J_c @ (state - Q) / DT
        # the damping of the inverse Jacobian, a tenth of the least lever, costs up to (2/20)^2 of the speed
        assert np.linalg.norm(got - wanted) < 0.02 * np.linalg.norm(wanted)


@pytest.mark.parametrize(("tip_free", "locked", "forgets"), [(True, False, 1), (True, True, 0), (False, False, 0)])
def test_what_a_search_has_bent_fingers_by_is_forgotten_in_the_air(tip_free, locked, forgets):
    bent = np.zeros(28)
    joints = list(finger_joints("MF"))
    bent[joints] = 0.03
    state, ticks = Q + bent, 40
    for _ in range(ticks):
        state, _ = update(grip(tip_free=tip_free, locked=locked), NO_EFFORT, state=state)
    left = (1.0 - DT / ADAPTER.settling) ** (ticks * forgets)
    driven = [joint for joint in joints if joint in DRIVEN_INDEX]
    np.testing.assert_allclose((state - Q)[driven], left * bent[driven], rtol=1e-9)


def test_moving_the_palm_leaves_gripping_fingertips_where_they_are():
    V = np.array([0.003, -0.004, 0.002, 0.01, -0.02, 0.03])
    state, _ = update(grip(V_palm=V), NO_EFFORT)
    before, after = ROBOT.fingertips(Q), ROBOT.fingertips(state)
    (p, R), (p_before, R_before) = ROBOT.palm(state), ROBOT.palm(Q)
    # 1e-6 of damping beside the least of J^T J's values, .05^2 m2
    np.testing.assert_allclose((p - p_before) / DT, V[:3], atol=5e-5)
    np.testing.assert_allclose(log_so3(R @ R_before.T) / DT, V[3:], atol=5e-5)
    for row in np.flatnonzero(TH_MF):
        in_tip = before.R_WF[row].T @ (held().c_W[row] - before.p_WF[row])
        moved = (after.p_WF[row] + after.R_WF[row] @ in_tip - held().c_W[row]) / DT
        # the damping costs (2/20)^2 of the motion at the thumb's least lever of 20 mm
        assert np.linalg.norm(moved) < 0.02 * np.linalg.norm(V[:3])


def test_a_finger_that_feels_for_the_handle_moves_at_its_speed():
    approach = np.zeros((5, 3))
    approach[1] = [0.0, 0.015, 0.0]
    goal = goal_of(roles=np.array([0, Role.REACH, 0, 0, 0]), approach=approach, q_free=Q, q_guide=Q)
    state, _ = update(goal, NO_EFFORT)
    moved = (ROBOT.fingertips(state).p_WF - ROBOT.fingertips(Q).p_WF) / DT
    np.testing.assert_allclose(moved[1], approach[1], atol=5e-4)
    np.testing.assert_allclose(moved[[0, 2, 3]], 0.0, atol=1e-9)


def test_free_fingers_go_where_they_are_sent_no_faster_than_their_drives():
    target = Q.copy()
    target[list(DRIVEN_INDEX)] += np.where(np.arange(len(DRIVEN)) < 6, 0.0, -0.1)
    state, _ = update(goal_of(q_free=target, q_guide=Q), NO_EFFORT)
    step = np.abs(state - Q)
    assert step.max() == pytest.approx(ADAPTER.speed * DT)


def test_commands_speak_the_encoders_language():
    offset = np.zeros(28)
    offset[DRIVEN_INDEX[6:]] = 0.01
    state = Q + offset
    moved, _ = update(goal_of(q_free=Q, q_guide=Q), NO_EFFORT, state=state, offset=offset)
    np.testing.assert_allclose(moved[DRIVEN_INDEX], state[DRIVEN_INDEX], atol=1e-12)


def test_commands_stay_inside_the_joint_ranges():
    f_W = np.zeros((5, 3))
    f_W[TH_MF] = [[300.0, 0.0, 0.0], [-300.0, 0.0, 0.0]]
    _, command = update(grip(), Effort(np.zeros(6), f_W, np.zeros(6)))
    low, high = ROBOT.limits[DRIVEN_INDEX].T
    assert (command.q >= low).all()
    assert (command.q <= high).all()
    assert command.saturated.any()
