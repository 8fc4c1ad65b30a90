from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from turnscrew.contact.friction import cone_margin, in_cone, polyhedral_cones, scale_internal, split
from turnscrew.contact.grasp import squeeze

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

OPPOSED = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
ROUNDING = 1e-12  # forces up to 100 N

force = st.floats(-20.0, 20.0)
forces = st.lists(st.tuples(force, force, force), min_size=2, max_size=4).map(np.array)


def normals(k, seed=0):
    n = np.random.default_rng(seed).normal(size=(k, 3))
    return n / np.linalg.norm(n, axis=1)[:, None]


def test_a_push_against_the_outward_normal_presses():
    pressing, along = split(np.array([[-5.0, 3.0, 4.0]]), OPPOSED[:1])
    assert_close((pressing[0], along[0]), (5.0, 5.0), atol=ROUNDING)


@pytest.mark.parametrize(
    ("f", "margin"),
    [((-10.0, 3.0, 0.0), 5.0), ((-10.0, 0.0, 9.0), -1.0), ((1.0, 0.0, 0.0), -0.8), ((0.0, 0.0, 0.0), 0)],
)
def test_margin_is_what_friction_leaves(f, margin):
    assert cone_margin(np.array([f]), OPPOSED[:1], 0.8)[0] == pytest.approx(margin, abs=ROUNDING)
    assert in_cone(np.array([f]), OPPOSED[:1], 0.8)[0] == (margin >= 0.0)


@given(forces, st.integers(3, 12), st.floats(0.2, 1.2))
def test_forces_inside_the_pyramid_are_inside_the_cone(f_W, sides, mu):
    for f, n in zip(f_W, normals(len(f_W)), strict=True):
        rows = polyhedral_cones(n[None], np.array([mu]), sides)[0]
        worst = (rows @ f).max()
        if worst <= 0.0:
            assert cone_margin(f[None], n[None], mu)[0] >= -ROUNDING
        # The pyramid is the largest with such faces: forces in the cone of its inscribed circle are in it.
        if cone_margin(f[None], n[None], mu * np.cos(np.pi / sides))[0] >= 0.0:
            assert worst <= ROUNDING


def test_the_pyramids_edges_lie_on_the_cone():
    n, mu, sides = normals(1, seed=3)[0], 0.7, 8
    rows = polyhedral_cones(n[None], np.array([mu]), sides)[0]
    for a, b in zip(rows, np.roll(rows, -1, axis=0), strict=True):
        edge = np.cross(a, b)
        edge *= -np.sign(edge @ n)
        assert cone_margin(edge[None], n[None], mu)[0] == pytest.approx(0.0, abs=1e-14)  # rounding


@given(forces, forces, st.floats(0.2, 1.2), st.integers(0, 99))
def test_the_factor_is_the_smallest_that_holds_or_the_best_there_is(f_W, g_W, mu, seed):
    k = min(len(f_W), len(g_W))
    f_W, g_W, n_W = f_W[:k], g_W[:k], normals(k, seed)
    least, most, reach = 0.5, 6.0, 0.8 * mu
    out = scale_internal(f_W, g_W, n_W, mu, 0.8, least, most)
    assert least <= out.factor <= most
    factors = np.linspace(least, most, 201)
    worst = np.array([cone_margin(f_W + x * g_W, n_W, reach).min() for x in factors])
    if out.holds:
        # On the cone's mantle a root's rounding of 1e-8 (a double one) times 20 N may show.
        assert out.margin >= -1e-6
        assert worst[factors < out.factor - 1e-6].max(initial=-np.inf) <= 1e-6
    else:
        assert worst.max() <= 1e-6
        # The best factor is known to 2e-5 of the range; margins change by at most 2 * 35 N per unit of it.
        assert out.margin >= worst.max() - 2e-5 * 5.5 * 70


def test_a_pinch_that_turns_a_screw_is_squeezed_just_enough():
    # Tangential force t at each finger needs t / (fraction mu) of squeeze.
    f_W = np.array([[0.0, 4.0, 0.0], [0.0, -4.0, 0.0]])
    c_W = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13]])
    out = scale_internal(f_W, squeeze(c_W, 0, 1, 1.0), OPPOSED, 0.8, 0.8, 1.0, 25.0)
    assert out.holds
    assert out.factor == pytest.approx(4.0 / 0.64, abs=ROUNDING)
    assert out.margin == pytest.approx(0.0, abs=ROUNDING)


def test_a_grasp_that_holds_already_keeps_the_least_factor():
    c_W = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13]])
    out = scale_internal(np.zeros((2, 3)), squeeze(c_W, 0, 1, 8.0), OPPOSED, 0.8, 0.8, 1.0, 4.0)
    assert (out.factor, out.holds) == (1.0, True)
    assert out.margin == pytest.approx(0.64 * 8.0, abs=ROUNDING)


def test_a_load_beyond_the_largest_squeeze_is_said_not_to_hold():
    f_W = np.array([[0.0, 20.0, 0.0], [0.0, -20.0, 0.0]])
    c_W = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13]])
    out = scale_internal(f_W, squeeze(c_W, 0, 1, 5.0), OPPOSED, 0.8, 0.8, 1.0, 4.0)
    assert not out.holds
    assert out.factor == pytest.approx(4.0, abs=1e-12)  # an end of the samples
    assert out.margin == pytest.approx(0.64 * 20.0 - 20.0, abs=1e-9)


def test_contacts_that_pull_never_hold():
    # Both forces lie in the cones' mirror images, where only the sign of the pressing force tells.
    f_W = 10.0 * OPPOSED
    g_W = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    out = scale_internal(f_W, g_W, OPPOSED, 0.8, 0.8, 0.0, 4.0)
    assert not out.holds
    assert out.margin == pytest.approx(-6.4, abs=1e-9)  # at no internal force, an end of the samples


@given(st.floats(0.5, 5.0), st.floats(0.0, 2.0))
def test_contacts_that_carry_nothing_do_not_spoil_the_grasp(load, dust):
    assume(load < 0.64 * 20.0)
    f_W = np.array([[0.0, load, 0.0], [0.0, -load, 0.0], [0.0, 0.0, 0.0]])
    f_W[2, 1] = 1e-10 * dust
    c_W = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13], [0.0, 0.018, 0.13]])
    n_W = np.vstack([OPPOSED, [0.0, 1.0, 0.0]])
    assert scale_internal(f_W, squeeze(c_W, 0, 1, 5.0), n_W, 0.8, 0.8, 1.0, 4.0).holds
