"""The gap's derivative for motions of tool and fingertip, on the manifold of poses."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.geometry.closest import closest_points, gap_gradient
from turnscrew.geometry.profiles import Capsule, Cylinder, barrel
from turnscrew.geometry.rotations import exp_so3

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

TIP = Capsule(0.00705, 0.02)
STEP = 1e-6


@pytest.mark.parametrize("handle", [Cylinder(0.018, 0.08, 0.18), barrel(0.08, 0.18, 0.012, 0.018)])
def test_gap_changes_by_the_normal_motion_of_the_closest_points(handle):
    rng = np.random.default_rng(4)
    for _ in range(20):
        p_WT, R_WT, R_WF = rng.normal(size=3), exp_so3(rng.normal(size=3)), exp_so3(2.0 * rng.normal(size=3))
        p_WF = p_WT + R_WT @ np.array([0.03 * np.cos(1.0), 0.03 * np.sin(1.0), rng.uniform(0.11, 0.15)])

        def gap(tool, finger, p=p_WT, R=R_WT, q=p_WF, Q=R_WF):
            return closest_points(
                handle, TIP, p + tool[:3], exp_so3(tool[3:]) @ R, q + finger[:3], exp_so3(finger[3:]) @ Q
            ).gap

        points = closest_points(handle, TIP, p_WT, R_WT, p_WF, R_WF)
        if points.gap < -0.9 * TIP.radius:
            continue  # nearer to where the axes meet the gap bends without bound
        tool, finger = gap_gradient(points, p_WT, p_WF)
        still, steps = np.zeros(6), STEP * np.eye(6)
        # Rounding of 1e-16 m over 1e-6; the gap bends by at most 1 / (10 mm), so truncation is smaller still.
        assert_close(tool, [(gap(e, still) - gap(-e, still)) / (2 * STEP) for e in steps], atol=2e-9)
        assert_close(finger, [(gap(still, e) - gap(still, -e)) / (2 * STEP) for e in steps], atol=2e-9)


def test_a_thicker_handle_loses_its_growth_of_the_gap():
    p_WF, R_WF = np.array([0.03, 0.002, 0.13]), exp_so3(np.array([0.3, 1.2, 0.1]))
    thin, thick = (
        closest_points(Cylinder(radius, 0.08, 0.18), TIP, np.zeros(3), np.eye(3), p_WF, R_WF).gap
        for radius in (0.018, 0.019)
    )
    assert thin - thick == pytest.approx(0.001, abs=1e-16)  # rounding
