"""Fingertip forces with the error of a strain-gauge estimate: bounded, partly constant, partly wandering.

Model, for finger i with the true force f in its fingertip frame:

    reading = (1 + E a_i) exp([D d_i]x) f + n,    E = 25 %, D = 30 deg, |a_i| <= 1, |d_i| <= 1,
    a_i = s a_i^const + (1 - s) a_i^wander(t),    d_i likewise.

The constants are drawn once per robot, uniformly in the interval and in the unit ball: a calibration error.  The
wandering parts are Ornstein-Uhlenbeck processes z(t) of unit variance, correlation time `wander_time`, squashed by
z / sqrt(1 + |z|^2) into the open interval or ball: hysteresis and temperature of the gauges.  The white noise n has
no place in the paper; without it a free finger would read exactly zero, which no gauge does.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, sqrt

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.joints import FINGERS
from turnscrew.sense.sensed import Sensed

K = len(FINGERS)


@dataclass(frozen=True, slots=True)
class ForceState:
    """What the gauges remember between readings.

    Attributes:
        rng: Source of the noise; `update` advances it.
        constant: (5, 4) constant parts: gain error a, then direction error d, of the unit interval and ball.
        wander: (5, 4) the Gaussian processes z behind the wandering parts.
        time: Of the last reading [s], NaN before the first.
    """

    rng: Generator
    constant: Array
    wander: Array
    time: float


@dataclass(frozen=True, slots=True)
class FingertipForce:
    """Parameters of the error model in the module's docstring.

    Attributes:
        magnitude_error: E, bound of the relative error in magnitude.
        direction_error: D, bound of the error in direction [rad].
        constant_share: s, the share of the bound that the constant part may take; the paper does not split its
            figure, and a calibration error is the likelier half.
        wander_time: Correlation time of the wandering part [s]: slower than a phase of a gait, faster than a run.
        noise: Standard deviation of white noise per axis [N].

    Paper: footnote 7: "The estimation deviated <= 25 % in magnitude and <= 30 deg in direction".
    """

    magnitude_error: float = 0.25
    direction_error: float = np.deg2rad(30.0)
    constant_share: float = 0.6
    wander_time: float = 3.0
    noise: float = 0.03

    def init(self, rng: Generator) -> ForceState:
        """Draw this robot's constant errors and where the wandering ones start."""
        direction = rng.normal(size=(K, 3))
        direction *= np.cbrt(rng.random((K, 1))) / np.linalg.norm(direction, axis=1, keepdims=True)
        constant = np.column_stack([rng.uniform(-1.0, 1.0, K), direction])
        return ForceState(rng, constant, rng.normal(size=(K, 4)), np.nan)

    def update(self, state: ForceState, plant: Sensed) -> tuple[ForceState, Array, None]:
        """Read the fingertips.

        Args:
            state: Of the last reading.
            plant: With the true force that each fingertip exerts on what it touches, in its frame F [N].

        Returns:
            The new state; the (5, 3) reading in F [N]; no drive torques.
        """
        f_F, time = plant.fingertip_forces(), plant.time
        dt = 0.0 if isnan(state.time) else time - state.time
        keep = float(np.exp(-dt / self.wander_time))
        kick = state.rng.normal(size=(K, 4)) * sqrt(1.0 - keep * keep)
        moved = ForceState(state.rng, state.constant, keep * state.wander + kick, time)
        return moved, _misread(f_F, self.error(moved)) + state.rng.normal(0.0, self.noise, (K, 3)), None

    def error(self, state: ForceState) -> Array:
        """(5, 4) error now in force: relative gain, and rotation vector in F [rad]."""
        return _error(state.constant, state.wander, self.constant_share, self.magnitude_error, self.direction_error)


@compiled
def _error(constant: Array, z: Array, share: float, magnitude: float, direction: float) -> Array:
    """Relative gains and rotation vectors (5, 4) of the model in the module's docstring."""
    error = np.empty(z.shape)
    for i in range(len(z)):
        gain, turn = sqrt(1.0 + z[i, 0] ** 2), sqrt(1.0 + (z[i, 1] ** 2 + z[i, 2] ** 2 + z[i, 3] ** 2))
        for j in range(4):
            wander = z[i, j] / (turn if j else gain)
            error[i, j] = (share * constant[i, j] + (1.0 - share) * wander) * (direction if j else magnitude)
    return error


@compiled
def _misread(f_F: Array, error: Array) -> Array:
    """Forces (5, 3) [N] scaled and turned by relative gains and rotation vectors (5, 4) [rad]."""
    reading = np.empty(f_F.shape)
    for i in range(len(f_F)):
        reading[i] = (1.0 + error[i, 0]) * np.dot(exp_so3(error[i, 1:]), f_F[i])
    return reading
