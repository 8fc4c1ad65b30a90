from __future__ import annotations

import numpy as np
import pytest
from rigs.plants import Still

from turnscrew.sense.fingertip_force import FingertipForce


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


@pytest.mark.parametrize("seed", range(5))
def test_errors_stay_within_25_percent_and_30_degrees(seed: int) -> None:
    gauges = FingertipForce(noise=0.0)
    rng = np.random.default_rng(seed)
    state = gauges.init(rng)
    f = rng.normal(size=(5, 3)) * 5.0
    gains, angles = [], []
    for tick in range(2000):
        state, reading, _ = gauges.update(state, Still(0.05 * tick, f_F=f))
        gains.append(np.linalg.norm(reading, axis=1) / np.linalg.norm(f, axis=1) - 1.0)
        angles.append(angle(reading, f))
    # a rotation by a vector of 30 deg turns a force by 30 deg at most; rounding only
    assert np.abs(gains).max() <= 0.25 + 1e-9
    assert np.max(angles) <= np.deg2rad(30.0) + 1e-6
    # over 100 s and five fingers the model comes near its bounds: .6 const + .4 wander, both seldom at their ends
    assert np.abs(gains).max() > 0.12
    assert np.max(angles) > np.deg2rad(12.0)


def test_part_of_the_error_is_constant_and_part_wanders_slowly() -> None:
    gauges = FingertipForce(noise=0.0)
    state = gauges.init(np.random.default_rng(7))
    f = np.tile([0.0, 0.0, 5.0], (5, 1))
    gains = []
    for tick in range(20000):
        state, reading, _ = gauges.update(state, Still(0.01 * tick, f_F=f))
        gains.append(np.linalg.norm(reading, axis=1) / 5.0 - 1.0)
    series = np.array(gains)
    constant = gauges.constant_share * gauges.magnitude_error * state.constant[:, 0]
    # the wandering part's mean over 200 s = 33 correlation times: deviation <= .1 / sqrt(33) = .017, three of these
    np.testing.assert_allclose(series.mean(axis=0), constant, atol=0.05)
    # within a tick of 10 ms it moves by sqrt(2 x .01 / 3) = 8 % of .1 at most typically; five sigmas
    assert np.abs(np.diff(series, axis=0)).max() < 0.05
    assert series.std(axis=0).min() > 0.02


def test_no_force_reads_as_white_noise() -> None:
    gauges = FingertipForce()
    state = gauges.init(np.random.default_rng(2))
    readings = []
    for tick in range(2000):
        state, reading, _ = gauges.update(state, Still(0.001 * tick, f_F=np.zeros((5, 3))))
        readings.append(reading)
    # 30000 samples know a deviation to .4 %
    np.testing.assert_allclose(np.std(readings), gauges.noise, rtol=0.02)
