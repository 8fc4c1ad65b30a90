"""How far to roll where the thread gets tighter: what the pair holds, shared out over the rounds that are left."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.decide.stroke_budget import StrokeBudget, growth_of, pinch_torque

FULL = np.radians(54.0)


def driven(budget, law, friction_error=lambda stroke: 1.0):
    """Strokes and torques of all rounds against a thread whose torque is `law(theta)`, each end as it is read."""
    theta, ends, strokes = 0.0, (), []
    for made in range(budget.rounds):
        strokes.append(budget.stroke(FULL, made, ends))
        theta += strokes[-1]
        ends = (*ends, (theta, law(theta) * friction_error(made)))
    return np.array(strokes), law(theta)


@pytest.mark.parametrize("stiffness", [0.008, 0.010, 0.012])
@pytest.mark.parametrize("rounds", [10, 20])
def test_against_a_spring_the_last_round_ends_within_what_is_held(stiffness, rounds):
    budget = StrokeBudget(rounds, torque=0.147)
    strokes, torque = driven(budget, lambda theta: stiffness * theta)
    least = stiffness * (2 * FULL + (rounds - 2) * budget.least)
    # two strokes tell how stiff the thread is; from there on no round is longer than it may be, nor vainly short
    assert torque <= max(budget.torque, least) + 1e-9
    assert strokes.min() >= budget.least - 1e-12
    assert strokes.max() <= FULL


def test_what_is_left_is_shared_evenly():
    strokes, torque = driven(StrokeBudget(20, torque=0.15), lambda theta: 0.012 * theta)
    assert np.ptp(strokes[2:]) < 1e-9
    assert torque == pytest.approx(0.15)


def test_friction_that_does_not_grow_leaves_strokes_full_however_the_first_ends_are_read():
    # read as 30 % too much or too little, now so and now otherwise
    read = np.random.default_rng(3).uniform(0.7, 1.3, 20)
    strokes, _ = driven(StrokeBudget(20, torque=0.147), lambda theta: 0.05, lambda made: read[made])
    assert np.mean(strokes == FULL) > 0.7
    assert strokes.mean() > 0.9 * FULL


def test_growth_is_a_springs_whatever_share_of_it_is_read():
    for share in (0.5, 1.0, 1.5):
        ends = [(theta, share * 0.01 * theta) for theta in (0.9, 1.8, 2.7)]
        assert growth_of(ends) == pytest.approx(share * 0.01)
    assert growth_of([]) == growth_of([(0.9, 0.02)]) == 0.0
    # of two estimates the lower one: a preload that is there from the start does not grow
    assert growth_of([(0.9, 0.05), (1.8, 0.05), (2.7, 0.05)]) == pytest.approx(0.0, abs=1e-15)
    # a screw that has not moved tells nothing
    assert growth_of([(0.9, 0.01), (0.9, 0.03)]) == 0.0


def test_a_spring_counts_in_proportion_to_its_angle():
    budget, ends = StrokeBudget(20, torque=0.15), ((0.9, 0.030), (1.8, 0.032))
    # by their slope they would hardly grow, from nothing to the last they do by .0178 N.m/rad
    assert budget.stroke(FULL, 2, ends) == FULL
    wary = budget.stroke(FULL, 2, ends, spring=ends)
    assert wary == pytest.approx(max((0.15 - 0.032) / (0.032 / 1.8 * 18), budget.least))
    # one that is read too low at rest makes no stroke longer
    steep = ((0.9, 0.040), (1.8, 0.080))
    assert budget.stroke(FULL, 18, steep, spring=((0.9, 0.0), (1.8, 0.01))) == budget.stroke(FULL, 18, steep)
    # one stroke alone tells nothing
    assert budget.stroke(FULL, 1, ends[:1], spring=ends[:1]) == FULL


def test_once_all_rounds_are_made_strokes_are_full():
    assert StrokeBudget(5, torque=0.05).stroke(FULL, 5, ((0.9, 0.04), (1.8, 0.08))) == FULL


def test_a_plan_with_less_than_the_least_stroke_keeps_its_own():
    assert StrokeBudget(20, torque=0.01).stroke(0.3, 2, ((0.3, 0.02), (0.6, 0.04))) == 0.3


def test_a_pinch_turns_with_what_friction_the_thrust_leaves():
    # a fingertip's tangential force has two parts at right angles, and mu N for both
    r, mu, N, thrust = 0.018, 0.7, 9.0, 5.0
    tangential = pinch_torque(r, mu, N, thrust) / (2 * r)
    assert np.hypot(tangential, thrust / 2) == pytest.approx(mu * N)
    assert pinch_torque(r, 0.2, 4.0, 5.0) == 0.0
