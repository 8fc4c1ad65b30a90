"""Force sensors that hang: seen by their repeating themselves, never at a sensor at work, and done without."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.messages import ANGLES

from turnscrew.estimate.hung_force import HungForce, HungState
from turnscrew.robot.coupling import DRIVE
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import Measurement

TH, FF, MF, RF, LF = range(5)
DT = 0.01
N = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(5)])
AXIS = np.array([0.0, 0.0, 1.0])
UPRIGHT = np.tile(np.eye(3), (5, 1, 1))


def reading(f_F: np.ndarray | None = None, tau: np.ndarray | None = None) -> Measurement:
    return Measurement(0.0, np.zeros(28), np.zeros(28), f_F, tau, None, "")


def after(readings: list[Measurement]) -> HungState:
    block = HungForce()
    state = block.init(readings[0])
    for measurement in readings[1:]:
        state = block.update(state, measurement, DT)
    return state


def test_only_the_sensor_that_repeats_itself_hangs_and_only_while_it_does() -> None:
    rng = np.random.default_rng(0)
    forces = rng.normal(size=(12, 5, 3))
    forces[:, LF] = 0.0
    forces[2:10, MF] = forces[2, MF]
    # five equal readings after the first of them: the fifth tick is the first to know
    found = [HungForce().hung(after([reading(f) for f in forces[: n + 1]]))[MF] for n in range(12)]
    assert found == [False] * 7 + [True] * 3 + [False] * 2
    # the little finger touches nothing and reads zero throughout
    assert not np.delete(HungForce().hung(after([reading(f) for f in forces[:10]])), MF).any()


def test_gauges_hang_finger_by_finger() -> None:
    torques = np.random.default_rng(1).normal(size=(8, 24))
    drives = [DRIVE[name] for name in ("FFJ2", "FFJ3", "FFJ4")]
    torques[:, drives] = torques[0, drives]
    hung = HungForce().hung(after([reading(tau=tau) for tau in torques]))
    assert [name for name, is_hung in zip(FINGERS, hung, strict=True) if is_hung] == ["FF"]


def believed(f_F: np.ndarray, hung: list[int], gap: float) -> np.ndarray:
    same = np.zeros(5)
    same[hung] = 1.0
    return HungForce().believed(HungState(np.zeros((5, 3)), same), f_F, UPRIGHT, np.full(5, gap), N, AXIS)


def test_hung_finger_presses_as_the_one_opposite() -> None:
    rng = np.random.default_rng(2)
    f_F = rng.normal(size=(5, 3))
    out = believed(f_F, [TH], 0.0)
    other = np.cross(AXIS, N)
    for direction in (N, np.tile(AXIS, (5, 1)), other):
        # rounding of three products
        assert out[TH] @ direction[TH] == pytest.approx(f_F[MF] @ direction[MF], abs=1e-12)
    assert np.array_equal(np.delete(out, TH, axis=0), np.delete(f_F, TH, axis=0))


def test_hung_finger_off_the_handle_does_not_touch() -> None:
    f_F = np.ones((5, 3))
    assert not believed(f_F, [MF], 0.002)[MF].any()
    assert believed(f_F, [], 0.002) is f_F


def test_two_that_hang_opposite_each_other_keep_what_they_say() -> None:
    f_F = np.arange(15.0).reshape(5, 3)
    assert np.array_equal(believed(f_F, [FF, RF], 0.0), f_F)
