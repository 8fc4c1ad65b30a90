"""Torques while the tip is out: fingers on springs, arm and wrist as they are held anyway."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
from rigs.grips import planned
from rigs.messages import goal_of

from turnscrew.actuate.position import PositionAdapter
from turnscrew.actuate.postures import CARRIERS, FINGER_DRIVES, PALM
from turnscrew.actuate.sprung import SprungAdapter
from turnscrew.actuate.torque import TorqueAdapter
from turnscrew.decide.plans import plan_for
from turnscrew.estimate.between_ticks import BetweenTicks
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import FINGERS
from turnscrew.robot.model import RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.robot.servos import STIFFNESSES
from turnscrew.signals import Effort, Role

ROBOT = RobotModel()
SEATED, POSITIONS = TorqueAdapter(ROBOT), PositionAdapter(ROBOT)
TICK = 0.01
ADAPTER = SprungAdapter(SEATED, POSITIONS, TICK)
PLAN = plan_for(0.018)
Q = PLAN.rolling(0.3)
DT = 0.002
TH_MF = np.array([finger in ("TH", "MF") for finger in FINGERS])
HELD = planned(Q)
F_W = np.zeros((5, 3))
F_W[TH_MF] = [[3.0, 0.5, -2.0], [-3.0, -0.4, -2.0]]
PRESS = Effort(np.zeros(6), F_W, np.zeros(6))


def grip(**changes):
    return goal_of(roles=np.where(TH_MF, Role.GRIP, Role.FREE), q_free=Q, q_guide=Q, **changes)


CARRY = grip(tip_free=True)


def test_with_the_tip_in_its_drive_nothing_is_different():
    _, expected = SEATED.update(SEATED.init(Q), grip(), PRESS, HELD, DT)
    state, command = ADAPTER.update(ADAPTER.init(Q), grip(), PRESS, HELD, DT)
    np.testing.assert_array_equal(command.tau, expected.tau)
    assert state.rest is None


def test_fingers_begin_with_the_forces_that_are_wanted():
    _, command = ADAPTER.update(ADAPTER.init(Q), CARRY, PRESS, HELD, DT)
    J = ROBOT.contact_jacobians(HELD.q, HELD.v, HELD.c_W)
    wanted = ROBOT.dynamics(HELD.q, HELD.v).bias + np.einsum("ki,kij->j", F_W, J)
    # nothing has moved, and a posture at rest asks for no acceleration
    np.testing.assert_allclose(command.tau, np.clip(wanted, -DRIVE_LIMITS, DRIVE_LIMITS), atol=1e-9)


def test_a_finger_that_gives_way_is_pushed_back_as_by_its_servo():
    bent = np.zeros(len(Q))
    bent[DRIVEN_INDEX[CARRIERS:]] = 0.01
    state, before = ADAPTER.update(ADAPTER.init(Q), CARRY, PRESS, HELD, DT)
    # the encoders alone tell of it, so gravity and contacts are what they were
    _, after = ADAPTER.update(state, CARRY, PRESS, replace(HELD, offset=bent), DT)
    drives = np.concatenate([FINGER_DRIVES[row] for row in np.flatnonzero(TH_MF)])
    # within 1 %: the thumb, which has a joint to spare, is guided back to the plan's posture at 4/s
    np.testing.assert_allclose((after.tau - before.tau)[drives], -0.01 * STIFFNESSES[drives], rtol=0.01)


def test_arm_and_wrist_are_carried_with_the_palm():
    moving = replace(CARRY, V_palm=np.array([0.0, 0.0, 0.02, 0.0, 0.0, 0.0]))
    state = ADAPTER.init(Q)
    for _ in range(10):
        state, _ = ADAPTER.update(state, moving, PRESS, HELD, DT)
    J = ROBOT.palm_jacobian(Q)[:, PALM]
    risen = J @ (state.posture.q - Q[DRIVEN_INDEX])[PALM]
    # straight up by 20 mm/s, as far as the damped inverse has it
    np.testing.assert_allclose(risen[:3], [0.0, 0.0, 10 * DT * 0.02], atol=2e-6)


def test_springs_are_set_once_a_tick():
    firmer = replace(PRESS, f_W=2.0 * F_W)
    state, _ = ADAPTER.update(ADAPTER.init(Q), CARRY, PRESS, HELD, DT)
    between, _ = ADAPTER.update(state, CARRY, firmer, HELD, DT)
    np.testing.assert_array_equal(between.pulled, state.pulled)
    later, _ = ADAPTER.update(between, CARRY, firmer, replace(HELD, time=HELD.time + TICK), DT)
    assert np.abs(later.pulled - state.pulled).max() > 0.01


def test_springs_end_with_the_tip_back():
    state, _ = ADAPTER.update(ADAPTER.init(Q), CARRY, PRESS, HELD, DT)
    assert state.rest is not None
    state, _ = ADAPTER.update(state, grip(), PRESS, HELD, DT)
    assert state.rest is None


def test_the_arm_comes_to_rest_with_what_is_told_and_sent_late():
    # a joint that obeys at once what it is told, 3 ms late, and tells where it is as between ticks
    between, gains = BetweenTicks(ROBOT, 0.0007), ADAPTER.postures.arm
    joint, v, ways = Q.copy(), 0.0, []
    joint[0] += 0.001
    track, sent = between.init(joint), deque([0.0, 0.0])
    for _ in range(300):
        track = between.read(track, joint, DT, tip_free=True)
        sent.append(gains.kp * (Q[0] - track.q[0]) - gains.kv * track.v[0])
        v += DT * sent.popleft()
        joint[0] += DT * v
        ways.append(joint[0] - Q[0])
    # the slowest pole, at 21/s, leaves .0018 of the way after .3 s, and covers the swing, damped by .77 of critical
    assert min(ways) > -0.01 * 0.001
    assert np.abs(ways[150:]).max() < 0.005 * 0.001
