from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np
import pytest

from turnscrew.errors import ModelError
from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel, tapered

assert_close = partial(np.testing.assert_allclose, rtol=0.0)


def test_a_capsules_points_are_at_its_radius_from_its_segment():
    tip = Capsule(0.00705, 0.02)
    for v in np.linspace(*tip.domain, 21):
        x, y, z = tip.point(0.7, v)
        foot = np.clip(z, -0.02, 0.0)
        assert np.sqrt(x * x + y * y + (z - foot) ** 2) == pytest.approx(0.00705, abs=1e-17)  # one rounding


def test_a_capsules_chart_and_normal_have_no_jump_at_the_seam():
    tip = Capsule(0.00918, 0.02)
    # Slopes are of order 0.01 and 1, so 1e-9 of v moves points by 1e-11 and normals by 1e-9.
    assert_close(tip.point(1.0, -1e-9), tip.point(1.0, 1e-9), atol=1e-10)
    assert_close(tip.tangents(1.0, -1e-9), tip.tangents(1.0, 1e-9), atol=1e-10)
    assert_close(tip.normal(1.0, -1e-9), tip.normal(1.0, 1e-9), atol=1e-8)


def test_a_capsules_top_is_a_sphere_and_its_body_a_cylinder():
    tip = Capsule(0.008, 0.02)
    for v in (0.0, 0.5, 1.5, 0.5 * np.pi):
        assert_close(tip.curvatures(v), (125.0, 125.0), rtol=1e-12)  # near the pole r loses digits
    assert_close(tip.curvatures(-1.0), (125.0, 0.0), rtol=1e-15)


def test_a_cone_has_its_half_angle_and_a_barrel_its_middle_radius():
    cone = tapered(0.1, 0.2, 0.010, 0.020)
    assert_close(cone.normal(0.0, 0.13), np.array([1.0, 0.0, -0.1]) / np.sqrt(1.01), atol=1e-14)  # rounding
    assert cone.point(0.0, 0.15)[0] == pytest.approx(0.015, abs=1e-17)
    bulge = barrel(0.1, 0.2, 0.010, 0.020)
    assert_close(bulge.point(0.0, 0.15), [0.020, 0.0, 0.15], atol=1e-16)  # rounding
    assert_close(bulge.normal(0.0, 0.15), [1.0, 0.0, 0.0], atol=1e-14)
    # A parabola r = r_m - 4 (r_m - r_e) (x / L)^2 has curvature 8 (r_m - r_e) / L^2 at its top.
    assert_close(bulge.curvatures(0.15), (50.0, 8.0), rtol=1e-12)


def test_a_waist_is_concave_along_the_axis_only():
    around, along = barrel(0.1, 0.2, 0.020, 0.012).curvatures(0.15)
    assert around > 0.0 > along


def test_a_turned_handle_passes_through_its_knots_and_goes_on_beyond_them():
    handle = TurnedHandle((0.0, 0.02, 0.05, 0.09), (0.012, 0.017, 0.014, 0.016))
    for z, r in zip(handle.heights, handle.radii, strict=True):
        assert handle.meridian(z).r == pytest.approx(r, abs=1e-17)
    inside, outside = handle.meridian(0.09 - 1e-9), handle.meridian(0.09 + 1e-9)
    assert inside.r == pytest.approx(outside.r, abs=1e-9)  # slopes are below 1
    assert handle.domain == (0.0, 0.09)


def test_surfaces_are_values():
    assert Cylinder(0.018, 0.1, 0.2) == Cylinder(0.018, 0.1, 0.2)
    assert len({barrel(0.1, 0.2, 0.01, 0.02), barrel(0.1, 0.2, 0.01, 0.02), Capsule(0.01, 0.0)}) == 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        Cylinder(0.018, 0.1, 0.2).radius = 0.02


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Cylinder(0.0, 0.1, 0.2), "cylinder: radius is 0.0"),
        (lambda: Cylinder(float("nan"), 0.1, 0.2), "cylinder: radius is nan"),
        (lambda: Cylinder(0.01, 0.2, 0.1), "z1 - z0"),
        (lambda: Capsule(-0.01, 0.1), "capsule: radius"),
        (lambda: Capsule(0.01, -0.1), "capsule: length"),
        (lambda: Capsule(0.01, float("inf")), "capsule: length"),
        (lambda: TurnedHandle((0.1,), (0.01,)), "at least two"),
        (lambda: TurnedHandle((0.1, 0.2), (0.01,)), "2 heights and 1 radii"),
        (lambda: TurnedHandle((0.1, 0.1), (0.01, 0.01)), "step of the heights"),
        (lambda: tapered(0.1, 0.2, 0.01, 0.0), "radius is 0.0"),
    ],
)
def test_impossible_shapes_are_refused_with_the_number_that_is_wrong(build, words):
    with pytest.raises(ModelError, match=words):
        build()
