"""Edges: how they are searched for, and those of a real grasp."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from turnscrew.plant.snapshot import Plant
from turnscrew.study.stability.edges import Prediction, growth_rate, measured_growth, one_period, one_ratio, search
from turnscrew.study.stability.held_grasp import HeldGrasp, random_kick
from turnscrew.study.stability.study import QUIET, agrees
from turnscrew.task.scenario import load

SEED = 777104
PERIOD = 0.002


@pytest.mark.parametrize("start", [0.0, 3.0, 9.0])
def test_an_edge_is_found_from_either_side(start):
    found = search(lambda n: n - 4.3, start, one_period, 20)
    assert found.at == pytest.approx(4.3)
    assert [value for value, _ in found.trials] == sorted(value for value, _ in found.trials)


def test_no_edge_is_no_number():
    assert np.isnan(search(lambda n: 1.0, 3.0, one_period, 20).at)
    assert np.isnan(search(lambda n: -1.0, 3.0, one_period, 5).at)


def test_gains_are_tried_in_ratios():
    found = search(lambda g: g - 2.0, 1.0, one_ratio, 20)
    assert found.at == pytest.approx(2.0)


@pytest.mark.parametrize("rate", [-3.0, 0.5, 4.0])
def test_growth_is_the_slope_of_a_swing(rate):
    t = PERIOD * np.arange(800)
    swing = np.exp(rate * t)[:, None] * np.column_stack([np.sin(20 * t), np.cos(20 * t)])
    # sine and cosine together have no ripple
    assert growth_rate(swing, PERIOD) == pytest.approx(rate, abs=1e-6)


def test_what_breaks_off_counts_as_growth():
    assert growth_rate(np.ones((100, 3)), PERIOD) > 0.0


def test_agreement_is_a_period_or_a_quarter():
    assert agrees({"moved": "delay", "predicted": 7.0, "measured": 7.9})
    assert not agrees({"moved": "delay", "predicted": 7.0, "measured": 8.1})
    assert agrees({"moved": "gain", "predicted": 2.0, "measured": 2.4})
    assert not agrees({"moved": "gain", "predicted": 2.0, "measured": float("nan")})


@pytest.fixture(scope="module")
def grasp() -> HeldGrasp:
    return HeldGrasp.of(load(None, list(QUIET), SEED), "roll", radians(20.0))


def test_a_state_put_back_goes_on_to_the_last_bit(grasp):
    plant: Plant = grasp.plant
    torques = np.zeros(24)
    plant.put(grasp.snapshot)
    one = plant.steps(torques, 20)
    plant.put(grasp.snapshot)
    other = plant.steps(torques, 20)
    np.testing.assert_array_equal(one.qpos, other.qpos)
    np.testing.assert_array_equal(one.qvel, other.qvel)


def test_moves_and_differences_are_inverse(grasp):
    plant, by = grasp.plant, np.random.default_rng(3).normal(size=2 * grasp.plant.freedoms + 1) * 1e-3
    # a rotation vector of 1e-3 through a quaternion and back, in doubles
    np.testing.assert_allclose(plant.difference(grasp.snapshot, plant.moved(grasp.snapshot, by)), by, atol=1e-12)


def test_two_reactions_to_the_same_are_the_same(grasp):
    one, other = (grasp.react(2, random_kick(1), 0.1).speeds for _ in range(2))
    np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_a_swing_decays_inside_the_predicted_edge_and_grows_beyond(grasp):
    edge = Prediction.of(grasp).delay_edge().at
    # two periods on either side: twice what they differ by for two fingers and the default gains, on two other seeds
    assert measured_growth(grasp, int(edge) - 2, 1.0, 5) < 0.0
    assert measured_growth(grasp, int(edge) + 3, 1.0, 5) > 0.0
    kept = grasp.react(int(edge) - 2, random_kick(5), 1.0)
    assert kept.holding == 2
    # a disturbance of .3 rad/s in each joint leans the tool by tenths of a degree
    assert np.degrees(kept.tilt) < 1.0
