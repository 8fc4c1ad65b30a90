from __future__ import annotations

import numpy as np
import pytest
from rigs.plants import Still

from turnscrew.robot.joints import DRIVEN
from turnscrew.sense.gauge_calibration import GaugeError, calibrate_gauges
from turnscrew.sense.strain_gauges import GAUGED, N, StrainGauges

PERFECT = StrainGauges(gain_error=0.0, offset=0.0, hysteresis=0.0, drift=0.0, noise=0.0, load_accuracy=0.0)


def bench(
    rng: np.random.Generator, gauges: int, noise: float = 0.005, accuracy: float = 0.05
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Gains, offsets, free readings, loaded readings and loads."""
    gain, offset = 1.0 + 0.2 * rng.normal(size=gauges), 0.05 * rng.normal(size=gauges)
    loads = np.repeat(np.linspace(-0.3, 0.3, 6)[:, None], gauges, axis=1)
    free = offset + noise * rng.normal(size=(40, gauges))
    true = loads * (1.0 + accuracy * rng.normal(size=loads.shape))
    return gain, offset, free, gain * true + offset + noise * rng.normal(size=loads.shape), loads


def test_calibration_finds_gains_and_offsets_within_its_standard_errors() -> None:
    gain, offset, free, readings, loads = bench(np.random.default_rng(1), 2000)
    found = calibrate_gauges(free, readings, loads, 0.05)
    for error, sigma in ((found.gain - gain, found.gain_error), (found.offset - offset, found.offset_error)):
        # the mean of 2000 squares of unit normals is 1 +- sqrt(2 / 2000) = .032; four of these and 3 % for weights from
        # a scatter of 40 readings
        assert np.mean((error / sigma) ** 2) == pytest.approx(1.0, abs=0.16)
    # 20 % of gain error down to some 5 % over sqrt(6) loads that pull the line at its ends most
    assert np.std(found.gain / gain - 1.0) < 0.04


def test_exact_readings_give_exact_gains() -> None:
    gain, offset, free, readings, loads = bench(np.random.default_rng(2), 5, noise=0.0, accuracy=0.0)
    found = calibrate_gauges(free, readings, loads, 0.0)
    # rounding of sums of some ten terms
    np.testing.assert_allclose(found.gain, gain, rtol=1e-12)
    np.testing.assert_allclose(found.offset, offset, atol=1e-12)
    np.testing.assert_allclose(found.torque(readings), loads, atol=1e-12)


def test_more_loads_make_smaller_errors() -> None:
    _, _, free, readings, loads = bench(np.random.default_rng(3), 50)
    few = calibrate_gauges(free, readings, loads)
    many = calibrate_gauges(free, np.tile(readings, (4, 1)), np.tile(loads, (4, 1)))
    # four times the loads halve the gain's error, the offset's part in it aside
    np.testing.assert_allclose(many.gain_error / few.gain_error, 0.5, atol=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"free": [[0.0, 0.0]] * 2}, "2 readings in free air and 4 under load: at least 3 and 2 needed"),
        ({"readings": [[0.1, 0.1]], "loads": [[0.1, 0.1]]}, "at least 3 and 2 needed"),
        ({"loads": [[0.1, 0.0]] * 4}, "gauge 1: all its loads are zero"),
        ({"readings": [[0.1, 0.1]] * 3}, "do not fit"),
        ({"free": [[0.0]] * 5}, "do not fit"),
        ({"free": [0.0, 0.0]}, "shape"),
        ({"readings": [[0.1, np.nan]] + [[0.1, 0.1]] * 3}, "row 0, gauge 1 is not a number"),
        ({"readings": [[0.1, "x"]] * 4}, "tables of numbers"),
        ({"free": [[0.0, 0.0], [0.0, 1.0], [0.0, -1.0]]}, "gauge 1: its readings under load do not stand out"),
        ({"readings": [[0.1, 0.1], [-0.1, 0.1], [0.1, -0.1], [-0.1, -0.1]]}, "gauge 1: gain"),
        ({"accuracy": 1.5}, "accuracy"),
    ],
)
def test_bad_data_is_named_in_one_line(change: dict[str, object], message: str) -> None:
    data: dict[str, object] = {
        "free": [[0.0, 0.001], [0.001, 0.0], [0.0, 0.0]],
        "readings": [[0.1, 0.1], [-0.1, -0.1], [0.2, 0.2], [-0.2, -0.2]],
        "loads": [[0.1, 0.1], [-0.1, -0.1], [0.2, 0.2], [-0.2, -0.2]],
    }
    calibrate_gauges(**data)  # as it stands it is good
    if "gain" in message:
        change = {**change, "loads": [[0.1, 0.1], [-0.1, -0.1], [0.1, 0.1], [-0.1, -0.1]]}
    with pytest.raises(GaugeError, match=message) as caught:
        calibrate_gauges(**{**data, **change})
    assert "\n" not in str(caught.value)


def test_perfect_gauges_tell_the_drives_torques() -> None:
    tau = np.linspace(-0.4, 0.4, len(DRIVEN))
    _, f_F, reading = PERFECT.update(PERFECT.init(np.random.default_rng(0)), Still(tau=tau))
    assert f_F is None
    np.testing.assert_allclose(reading[GAUGED], tau[GAUGED], atol=1e-12)  # rounding
    assert (reading[~GAUGED] == 0.0).all()
    assert [name for name, gauged in zip(DRIVEN, GAUGED, strict=True) if not gauged] == [
        "WAMJ1", "WAMJ2", "WAMJ3", "WAMJ4", "WRJ2", "WRJ1",
    ]  # fmt: skip


def test_what_is_left_after_calibration_is_what_the_gauges_say_of_themselves() -> None:
    gauges = StrainGauges()
    at_rest, share = gauges.doubt()
    for torque in (0.0, 0.5):
        errors = []
        for seed in range(150):
            _, _, tau = gauges.update(gauges.init(np.random.default_rng(seed)), Still(tau=np.full(24, torque)))
            errors.append(tau[GAUGED] - torque)
        # 2700 samples know a deviation to 1.4 %; the offset's error under load and the heavy tail of 1 / g^ add to it
        assert np.std(errors) == pytest.approx(np.hypot(at_rest, share * torque), rel=0.12)


def test_errors_wander_slowly_and_noise_does_not() -> None:
    gauges = StrainGauges(noise=0.0, drift=0.0)
    state = gauges.init(np.random.default_rng(5))
    readings = []
    for tick in range(1000):
        state, _, tau = gauges.update(state, Still(0.15 * tick, tau=np.full(24, 0.3)))
        readings.append(tau[GAUGED] / 0.3)
    series = np.array(readings)
    assert series.shape == (1000, N)
    # 150 s are 25 independent stretches of 18 gauges: a deviation known to 4 %, gains off by a few per cent
    assert series.std(axis=0).mean() == pytest.approx(gauges.hysteresis, rel=0.15)
    # in .15 s it moves by sqrt(2 (1 - exp(-.15 / 3))) = 31 % of its deviation
    assert np.diff(series, axis=0).std() == pytest.approx(0.31 * gauges.hysteresis, rel=0.15)


def test_the_same_seed_makes_the_same_gauges() -> None:
    gauges = StrainGauges()
    one, other = (gauges.init(np.random.default_rng(9)) for _ in range(2))
    np.testing.assert_array_equal(one.calibration.gain, other.calibration.gain)
