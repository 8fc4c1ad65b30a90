"""Closest points against a second library and against plain minimisation."""

from __future__ import annotations

from functools import partial

import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize

from turnscrew.geometry.closest import closest_points
from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel
from turnscrew.geometry.rotations import exp_so3, quaternion_from_matrix

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

TIP = Capsule(0.00705, 0.02)


def poses(seed, n):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        p_WT, R_WT = rng.normal(size=3), exp_so3(rng.normal(size=3))
        angle, reach = rng.uniform(-np.pi, np.pi), rng.uniform(0.024, 0.05)
        p_TF = np.array([reach * np.cos(angle), reach * np.sin(angle), rng.uniform(0.1, 0.16)])
        yield p_WT, R_WT, p_WT + R_WT @ p_TF, exp_so3(2.0 * rng.normal(size=3))


def test_gap_to_a_cylinder_is_mujocos_distance_of_two_capsules():
    # A long capsule is the cylinder wherever the nearest point is on its side.
    spec = mujoco.MjSpec()
    for name, radius, half in (("handle", 0.018, 1.0), ("tip", TIP.radius, 0.5 * TIP.length)):
        body = spec.worldbody.add_body(name=name, mocap=True)
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[radius, half, 0.0])
    model = spec.compile()
    data, ends = mujoco.MjData(model), np.zeros(6)
    compared = 0
    for p_WT, R_WT, p_WF, R_WF in poses(0, 200):
        points = closest_points(Cylinder(0.018, 0.08, 0.18), TIP, p_WT, R_WT, p_WF, R_WF)
        data.mocap_pos[:] = p_WT + 0.13 * R_WT[:, 2], p_WF - 0.01 * R_WF[:, 2]
        data.mocap_quat[:] = quaternion_from_matrix(R_WT), quaternion_from_matrix(R_WF)
        mujoco.mj_kinematics(model, data)
        distance = mujoco.mj_geomDistance(model, data, 0, 1, 1.0, ends)
        if points.iterations > 0 or not 0.08 < points.eta < 0.18:
            continue
        compared += 1
        # MuJoCo's capsules are exact to rounding, but their poses pass through quaternions.
        assert points.gap == pytest.approx(distance, abs=1e-12)
        if points.gap > 0.0:
            assert_close(ends, [*points.c_W, *points.tip_W], atol=1e-10)  # points: rounding over angles
    assert compared > 150


@pytest.mark.parametrize(
    "handle",
    [
        barrel(0.08, 0.18, 0.012, 0.018),
        barrel(0.08, 0.18, 0.018, 0.012),
        TurnedHandle((0.08, 0.10, 0.12, 0.15, 0.18), (0.012, 0.016, 0.013, 0.017, 0.015)),
    ],
)
def test_no_pair_of_points_is_nearer_than_the_closest(handle):
    rng = np.random.default_rng(1)
    u, v = np.meshgrid(np.linspace(-np.pi, np.pi, 60), np.linspace(*handle.domain, 60))
    cloud = np.array([handle.point(a, b) for a, b in zip(u.ravel(), v.ravel(), strict=True)])
    for p_WT, R_WT, p_WF, R_WF in poses(2, 25):
        points = closest_points(handle, TIP, p_WT, R_WT, p_WF, R_WF)
        segment = p_WF + np.linspace(-TIP.length, 0.0, 41)[:, None] * R_WF[:, 2]
        in_tool = (segment - p_WT) @ R_WT
        sampled = np.sqrt(((in_tool[:, None] - cloud) ** 2).sum(axis=2)).min() - TIP.radius
        # Samples lie 2 mm apart, so they miss a distance of 10 mm by up to 1^2 / (2 * 10) mm of sag, twice.
        assert points.gap <= max(sampled, -TIP.radius) + 1e-12
        assert points.gap >= sampled - 2e-4 or points.gap < 0.0

        def distance(x, p=p_WT, R=R_WT, q=p_WF, d=R_WF[:, 2]):
            return np.linalg.norm(p + R @ handle.point(x[0], x[1]) - q - x[2] * d)

        bounds = [(-10.0, 10.0), handle.domain, (-TIP.length, 0.0)]
        start = [rng.uniform(-0.3, 0.3) + points.xi, np.clip(points.eta + 0.002, *handle.domain), -0.01]
        found = minimize(distance, start, bounds=bounds, method="L-BFGS-B")
        assert points.gap <= max(found.fun - TIP.radius, -TIP.radius) + 1e-12
