"""Whatever the sensors say, what the controller gets is a finite estimate with a status that it knows."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.estimation import DT, ROBOT, blur, gait
from rigs.faulty import spoilt

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.tip_wrench import TipWrench

TOOL = ToolInertia(0.08, np.array([0.0, 0.0, 0.125]), np.diag([7e-5, 7e-5, 1.3e-5]))

STATUSES = {"warm", "cold", "relaxed", "predicted", "no contact"}
FRAMES = {"taken", "refused", "late", "none"}


def survive(rounds: int, share: float, seed: int) -> tuple[int, int]:
    """Estimates through faults; returns the numbers of ticks and of camera frames."""
    rng = np.random.default_rng(seed)
    ticks, frames, truths = 0, 0, gait(1)
    for number in range(rounds):
        blurred = blur(truths, seed + number)
        estimator = ToolEstimator(ROBOT.fingertips, blurred.handle, blurred.p_WS, TipWrench(TOOL, 0.0007))
        state = estimator.init(blurred.measurements[0], blurred.p_WS, np.eye(3))
        for measurement, motion in zip(blurred.measurements, blurred.sent, strict=True):
            given = spoilt(measurement, rng) if rng.random() < share else measurement
            state, estimate = estimator.update(state, given, motion, DT)
            ticks, frames = ticks + 1, frames + (given.vision is not None)
            assert estimate.status in STATUSES
            assert estimate.frame in FRAMES
            for name in ("q", "p_WT", "R_WT", "nu", "f_W", "c_W", "F_s", "P"):
                assert np.isfinite(getattr(estimate, name)).all(), name
            # a rotation, whatever came in; rounding only
            np.testing.assert_allclose(estimate.R_WT @ estimate.R_WT.T, np.eye(3), atol=1e-6)
            assert np.linalg.eigvalsh(estimate.P).min() > 0.0
    return ticks, frames


def test_faults_in_a_tenth_of_all_readings() -> None:
    ticks, _ = survive(1, 0.1, 11)
    assert ticks > 500


@pytest.mark.soak
def test_twenty_thousand_frames_with_faults() -> None:
    frames, seed = 0, 100
    while frames < 20_000:
        frames += survive(5, 0.15, seed)[1]
        seed += 5
