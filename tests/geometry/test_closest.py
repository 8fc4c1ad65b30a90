from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.geometry.closest import closest_points
from turnscrew.geometry.foot import nearest_foot
from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel, tapered
from turnscrew.geometry.rotations import exp_so3

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

TIP = Capsule(0.00705, 0.02)
HANDLES = {
    "cylinder": Cylinder(0.018, 0.08, 0.18),
    "cone": tapered(0.08, 0.18, 0.012, 0.018),
    "barrel": barrel(0.08, 0.18, 0.012, 0.018),
    "waist": barrel(0.08, 0.18, 0.018, 0.012),
    "turned": TurnedHandle((0.08, 0.10, 0.12, 0.15, 0.18), (0.012, 0.016, 0.013, 0.017, 0.015)),
}
ROUNDING = 1e-14  # metres: a few dozen operations on coordinates of order 1 m
STATIONARY = 1e-9  # the search stops at a slope of 1e-11; a parameter is that over a curvature in metres


@pytest.fixture(params=HANDLES)
def handle(request):
    return HANDLES[request.param]


def upright():
    return np.zeros(3), np.eye(3)


def poses(seed, n):
    """A tool anywhere and a fingertip near its handle, pointing anywhere."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        p_WT, R_WT = rng.normal(size=3), exp_so3(rng.normal(size=3))
        angle, reach = rng.uniform(-np.pi, np.pi), rng.uniform(0.024, 0.04)
        p_TF = np.array([reach * np.cos(angle), reach * np.sin(angle), rng.uniform(0.1, 0.16)])
        yield p_WT, R_WT, p_WT + R_WT @ p_TF, exp_so3(2.0 * rng.normal(size=3))


def test_parameters_give_back_the_points_and_opposed_normals(handle):
    met = 0
    for p_WT, R_WT, p_WF, R_WF in poses(0, 100):
        points = closest_points(handle, TIP, p_WT, R_WT, p_WF, R_WF)
        if not points.on_patch:
            continue
        met += 1
        assert_close(p_WT + R_WT @ handle.point(points.xi, points.eta), points.c_W, atol=ROUNDING)
        assert_close(
            p_WF + R_WF @ TIP.point(points.u, points.v), points.tip_W, atol=1e-13
        )  # a slope of 1e-11 over 7 mm
        assert_close(points.tip_W - points.c_W, points.gap * points.n_W, atol=ROUNDING)
        assert_close(R_WT @ handle.normal(points.xi, points.eta), points.n_W, atol=STATIONARY)
        assert_close(R_WF @ TIP.normal(points.u, points.v), -points.n_W, atol=STATIONARY)
        assert points.residual < 1e-11  # the search's own criterion
    assert met >= 40  # else this shows little


def test_a_cylinder_and_a_spline_of_one_radius_agree():
    spline = TurnedHandle((0.08, 0.12, 0.18), (0.018, 0.018, 0.018))
    for pose in poses(1, 200):
        closed, searched = (closest_points(h, TIP, *pose) for h in (HANDLES["cylinder"], spline))
        if closed.gap < -0.99 * TIP.radius:
            continue  # the search stops where the axis enters the handle
        assert closed.gap == pytest.approx(searched.gap, abs=ROUNDING)
        assert closed.on_patch == searched.on_patch
        assert_close(closed.tip_W, searched.tip_W, atol=STATIONARY)
        assert closed.iterations == 0 or not closed.on_patch


def test_a_finger_across_the_handle_touches_with_its_side():
    p_WF = np.array([0.018 + 0.00705 + 0.002, 0.005, 0.13])
    R_WF = np.column_stack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # its axis along y
    points = closest_points(HANDLES["cylinder"], TIP, *upright(), p_WF, R_WF)
    assert points.gap == pytest.approx(0.002, abs=ROUNDING)
    assert points.v == pytest.approx(-0.005 / 0.00705, abs=1e-12)  # rounding over the radius
    assert (points.xi, points.eta) == pytest.approx((0.0, 0.13), abs=1e-12)
    assert_close(points.c_W, [0.018, 0.0, 0.13], atol=ROUNDING)
    assert_close(points.n_W, [1.0, 0.0, 0.0], atol=ROUNDING)


def test_a_finger_pointing_at_the_handle_touches_with_its_pole():
    p_WF = np.array([0.0, -0.03, 0.13])
    R_WF = np.column_stack([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    points = closest_points(HANDLES["cylinder"], TIP, *upright(), p_WF, R_WF)
    assert points.gap == pytest.approx(0.03 - 0.018 - 0.00705, abs=ROUNDING)
    assert points.v == pytest.approx(0.5 * np.pi, abs=1e-12)  # rounding over the radius
    assert_close(points.tip_W, [0.0, -0.03 + 0.00705, 0.13], atol=ROUNDING)


def test_a_parallel_finger_touches_along_a_line_and_says_its_middle():
    points = closest_points(HANDLES["cylinder"], TIP, *upright(), np.array([0.03, 0.0, 0.14]), np.eye(3))
    assert points.gap == pytest.approx(0.03 - 0.018 - 0.00705, abs=ROUNDING)
    assert points.eta == pytest.approx(0.13, abs=ROUNDING)


def test_above_the_handle_the_rim_is_nearest_and_the_contact_is_off_the_patch():
    p_WF = np.array([0.018, 0.0, 0.2])
    R_WF = np.diag([1.0, -1.0, -1.0])  # pointing down at the rim
    points = closest_points(HANDLES["cylinder"], TIP, *upright(), p_WF, R_WF)
    assert not points.on_patch
    assert points.gap == pytest.approx(0.02 - 0.00705, abs=ROUNDING)
    assert_close(points.c_W, [0.018, 0.0, 0.18], atol=ROUNDING)


def test_the_far_end_of_a_fingertips_segment_is_off_its_patch():
    d = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    R_WF = np.column_stack([[0.0, 1.0, 0.0], np.cross(d, [0.0, 1.0, 0.0]), d])
    points = closest_points(HANDLES["cylinder"], TIP, *upright(), np.array([0.05, 0.0, 0.13]), R_WF)
    assert not points.on_patch
    assert points.v == TIP.domain[0]


def test_overlap_is_a_negative_gap_until_the_axes_meet(handle):
    R_WF = np.column_stack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    radius = handle.meridian(0.13).r
    p_WF = np.array([radius + 0.004, 0.01, 0.13])
    points = closest_points(handle, TIP, *upright(), p_WF, R_WF)
    # On a slanted or bulging handle another point is nearer, by second order in the slope, which is below 0.3.
    assert points.gap == pytest.approx(0.004 - TIP.radius, abs=0.06 * 0.004)
    assert points.gap < 0.0


def test_axes_that_meet_give_finite_points_with_a_unit_normal(handle):
    R_WF = np.column_stack([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    points = closest_points(handle, TIP, *upright(), np.array([0.0, 0.01, 0.13]), R_WF)
    assert np.isfinite([*points.c_W, *points.tip_W, points.gap]).all()
    assert np.linalg.norm(points.n_W) == pytest.approx(1.0, abs=ROUNDING)
    assert points.gap <= -TIP.radius + 1e-9  # the search counts a nanometre as inside


def test_coaxial_finger_in_the_handle_gives_finite_points():
    points = closest_points(HANDLES["cylinder"], TIP, *upright(), np.array([0.0, 0.0, 0.14]), np.eye(3))
    assert points.gap == pytest.approx(-0.018 - 0.00705, abs=ROUNDING)
    assert np.linalg.norm(points.n_W) == pytest.approx(1.0, abs=ROUNDING)


def test_a_pose_that_is_not_a_number_ends_the_search():
    foot = nearest_foot(HANDLES["barrel"], (float("nan"), 0.0, 0.1), (0.0, 1.0, 0.0), 0.02)
    assert np.isnan(foot.distance)
