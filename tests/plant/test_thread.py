"""The thread only resists, and takes the screw in by its pitch."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs.cells import cell

from turnscrew.plant.thread import PRESLIDING, Thread

DT = 1e-3


def play(thread: Thread, yaw: np.ndarray) -> np.ndarray:
    """Torques along a prescribed motion sampled at DT."""
    twist, torques = thread.init(), []
    for before, now in pairwise(yaw):
        twist, torque = thread.update(twist, float(now), float(now - before) / DT, DT)
        torques.append(torque)
    return np.array(torques)


def test_an_elastic_thread_pulls_back_by_its_stiffness():
    thread = Thread("elastic", 0.03, 0.02, 0.0, 1.0)
    assert thread.update(0.0, -2.0, 5.0, DT) == (0.0, 0.06)


def test_a_self_locking_thread_resists_with_prevailing_then_clamping_then_seat_torque():
    thread = Thread("self-locking", 0.1, 0.02, 1.0, 0.15)
    torque = play(thread, np.linspace(0.0, -4.0, 4001))
    for turned, expected in ((0.5, 0.02), (1.5, 0.07), (3.0, 0.15)):
        assert torque[round(turned * 1000) - 1] == pytest.approx(expected, abs=1e-4)  # a step turns it by 1e-3 rad


def test_a_self_locking_thread_holds_when_let_go():
    thread = Thread("self-locking", 0.1, 0.02, 0.0, 1.0)
    there = np.linspace(0.0, -1.0, 1001)
    back = np.linspace(-1.0, -1.0 + 2.5 * PRESLIDING, 101)
    torque = play(thread, np.concatenate([there, back]))
    assert torque[999] > 0.1
    assert torque[-1] < -0.1  # turned back by more than the elastic twist, it resists that too


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-0.02, 0.02), min_size=10, max_size=200), st.sampled_from(["elastic", "self-locking"]))
def test_no_closed_motion_gains_energy_from_the_thread(steps, law):
    thread = Thread(law, 0.05, 0.02, 0.0, 1.0)
    # a motion that turns in and returns to where it began, by any path below the start
    yaw = -np.abs(np.cumsum([0.0, *steps]))
    yaw = np.concatenate([yaw, np.linspace(yaw[-1], 0.0, 200)])
    work = float(play(thread, yaw) @ np.diff(yaw))
    # backward Euler overstates an elastic law's work by at most k/2 sum(dyaw^2); the stick keeps at most its energy
    assert work <= 0.05 / 2 * float((np.diff(yaw) ** 2).sum()) + 0.5 * 0.15 * PRESLIDING


def test_the_screw_sinks_by_its_pitch_and_stays_on_its_helix_under_thrust():
    plant = cell()
    data = plant.data
    hinge = plant.model.joint("screw").dofadr[0]
    slide = plant.model.joint("screw_advance").dofadr[0]
    data.qpos[plant.model.joint("tool").qposadr[0] + 2] += 0.5  # the tool is out of the way
    data.qfrc_applied[hinge], data.qfrc_applied[slide] = -2.0, -10.0
    for _ in range(400):
        plant.prepare()
        mujoco.mj_step(plant.model, data)
    yaw = float(data.qpos[plant.model.joint("screw").qposadr[0]])
    z = float(data.qpos[plant.model.joint("screw_advance").qposadr[0]])
    assert yaw < -2 * np.pi * 5  # past where the head meets the drawn substrate, which is not a second seat
    # one micrometre: the helix's stiffness under 10 N
    assert z == pytest.approx(0.0007 * yaw / (2 * np.pi), abs=1e-6)
