"""Strain gauges of the hand's drives: gain, offset, hysteresis, drift and noise, and a calibration that removes some.

Model of one gauge, t the torque of its drive, all errors independent from gauge to gauge:

    reading = g (1 + h(t)) t + b + d(t) + n,    torque = (reading - b^) / g^.

g and b are drawn once per robot and calibrated away but for the errors of g^ and b^.  What no calibration removes are
h, the friction between joint and gauge, whose share depends on the way the tendon last moved, and d, temperature; both
are Ornstein-Uhlenbeck processes of correlation time `wander_time`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import ARM, DRIVEN, WRIST
from turnscrew.sense.gauge_calibration import GaugeCalibration, calibrate_gauges
from turnscrew.sense.sensed import Sensed

GAUGED = np.array([joint not in ARM and joint not in WRIST for joint in DRIVEN])
"""(24,) drives with gauges: the fingers' 18.  Forces at the fingertips ask for no others; the rest read zero, since
a reading that is no number means a gauge that has failed."""

N = int(GAUGED.sum())

LEAST_GAIN = 0.2
"""A gauge that answers with less than a fifth of its rated gain is broken, not badly calibrated."""


@dataclass(frozen=True, slots=True)
class GaugeState:
    """This robot's gauges.

    Attributes:
        rng: Source of the noise; `update` advances it.
        gain: (18,) g, reading per torque.
        offset: (18,) b [N.m].
        calibration: What the robot knows of both.
        wander: (2, 18) the unit processes behind h and d.
        time: Of the last reading [s], NaN before the first.
    """

    rng: Generator
    gain: Array
    offset: Array
    calibration: GaugeCalibration
    wander: Array
    time: float


@dataclass(frozen=True, slots=True)
class StrainGauges:
    """Parameters of the model in the module's docstring; each a standard deviation unless said otherwise.

    Attributes:
        gain_error: Of g from 1, before calibration.
        offset: Of b, before calibration [N.m].
        hysteresis: Of h.  Found by trial: with .14, 95 % of steady contact forces are within 25 % and 14 deg, all
            within some 35 deg.
        drift: Of d [N.m].
        noise: Of n, a reading being the mean over a tick [N.m].
        loads: Number of known loads at calibration.
        load_accuracy: Relative error of a load.
        largest_load: Loads are evenly spaced from minus to plus this torque [N.m]: what 5 N at a fingertip make.
        free_readings: Number of readings in free air, far enough apart for the drift to show.
        wander_time: [s]: slower than a phase of a gait, faster than a run.

    Paper: Section V-B, "A calibration function was used to map the hand's strain gauge readings to the joint torques".
    """

    gain_error: float = 0.2
    offset: float = 0.05
    hysteresis: float = 0.14
    drift: float = 0.005
    noise: float = 0.005
    loads: int = 6
    load_accuracy: float = 0.05
    largest_load: float = 0.3
    free_readings: int = 10
    wander_time: float = 3.0

    def init(self, rng: Generator) -> GaugeState:
        """Draws this robot's gauges and calibrates them."""
        gain = np.maximum(1.0 + self.gain_error * rng.normal(size=N), LEAST_GAIN)
        offset = self.offset * rng.normal(size=N)
        return GaugeState(rng, gain, offset, self._calibrate(rng, gain, offset), rng.normal(size=(2, N)), np.nan)

    def _calibrate(self, rng: Generator, gain: Array, offset: Array) -> GaugeCalibration:
        """The procedure on a bench: each reading at its own time, so with its own hysteresis and drift."""
        loads = np.repeat(np.linspace(-self.largest_load, self.largest_load, self.loads)[:, None], N, axis=1)
        free = offset + np.hypot(self.noise, self.drift) * rng.normal(size=(self.free_readings, N))
        applied = loads * (1.0 + self.load_accuracy * rng.normal(size=loads.shape))
        sticking = 1.0 + self.hysteresis * rng.normal(size=loads.shape)
        readings = gain * sticking * applied + offset
        readings += np.hypot(self.noise, self.drift) * rng.normal(size=loads.shape)
        return calibrate_gauges(free, readings, loads, float(np.hypot(self.load_accuracy, self.hysteresis)))

    def update(self, state: GaugeState, plant: Sensed) -> tuple[GaugeState, None, Array]:
        """Reads the gauges.

        Args:
            state: Of the last reading.
            plant: With the true torques of the drives.

        Returns:
            The new state; no fingertip forces; tau (24,) in the order of `DRIVEN` [N.m], zero for arm and wrist.
        """
        time = plant.time
        dt = 0.0 if np.isnan(state.time) else time - state.time
        keep = np.exp(-dt / self.wander_time)
        wander = keep * state.wander + np.sqrt(1.0 - keep * keep) * state.rng.normal(size=(2, N))
        true = plant.drive_torques()[GAUGED]
        reading = state.gain * (1.0 + self.hysteresis * wander[0]) * true + state.offset
        reading += self.drift * wander[1] + self.noise * state.rng.normal(size=N)
        tau = np.zeros(len(DRIVEN))
        tau[GAUGED] = state.calibration.torque(reading)
        return GaugeState(state.rng, state.gain, state.offset, state.calibration, wander, time), None, tau

    def doubt(self) -> tuple[float, float]:
        """What is left after calibration: standard error at no load [N.m], and its growth as a share of the torque."""
        at_rest = np.hypot(self.noise, self.drift) * np.sqrt(1.0 + 1.0 / self.free_readings)
        loaded = np.hypot(self.hysteresis, np.hypot(self.hysteresis, self.load_accuracy) / np.sqrt(self.loads))
        return float(at_rest), float(loaded)
