"""Joint encoders: noise, constant zero offsets, and speeds from filtered differences of the readings."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isnan

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.joints import ARM, JOINTS, WRIST

ARM_COUNT = 2.0 * np.pi / (4096 * 18)
"""What one count of a motor's encoder is in WAMJ4, the arm's coarsest joint [rad]: 4096 counts a turn of the motor,
which turns 18 times as far as the joint (42 and 28.25 times in the others).  Source: Barrett Technology, "WAM Arm
User's Manual", D1001 AH.00: the ratios in Table 8; magnetic encoders in newer arms, 40960 counts in the optical ones
before (appendix C, question 3)."""


def reading_sigma(hand: float, arm: float) -> Array:
    """(28,) noise of the readings: `hand` for every joint of fingers and wrist, `arm` for every joint of the arm."""
    return np.array([arm if joint in ARM else hand for joint in JOINTS])


def finger_offset_sigma(sigma: float) -> Array:
    """(28,) offset sigmas: `sigma` for every joint of the fingers, none for arm and wrist.

    A zero error of the arm or the wrist displaces the whole hand, which is the hand-to-screw calibration error; it
    is modelled once, in the screw's position.
    """
    return np.array([0.0 if joint in ARM or joint in WRIST else sigma for joint in JOINTS])


@dataclass(frozen=True, slots=True)
class EncoderState:
    """What the encoders remember between readings.

    Attributes:
        rng: Source of the noise; `update` advances it.
        offset: (28,) constant offsets of this robot [rad].
        time: Time of the last reading [s], NaN before the first.
        q: (28,) last reading [rad].
        v: (28,) filtered speed [rad/s].
    """

    rng: Generator
    offset: Array
    time: float
    q: Array
    v: Array


@dataclass(frozen=True, slots=True)
class Encoders:
    """Reading = truth + offset + noise; speed = first-order low-pass of the difference of readings.

    Attributes:
        noise: (28,) standard deviation of a reading [rad].  Shadow's Hall sensors resolve about .2 deg, 12-bit and
            oversampled to .05 deg.  The arm's encoders sit on its motors and are taken for good to one count of the
            coarsest joint, .005 deg: counting alone would err by a fourth of that, the cables may do the rest.
        offset_sigma: (28,) standard deviation of the constant offsets [rad]; .57 deg (10 mrad) is what a careful
            joint calibration of a Shadow Hand leaves.
        speed_time: Time constant of the speed's low-pass [s].  Differencing .05 deg at 1 kHz gives 70 deg/s of
            noise; 20 ms bring that to noise / speed_time = 2.5 deg/s, for a delay of less than one camera frame.
    """

    noise: Array = field(default_factory=lambda: reading_sigma(np.deg2rad(0.05), ARM_COUNT))
    offset_sigma: Array = field(default_factory=lambda: finger_offset_sigma(np.deg2rad(0.57)))
    speed_time: float = 0.02

    def init(self, rng: Generator) -> EncoderState:
        """Draw this robot's offsets."""
        zero = np.zeros(len(self.offset_sigma))
        return EncoderState(rng, rng.normal(size=len(zero)) * self.offset_sigma, np.nan, zero, zero)

    def update(self, state: EncoderState, q: Array, time: float) -> tuple[EncoderState, tuple[Array, Array]]:
        """Read the encoders.

        Args:
            state: Of the last reading.
            q: (28,) true joint angles [rad].
            time: Now [s]; later than the last reading.

        Returns:
            The new state, and the reading: (28,) angles [rad] and (28,) speeds [rad/s].
        """
        drawn = state.rng.standard_normal(len(q))
        reading, v = _read(q, state.offset, drawn, state.q, state.v, time - state.time, self.noise, self.speed_time)
        return EncoderState(state.rng, state.offset, time, reading, v), (reading, v)


@compiled
def _read(
    q: Array, offset: Array, drawn: Array, last: Array, v: Array, dt: float, noise: Array, speed_time: float
) -> tuple[Array, Array]:
    """Angles as read, and speeds, which stay what they are at the first reading, with no `dt` since another."""
    reading, speeds = np.empty(len(q)), v.copy()
    for i in range(len(q)):
        reading[i] = q[i] + offset[i] + noise[i] * drawn[i]
        if not isnan(dt):
            speeds[i] = v[i] + (dt / (speed_time + dt)) * ((reading[i] - last[i]) / dt - v[i])
    return reading, speeds
