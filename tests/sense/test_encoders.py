from __future__ import annotations

import numpy as np

from turnscrew.robot.joints import ARM, INDEX, JOINTS
from turnscrew.sense.encoders import Encoders, finger_offset_sigma, reading_sigma

N, HAND = len(JOINTS), slice(len(ARM), None)


def test_reading_is_truth_plus_constant_offset_plus_white_noise() -> None:
    encoders = Encoders()
    state = encoders.init(np.random.default_rng(0))
    q = np.linspace(-1.0, 1.0, N)
    readings = []
    for tick in range(2000):
        state, (reading, _) = encoders.update(state, q, 0.001 * tick)
        readings.append(reading - q)
    errors = np.array(readings)
    # the mean of 2000 readings is known to .05 deg / sqrt(2000) = .001 deg: five of these
    np.testing.assert_allclose(errors.mean(axis=0), state.offset, atol=np.deg2rad(0.006))
    # 48000 samples know a deviation to .3 %
    np.testing.assert_allclose(errors[:, HAND].std(axis=0).mean(), np.deg2rad(0.05), rtol=0.02)


def test_the_arm_reads_to_one_count_of_its_motors_over_the_gear() -> None:
    encoders = Encoders(offset_sigma=finger_offset_sigma(0.0))
    state = encoders.init(np.random.default_rng(2))
    _, (reading, _) = encoders.update(state, np.zeros(N), 0.0)
    # 4096 counts a turn, 18 turns of the motor for one of WAMJ4
    np.testing.assert_array_equal(encoders.noise[: len(ARM)], 2 * np.pi / 73728)
    # four draws beyond five sigma happen once in a million
    assert np.all(np.abs(reading[: len(ARM)]) < 5 * np.deg2rad(0.005))


def test_offsets_are_drawn_per_seed_with_their_sigma_for_finger_joints_only() -> None:
    encoders = Encoders()
    offsets = np.array([encoders.init(np.random.default_rng(seed)).offset for seed in range(200)])
    assert np.all(offsets[:, : INDEX["FFJ4"]] == 0.0)
    # 200 x 22 samples know a deviation to 1 %: three of these
    np.testing.assert_allclose(offsets[:, INDEX["FFJ4"] :].std(), np.deg2rad(0.57), rtol=0.03)
    assert not np.array_equal(offsets[0], offsets[1])


def test_speed_follows_a_ramp_and_its_noise_is_noise_over_time_constant() -> None:
    noise = np.deg2rad(0.05)
    encoders = Encoders(reading_sigma(hand=noise, arm=noise), finger_offset_sigma(0.0))
    state = encoders.init(np.random.default_rng(1))
    speeds = []
    for tick in range(3000):
        state, (_, v) = encoders.update(state, np.full(N, 0.5 * 0.001 * tick), 0.001 * tick)
        speeds.append(v)
    settled = np.array(speeds[200:])
    # noise of the mean is a telescoped difference: 2 x .05 deg in 2.8 s
    np.testing.assert_allclose(settled.mean(axis=0), 0.5, atol=2e-3)
    # first-order high-pass of white noise, over the time constant: within a tenth of noise / speed_time at 1 kHz
    np.testing.assert_allclose(settled.std(), noise / encoders.speed_time, rtol=0.1)
