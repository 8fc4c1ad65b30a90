"""Edges: how they are searched for, and those of a real grasp."""

from __future__ import annotations

from math import ceil, floor, radians

import numpy as np
import pytest

from turnscrew.plant.snapshot import Plant
from turnscrew.robot.coupling import SELECTION
from turnscrew.robot.joints import ARM, DRIVEN
from turnscrew.study.stability.edges import Prediction, growth_rate, measured_growth, one_period, one_ratio, search
from turnscrew.study.stability.held_grasp import KICK, HeldGrasp, random_kick
from turnscrew.study.stability.study import CASES, QUIET, agrees, parts
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
    one, other = (grasp.react(2, random_kick(np.random.default_rng(1)), 0.1).speeds for _ in range(2))
    np.testing.assert_array_equal(one, other)


def test_a_kick_is_of_one_size_in_all_joints_of_the_hand():
    kick = random_kick(np.random.default_rng(2))
    np.testing.assert_allclose(np.abs(kick[len(ARM) :]), KICK)
    # twenty coins do not all fall on the same side
    assert abs(kick[len(ARM) :].sum()) < 20 * KICK


def test_each_case_has_a_kick_of_its_own(tmp_path):
    todo = parts([], SEED, with_map=True, out=tmp_path)
    kicks = {tuple(part.kick) for part in todo if part.case.moved != "map"}
    assert len(kicks) == len(CASES)
    assert len({part.file for part in todo}) == len(CASES) + 1


def test_a_kick_moves_speeds_alone_and_coupled_joints_together(grasp):
    kick = random_kick(np.random.default_rng(2))
    moved = grasp.plant.moved(grasp.snapshot, grasp.kicked(kick))
    np.testing.assert_array_equal(moved.qpos, grasp.snapshot.qpos)
    # a sum and a difference of doubles below 1
    np.testing.assert_allclose(moved.qvel[:28] - grasp.snapshot.qvel[:28], SELECTION @ kick, atol=1e-15)


def test_a_coupled_pair_rubs_in_both_joints(grasp):
    force = dict(zip(DRIVEN, grasp.friction.force, strict=True))
    assert force["FFJ2"] == pytest.approx(2 * force["FFJ3"])
    assert force[ARM[0]] == 0.0


def test_dry_friction_is_gone_only_for_a_while(grasp):
    before = grasp.plant.dry_friction
    with grasp.plant.without_dry_friction():
        assert not grasp.plant.dry_friction.any()
    np.testing.assert_array_equal(grasp.plant.dry_friction, before)
    assert before.any()


@pytest.mark.slow
def test_a_swing_decays_inside_the_predicted_edge_and_grows_beyond(grasp):
    kick = random_kick(np.random.default_rng(5))
    edge = Prediction.of(grasp).delay_edge(kick).at
    # a control period on either side
    inside, outside = floor(edge) - 1, ceil(edge) + 1
    assert measured_growth(grasp, inside, 1.0, kick) < 0.0
    assert measured_growth(grasp, outside, 1.0, kick) > 0.0
    kept = grasp.react(inside, kick, 1.0)
    assert kept.holding == 2
    # a disturbance of .3 rad/s in each joint leans the tool by tenths of a degree
    assert np.degrees(kept.tilt) < 1.0
