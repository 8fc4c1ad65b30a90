"""Soft stops: what they leave alone, what they hold, and that they come to rest."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.actuate.position import STOP as SERVO_STOP
from turnscrew.actuate.postures import CARRIERS
from turnscrew.actuate.stops import Stops
from turnscrew.actuate.torque import STOP
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.model import RobotModel
from turnscrew.robot.servos import FINGER_DAMPING, FINGER_STIFFNESS

ROBOT = RobotModel()
STOPS = Stops(ROBOT.limits, STOP)
LOW, HIGH = ROBOT.limits[DRIVEN_INDEX].T
FIRST = CARRIERS
"""Drive of a finger's sideways joint."""


def at(driven):
    q = np.zeros(28)
    q[DRIVEN_INDEX] = driven
    return q


def test_joints_away_from_their_limits_are_left_alone():
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = at(rng.uniform(LOW + STOPS.depth, HIGH - STOPS.depth))
        np.testing.assert_array_equal(STOPS.pushed_back(q, np.zeros(28)), np.zeros(24))


@pytest.mark.parametrize(("limit", "inward"), [(LOW, 1.0), (HIGH, -1.0)])
def test_a_spring_pushes_the_fingers_back_into_their_ranges(limit, inward):
    for depth in (0.5, 1.0, 1.5):
        push = STOPS.pushed_back(at(limit + (1.0 - depth) * STOPS.depth * inward), np.zeros(28))
        np.testing.assert_allclose(push[CARRIERS:], depth * STOP * STOPS.depth * inward)
        # arm and wrist are kept off theirs by the plans
        np.testing.assert_array_equal(push[:CARRIERS], np.zeros(CARRIERS))


def test_a_joint_is_pushed_back_sooner_on_its_way_to_a_limit_and_not_on_its_way_from_it():
    q, v = at(HIGH - 2.0 * STOPS.depth), at(np.full(24, 2.0))
    np.testing.assert_allclose(STOPS.pushed_back(q, v)[CARRIERS:], -STOP * (2.0 * STOPS.ahead - STOPS.depth))
    np.testing.assert_array_equal(STOPS.pushed_back(q, -v), np.zeros(24))
    q = at(LOW + 0.5 * STOPS.depth)
    np.testing.assert_allclose(STOPS.pushed_back(q, v), STOPS.pushed_back(q, np.zeros(28)))


def pressed(stiffness, late, servo, tau):
    """Angles within a second of a finger's sideways joint that is pressed towards its limit, from 3 deg before it.

    Of its servo, stiffness and damping, at the plant's step; what the stops do comes late by so many steps.
    """
    dt, inertia = 0.001, ROBOT.dynamics(at(0.5 * (LOW + HIGH)), np.zeros(28)).M[FIRST, FIRST]
    stops, damping = Stops(ROBOT.limits, stiffness), ROBOT.damping[DRIVEN_INDEX[FIRST]] + servo[1]
    start = HIGH[FIRST] - np.radians(3.0)
    q, v, angles, speeds = start, 0.0, [start] * (late + 1), [0.0] * (late + 1)
    for _ in range(1000):
        felt = at(np.where(np.arange(24) == FIRST, angles[-1 - late], 0.5 * (LOW + HIGH)))
        back = stops.pushed_back(felt, at(np.where(np.arange(24) == FIRST, speeds[-1 - late], 0.0)))[FIRST]
        v += dt / inertia * (tau + back - servo[0] * (q - start) - damping * v)
        q += dt * v
        angles.append(q)
        speeds.append(v)
    return np.array(angles)


@pytest.mark.parametrize(
    ("stiffness", "late", "servo"),
    [(STOP, 7, (0.0, 0.0)), (SERVO_STOP, 15, (FINGER_STIFFNESS, FINGER_DAMPING))],
)
def test_a_joint_that_is_pressed_rests_before_its_limit(stiffness, late, servo):
    # what brings it to the limit without stops, and three fifths of what these hold there
    alone = servo[0] * np.radians(3.0)
    tau = alone + 0.6 * stiffness * STOPS.depth
    angles = pressed(stiffness, late, servo, tau)
    assert angles[-1] < HIGH[FIRST]
    # a hundredth of a degree, five times less than an encoder tells
    assert np.ptp(angles[-200:]) < np.radians(0.01)
    assert pressed(0.0, late, servo, tau).max() > HIGH[FIRST]
