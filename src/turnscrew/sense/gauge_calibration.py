"""Calibration of strain gauges: readings in free air and under known loads to gains and offsets, with their errors.

Model of one gauge, t the torque of its drive:

    reading = gain t + offset + error,    Var(error) = noise^2 + (gain accuracy t)^2.

`noise` is what the readings in free air scatter by; `accuracy` is how well a loaded point is known relative to its
load: weight and lever, and the friction that stands between joint and gauge.  Weighted least squares; the weights need
the gain, so it is solved twice, first with equal weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from turnscrew.errors import TurnscrewError
from turnscrew.geometry.arrays import Array

FEWEST_FREE = 3
"""Readings in free air that a scatter needs: its own error is then 50 %."""
FEWEST_LOADS = 2
"""Loaded readings: one would leave the slope without a check on the free ones."""
LEAST_RATIO = 5.0
"""The loads' spread over the noise: below, the gain is known to no better than 20 %, which needs no calibration."""


class GaugeError(TurnscrewError):
    """Readings or loads that no calibration can be made from."""


@dataclass(frozen=True, slots=True)
class GaugeCalibration:
    """What is known of n gauges.

    Attributes:
        gain: (n,) reading per torque [reading's unit per N.m].
        offset: (n,) reading at no torque.
        gain_error: (n,) standard error of the gain.
        offset_error: (n,) standard error of the offset.
    """

    gain: Array
    offset: Array
    gain_error: Array
    offset_error: Array

    def torque(self, reading: Array) -> Array:
        """Torques [N.m] of readings (..., n)."""
        return np.asarray((reading - self.offset) / self.gain)


def calibrate_gauges(
    free: ArrayLike, readings: ArrayLike, loads: ArrayLike, accuracy: float = 0.05
) -> GaugeCalibration:
    """Gains and offsets of n gauges.

    Args:
        free: (m, n) readings in free air, m >= 3, far enough apart in time for the gauges' drift to show.
        readings: (k, n) readings under load, k >= 2.
        loads: (k, n) torques of the drives then [N.m], the links' weight included; of any signs, a different set for
            each gauge if need be.
        accuracy: Standard error of a loaded point as a share of its load, independent from load to load.

    Returns:
        The calibration.

    Raises:
        GaugeError: shapes that do not fit, too few rows, not a number, loads without spread, or a gauge that does not
            answer to its load.
    """
    f, y, t = _checked(free, readings, loads, accuracy)
    noise = f.std(axis=0, ddof=1)
    _check_spread(t, y, noise)
    torque = np.vstack([np.zeros_like(f), t])
    reading = np.vstack([f, y])
    # a gauge that repeats to the last bit still needs a finite weight
    least = 1e-9 * np.abs(reading).max(axis=0) + 1e-15
    gain = _line(torque, reading, np.ones_like(torque))[0]
    variance = noise**2 + least**2 + (accuracy * gain * torque) ** 2
    calibration = GaugeCalibration(*_line(torque, reading, 1.0 / variance))
    _check_answer(calibration)
    return calibration


def _line(x: Array, y: Array, weight: Array) -> tuple[Array, Array, Array, Array]:
    """Slope and intercept of a weighted line, column by column, and their standard errors."""
    total = weight.sum(axis=0)
    x_mean, y_mean = (weight * x).sum(axis=0) / total, (weight * y).sum(axis=0) / total
    spread = (weight * (x - x_mean) ** 2).sum(axis=0)
    slope = (weight * (x - x_mean) * (y - y_mean)).sum(axis=0) / spread
    return slope, y_mean - slope * x_mean, spread**-0.5, np.sqrt(1.0 / total + x_mean**2 / spread)


def _checked(free: ArrayLike, readings: ArrayLike, loads: ArrayLike, accuracy: float) -> tuple[Array, Array, Array]:
    names = ("readings in free air", "readings under load", "loads")
    try:
        f, y, t = (np.asarray(part, dtype=float) for part in (free, readings, loads))
    except (TypeError, ValueError):
        raise GaugeError("readings and loads must be tables of numbers, a row for each moment") from None
    for name, part in zip(names, (f, y, t), strict=True):
        if part.ndim != 2 or part.shape[1] == 0:
            raise GaugeError(f"{name}: shape {part.shape}, expected (moments, gauges)")
        if not np.isfinite(part).all():
            row, column = np.argwhere(~np.isfinite(part))[0].tolist()
            raise GaugeError(f"{name}: row {row}, gauge {column} is not a number: leave that row out")
    if y.shape != t.shape or f.shape[1] != y.shape[1]:
        raise GaugeError(
            f"readings in free air {f.shape}, under load {y.shape} and loads {t.shape} do not fit: "
            "expected (m, n), (k, n), (k, n)"
        )
    if len(f) < FEWEST_FREE or len(y) < FEWEST_LOADS:
        raise GaugeError(
            f"{len(f)} readings in free air and {len(y)} under load: at least {FEWEST_FREE} and {FEWEST_LOADS} needed"
        )
    if not 0.0 <= accuracy < 1.0:
        raise GaugeError(f"accuracy of the loads {accuracy}: a share of the load, from 0 to below 1")
    return f, y, t


def _check_spread(t: Array, y: Array, noise: Array) -> None:
    flat = np.flatnonzero(np.abs(t).max(axis=0) <= 0.0)
    if flat.size:
        raise GaugeError(f"gauge {flat[0]}: all its loads are zero, so its gain cannot be told: hang a weight on it")
    weak = np.flatnonzero(np.ptp(np.vstack([y, np.zeros_like(y[:1])]), axis=0) < LEAST_RATIO * noise)
    if weak.size:
        raise GaugeError(
            f"gauge {weak[0]}: its readings under load do not stand out of a noise of {noise[weak[0]]:.3g}: "
            "load it more, or see whether it is connected"
        )


def _check_answer(calibration: GaugeCalibration) -> None:
    dead = np.flatnonzero(~(np.abs(calibration.gain) > LEAST_RATIO * calibration.gain_error))
    if dead.size:
        i = dead[0]
        raise GaugeError(
            f"gauge {i}: gain {calibration.gain[i]:.3g} +- {calibration.gain_error[i]:.2g} cannot be told from zero: "
            "see whether it is connected and its loads have the right signs"
        )
