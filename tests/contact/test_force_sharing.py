"""The program that shares a wrench: equilibrium, cones, and what happens when more is asked than can be given."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.contact.force_sharing import Bounds, ForceSharing, Sharing
from turnscrew.contact.friction import in_cone, split
from turnscrew.contact.grasp import grasp_matrix

MU, RADIUS = 0.6, 0.018
SHARING = ForceSharing()
W = SHARING.weights(RADIUS)
TWO, FOUR = np.radians([180.0, 0.0]), np.radians([180.0, 80.0, 0.0, -90.0])


def contacts(angles):
    n_W = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    return n_W, grasp_matrix(RADIUS * n_W + [0, 0, 0.125], np.zeros(3))


def bounds(k, least=0.5, most=12.0, T=None, torque=1.0, margin=0.0):
    T = np.zeros((0, 3 * k)) if T is None else T
    return Bounds(
        np.full(k, MU), np.full(k, margin), np.full(k, least), np.full(k, most), T,
        np.full(len(T), -torque), np.full(len(T), torque),
    )  # fmt: skip


def share(angles, F, given=None, squeeze=3.0, f_prev=None, active=None, ticks=1):
    n_W, G = contacts(angles)
    k = len(n_W)
    f_prev = -squeeze * n_W if f_prev is None else f_prev
    for _ in range(ticks):
        answer = SHARING.share(
            W[:, None] * G, W * F, n_W, np.full(k, squeeze), f_prev, given or bounds(k), active
        )  # fmt: skip
        f_prev = answer.f_W
    return answer


@pytest.mark.parametrize("angles", [TWO, FOUR], ids=["two", "four"])
@pytest.mark.parametrize("torque", [0.0, -0.04, 0.04])
def test_the_wrench_is_given_and_every_force_is_inside_its_cone(angles, torque):
    n_W, G = contacts(angles)
    F = np.array([0.0, 0.0, -4.2, 0.0, 0.0, torque])
    answer = share(angles, F, ticks=30)
    assert answer.status is Sharing.SOLVED
    # the price on forces other than the squeeze costs half a percent; four contacts share it
    np.testing.assert_allclose(W * (G @ answer.f_W.ravel()), W * F, atol=0.01 * np.linalg.norm(W * F))
    assert in_cone(answer.f_W, n_W, MU).all()
    assert (answer.margin >= 0.0).all()


def test_what_is_lost_is_the_rest():
    F = np.array([1.0, 0.5, -30.0, 0.1, 0.2, -0.5])
    answer = share(FOUR, F)
    _, G = contacts(FOUR)
    np.testing.assert_allclose(answer.lost, W * (F - G @ answer.f_W.ravel()), atol=1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_there_always_is_an_answer_that_keeps_cones_and_pressing_forces(seed):
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(-np.pi, np.pi, rng.integers(1, 6)))
    k = len(angles)
    n_W, _ = contacts(angles)
    given = bounds(k, least=0.3, most=6.0, T=rng.normal(size=(8, 3 * k)) * 0.05, torque=0.2)
    answer = share(angles, rng.normal(size=6) * [20, 20, 20, 1, 1, 0.5], given)
    assert answer.status is not Sharing.FAILED
    pressing, _ = split(answer.f_W, n_W)
    # the solver's own tolerance of rows is 1e-6, on rows of length 1
    assert (pressing >= 0.3 - 1e-5).all()
    assert (pressing <= 6.0 + 1e-5).all()
    assert (answer.margin >= -1e-5).all()


def test_no_feasible_change_makes_the_answer_better():
    rng = np.random.default_rng(3)
    n_W, G = contacts(FOUR)
    F = np.array([0.0, 0.0, -8.0, 0.0, 0.0, -0.12])
    f_prev = -3.0 * n_W
    answer = share(FOUR, F, f_prev=f_prev)

    def price(f):
        missed, moved, off = W * (G @ f - F), f - f_prev.ravel(), f + 3.0 * n_W.ravel()
        return missed @ missed + SHARING.follow * moved @ moved + SHARING.rest * off @ off

    best, tried = price(answer.f_W.ravel()), 0
    for _ in range(10000):
        f = answer.f_W + rng.normal(size=(4, 3)) * 10 ** rng.uniform(-3, 0)
        pressing, along = split(f, n_W)
        # well inside the inscribed pyramid
        if (pressing >= 0.5).all() and (pressing <= 12.0).all() and (along <= MU * np.cos(np.pi / 8) * pressing).all():
            tried += 1
            assert price(f.ravel()) >= best - 1e-9
    assert tried > 100


def test_an_overload_leaves_out_more_and_more_and_stays_within_the_drives():
    rng = np.random.default_rng(1)
    T = rng.normal(size=(6, 12)) * 0.06
    lost = []
    for size in (1.0, 2.0, 4.0, 8.0):
        answer = share(FOUR, size * np.array([0, 0, -5.0, 0, 0, -0.08]), bounds(4, T=T, torque=0.5), ticks=20)
        lost.append(np.linalg.norm(answer.lost))
        # a soft row gives by what its price's quadratic part lets it, .1 mN.m
        assert (np.abs(T @ answer.f_W.ravel()) <= 0.5 + 1e-3).all()
    assert answer.status is Sharing.OVERLOADED
    assert answer.limited.any()
    assert np.all(np.diff(lost) > 0)


def test_a_light_load_is_limited_by_no_drive():
    T = np.random.default_rng(1).normal(size=(6, 12)) * 0.06
    answer = share(FOUR, np.array([0, 0, -2.0, 0, 0, 0]), bounds(4, T=T, torque=2.0))
    assert answer.status is Sharing.SOLVED
    assert not answer.limited.any()
    assert answer.overload.max() == 0.0


def test_a_warm_start_gives_the_same_answer_sooner():
    F = np.array([0.5, 0.3, -20.0, 0.0, 0.0, -0.4])
    cold = share(FOUR, F)
    warm = share(FOUR, F, active=cold.active)
    np.testing.assert_allclose(warm.f_W, cold.f_W, atol=1e-8)
    assert warm.iterations < cold.iterations


def test_forces_move_on_from_tick_to_tick():
    n_W, _ = contacts(TWO)
    before = share(TWO, np.zeros(6), ticks=50)
    first = share(TWO, np.zeros(6), squeeze=6.0, f_prev=before.f_W)
    settled = share(TWO, np.zeros(6), squeeze=6.0, f_prev=before.f_W, ticks=50)
    step, whole = (-(f - before.f_W) * n_W for f in (first.f_W, settled.f_W))
    # of a change of squeeze, the first tick makes rest / (rest + follow)
    np.testing.assert_allclose(step.sum(axis=1) / whole.sum(axis=1), 1 / 3, atol=0.02)


@pytest.mark.parametrize("margin", [0.5, 1.5])
def test_contacts_keep_the_margin_that_is_asked_for(margin):
    F = np.array([0.0, 0.0, -4.2, 0.0, 0.0, -0.04])
    answer = share(TWO, F, bounds(2, margin=margin), squeeze=1.0, ticks=60)
    # where nothing is wanted but the wrench, the least squeeze stands on the margin; the pyramid gives away 8 %
    assert (answer.margin >= margin - 1e-5).all()
    assert answer.margin.min() < margin + 0.5


def test_a_margin_that_no_pressing_can_give_is_given_in_part():
    answer = share(TWO, np.array([0.0, 0.0, -2.0, 0, 0, 0]), bounds(2, most=1.0, least=0.0, margin=5.0))
    assert answer.status is Sharing.SOLVED
    assert (answer.margin > 0.4).all()
