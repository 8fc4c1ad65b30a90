from __future__ import annotations

import numpy as np

from turnscrew.estimate.trail import Trail
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.signals import Vision

OMEGA = np.array([0.1, -0.05, -1.0])
V = np.array([0.001, 0.0, -0.002])
DT = 0.005


def trail_until(time: float) -> Trail:
    trail = Trail()
    for tick in range(round(time / DT) + 1):
        trail = trail.extended(tick * DT, OMEGA * DT, V * DT)
    return trail


def test_late_frame_is_brought_to_now_by_the_motion_since_its_stamp() -> None:
    trail = trail_until(0.5)
    for stamp in (0.4667, 0.45, 0.4111, 0.5):
        seen = trail.to_now(Vision(stamp, V * stamp, exp_so3(OMEGA * stamp), np.eye(6)))
        assert seen is not None
        # constant motion is interpolated exactly; rounding only
        np.testing.assert_allclose(seen.pose.p_WT, V * 0.5, atol=1e-12)
        np.testing.assert_allclose(log_so3(seen.pose.R_WT @ exp_so3(OMEGA * 0.5).T), 0.0, atol=1e-12)


def test_covariance_of_a_late_frame_turns_with_the_tool() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(6, 6))
    seen = trail_until(0.5).to_now(Vision(0.41, np.zeros(3), np.eye(3), A @ A.T))
    assert seen is not None
    turn = exp_so3(OMEGA * 0.09)
    # an error of orientation r becomes turn r; the tip is pushed along, and keeps its error
    both = np.block([[np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), turn]])
    np.testing.assert_allclose(seen.P, both @ A @ A.T @ both.T, atol=1e-12)


def test_frame_older_than_the_trail_is_refused() -> None:
    assert trail_until(0.5).to_now(Vision(0.3, np.zeros(3), np.eye(3), np.eye(6))) is None
    assert Trail().to_now(Vision(0.0, np.zeros(3), np.eye(3), np.eye(6))) is None


def test_trail_stays_short() -> None:
    # .1 s of ticks of 5 ms, and one at each end
    assert len(trail_until(5.0).times) <= 22
