"""What holds on every patch of the family."""

from __future__ import annotations

from functools import partial

import casadi
import numpy as np
import pytest

from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel, tapered

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

FAMILY = {
    "cylinder": Cylinder(0.018, 0.08, 0.18),
    "finger": Capsule(0.00705, 0.02),
    "thumb": Capsule(0.00918, 0.02),
    "cone": tapered(0.08, 0.18, 0.012, 0.018),
    "barrel": barrel(0.08, 0.18, 0.012, 0.018),
    "waist": barrel(0.08, 0.18, 0.018, 0.012),
    "turned": TurnedHandle((0.08, 0.10, 0.12, 0.15, 0.18), (0.012, 0.016, 0.013, 0.017, 0.015)),
}
ROUNDING = 1e-13  # a few dozen operations; curvatures of 140 / m multiply the rounding of lengths


@pytest.fixture(params=FAMILY)
def surface(request):
    return FAMILY[request.param]


@pytest.fixture
def parameters(surface):
    rng = np.random.default_rng(3)
    v_min, v_max = surface.domain
    margin = 0.01 * (v_max - v_min)  # poles have their own test
    return [(rng.uniform(-np.pi, np.pi), rng.uniform(v_min, v_max - margin)) for _ in range(25)]


def test_normals_are_unit_and_perpendicular_to_both_tangents_and_point_outwards(surface, parameters):
    for u, v in parameters:
        n, (s_u, s_v) = surface.normal(u, v), surface.tangents(u, v).T
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=ROUNDING)
        assert_close([n @ s_u, n @ s_v], 0.0, atol=ROUNDING)
        assert np.cross(s_u, s_v) @ n > 0.0
        assert n[:2] @ surface.point(u, v)[:2] > 0.0


def test_unit_tangents_are_the_tangents_directions_and_orthogonal(surface, parameters):
    for u, v in parameters:
        tangents, units = surface.tangents(u, v), surface.unit_tangents(u, v)
        assert_close(units * np.linalg.norm(tangents, axis=0), tangents, atol=ROUNDING)
        assert_close(units.T @ units, np.eye(2), atol=ROUNDING)


def test_normal_turns_with_the_curvature_along_each_principal_direction(surface, parameters):
    for u, v in parameters:
        assert_close(surface.normal_derivatives(u, v), surface.tangents(u, v) * surface.curvatures(v), atol=ROUNDING)


def test_curvatures_are_the_second_fundamental_form_over_the_first(surface, parameters):
    for u, v in parameters:
        n, first, second = surface.normal(u, v), surface.tangents(u, v), surface.second_derivatives(u, v)
        E, F, G = first[:, 0] @ first[:, 0], first[:, 0] @ first[:, 1], first[:, 1] @ first[:, 1]
        L, M, N = -n @ second
        assert_close([F, M], 0.0, atol=ROUNDING)
        assert_close((L / E, N / G), surface.curvatures(v), rtol=1e-11, atol=1e-11)  # quotients of small lengths


def test_local_geometry_says_the_same_as_the_single_functions(surface, parameters):
    for u, v in parameters:
        local = surface.local_geometry(u, v)
        assert_close(np.column_stack([local.t_u, local.t_v]), surface.unit_tangents(u, v), atol=ROUNDING)
        assert_close(local.n, surface.normal(u, v), atol=ROUNDING)
        assert_close(np.cross(local.t_u, local.t_v), local.n, atol=ROUNDING)
        speeds = np.linalg.norm(surface.tangents(u, v), axis=0)
        assert_close((local.speed_u, local.speed_v), speeds, atol=ROUNDING)
        assert (local.curvature_u, local.curvature_v) == surface.curvatures(v)


@pytest.mark.parametrize("kind", [casadi.SX, casadi.MX])
def test_symbolic_patch_is_the_numeric_one(surface, parameters, kind):
    u, v, offset = kind.sym("u"), kind.sym("v"), kind.sym("offset")
    patch = casadi.Function("patch", [u, v, offset], list(surface.symbolic(u, v, offset)))
    for a, b in parameters:
        sigma, s_u, s_v, n = (np.array(x).ravel() for x in patch(a, b, 0.0))
        assert_close(sigma, surface.point(a, b), atol=ROUNDING)
        assert_close(np.column_stack([s_u, s_v]), surface.unit_tangents(a, b), atol=ROUNDING)
        assert_close(n, surface.normal(a, b), atol=ROUNDING)
        grown = np.array(patch(a, b, 1e-3)[0]).ravel()
        assert_close(grown - sigma, 1e-3 * surface.normal(a, b), atol=ROUNDING)


def test_symbolic_derivatives_are_the_numeric_tangents_and_normal_derivatives(surface, parameters):
    u, v = casadi.SX.sym("u"), casadi.SX.sym("v")
    patch = surface.symbolic(u, v)
    w = casadi.vertcat(u, v)
    slopes = casadi.Function("slopes", [u, v], [casadi.jacobian(patch.sigma, w), casadi.jacobian(patch.n_hat, w)])
    for a, b in parameters:
        tangents, normals = (np.array(x) for x in slopes(a, b))
        assert_close(tangents, surface.tangents(a, b), atol=ROUNDING)
        assert_close(normals, surface.normal_derivatives(a, b), atol=1e-12)  # second derivatives up to 100


def test_a_pole_has_a_normal_a_tangent_and_equal_curvatures():
    pole = FAMILY["finger"].domain[1]
    assert_close(FAMILY["finger"].normal(0.3, pole), [0.0, 0.0, 1.0], atol=1e-15)  # cos(pi / 2) is 6e-17
    units = FAMILY["finger"].unit_tangents(0.3, pole)
    assert_close(units.T @ units, np.eye(2), atol=ROUNDING)
    around, along = FAMILY["finger"].curvatures(pole)
    assert around == along
