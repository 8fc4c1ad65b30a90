"""The judge of a run: reads the truth beside the loop's signals and says how it went."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import acos, degrees, dist, hypot, sqrt

import numpy as np

from turnscrew.contact.rolling import slip_velocity
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.euler import tilt
from turnscrew.geometry.rotations import log_so3
from turnscrew.plant.truth import Truth
from turnscrew.robot.joints import FINGERS
from turnscrew.task.loop import Tick
from turnscrew.task.summary import ForceError, PoseError, PoseErrorOf, Spread, WrenchError

LEAST_ROUND = np.radians(20.0)
"""Net angle of the screw below which a round does not count [rad]."""

LEAST_SUPPORT = 0.99
"""Share of the turning time with two fingertips in contact below which no round counts."""


@dataclass
class Sample:
    """Gathers an error's size over a run."""

    squares: float = 0.0
    largest: float = 0.0
    count: int = 0

    def add(self, value: float) -> None:
        """One more value; not-a-number does not count."""
        if value == value:
            self.squares += value * value
            self.largest = max(self.largest, abs(value))
            self.count += 1

    def spread(self) -> Spread:
        """Root mean square and maximum."""
        if not self.count:
            return Spread(rms=None, max=None)
        return Spread(rms=float(np.sqrt(self.squares / self.count)), max=float(self.largest))


@compiled
def pose_error(p_WT: Array, R_WT: Array, true_p_WT: Array, true_R_WT: Array) -> tuple[float, float, float]:
    """How far a pose of the tool is from the true one.

    Args:
        p_WT: (3,) tip position in W [m]; not a number where there is none.
        R_WT: (3, 3) orientation.
        true_p_WT: (3,) true tip position in W [m].
        true_R_WT: (3, 3) true orientation.

    Returns:
        Distance of the tips [m], angle between the axes and rotation about the true axis [rad].
    """
    away = p_WT - true_p_WT
    if not (np.isfinite(away).all() and np.isfinite(R_WT).all()):
        return np.nan, np.nan, np.nan
    turn = np.dot(true_R_WT.T, log_so3(np.dot(R_WT, true_R_WT.T)))
    return sqrt(np.dot(away, away)), hypot(turn[0], turn[1]), turn[2]


def _outwards(r: Array, axis: Array) -> Array:
    """Unit vector from the tool's axis to a point of its handle, r (3,) from the tip [m]."""
    across = r - (r @ axis) * axis
    return np.asarray(across / np.sqrt(across @ across))


@dataclass
class Judge:
    """Statistics of a run, gathered tick by tick from truth and signals."""

    dt: float
    max_tilt: float = 0.0
    tip_slip: float = 0.0
    finger_slip: float = 0.0
    rounds: int = 0
    turning: float = 0.0
    supported: float = 0.0
    samples: dict[str, Sample] = field(default_factory=dict)
    _slip: Array = field(default_factory=lambda: np.zeros((len(FINGERS), 3)))
    _gait_round: int = 0
    _theta: float = 0.0
    _in_drive: bool = True

    def watch(self, truth: Truth, tick: Tick) -> None:
        """One tick: the truth when the measurement was taken."""
        self.max_tilt = max(self.max_tilt, tilt(truth.R_WT))
        self.tip_slip = max(self.tip_slip, dist(truth.p_WT, truth.p_WS))
        self._in_drive = self._in_drive and truth.tip_in_drive
        if tick.goal.turn_rate != 0.0:
            self.turning += self.dt
            self.supported += self.dt * (int(truth.touching.sum()) >= 2)
        self._watch_fingers(truth)
        self._watch_errors(truth, tick)
        if tick.goal.round != self._gait_round:
            self._gait_round = tick.goal.round
            whole = self._in_drive and self.support_fraction > LEAST_SUPPORT
            self.rounds += bool(truth.theta - self._theta >= LEAST_ROUND and whole)
            self._theta, self._in_drive = truth.theta, truth.tip_in_drive

    @property
    def support_fraction(self) -> float:
        """Share of the turning time with at least two fingertips in contact."""
        return self.supported / self.turning if self.turning else 1.0

    def _watch_fingers(self, truth: Truth) -> None:
        for row in range(len(FINGERS)):
            if not truth.touching[row]:
                self._slip[row] = 0.0
                continue
            slip = slip_velocity(truth.c_W[row], truth.p_WT, truth.V_WT, truth.p_WF[row], truth.V_WF[row])
            # what goes along the normal dents the fingertip and slides nowhere
            n = _outwards(truth.c_W[row] - truth.p_WT, truth.R_WT[:, 2])
            self._slip[row] += (slip - (slip @ n) * n) * self.dt
            self.finger_slip = max(self.finger_slip, hypot(*self._slip[row]))

    def _watch_errors(self, truth: Truth, tick: Tick) -> None:
        estimate, vision = tick.estimate, tick.measurement.vision
        self._pose("refined", estimate.p_WT, estimate.R_WT, truth)
        if vision is not None:
            self._pose("raw", vision.p_WT, vision.R_WT, truth)
        self._sample("wrench.force", dist(estimate.F_s[:3], truth.F_s[:3]))
        self._sample("wrench.torque", float(estimate.F_s[5] - truth.F_s[5]))
        for row in np.flatnonzero(truth.touching & estimate.touching):
            f, g = truth.f_W[row], estimate.f_W[row]
            size, other = hypot(*f), hypot(*g)
            self._sample("force.magnitude", other - size)
            if size > 0.5 and other > 0.5:
                self._sample("force.direction", acos(min(max(float(f @ g) / (size * other), -1.0), 1.0)))

    def _pose(self, name: str, p_WT: Array, R_WT: Array, truth: Truth) -> None:
        position, lean, turn = pose_error(p_WT, R_WT, truth.p_WT, truth.R_WT)
        self._sample(f"{name}.position", position * 1e3)
        self._sample(f"{name}.tilt", degrees(lean))
        self._sample(f"{name}.yaw", degrees(turn))

    def _sample(self, name: str, value: float) -> None:
        self.samples.setdefault(name, Sample()).add(value)

    def _spread(self, name: str) -> Spread:
        return self.samples.get(name, Sample()).spread()

    def pose_error(self) -> PoseError:
        """Errors of the raw and of the refined pose."""

        def of(name: str) -> PoseErrorOf:
            return PoseErrorOf(
                position_mm=self._spread(f"{name}.position"),
                tilt_deg=self._spread(f"{name}.tilt"),
                yaw_deg=self._spread(f"{name}.yaw"),
            )

        return PoseError(raw=of("raw"), refined=of("refined"))

    def wrench_error(self) -> WrenchError:
        """Error of the tip wrench."""
        return WrenchError(force_n=self._spread("wrench.force"), torque_nm=self._spread("wrench.torque"))

    def force_error(self) -> ForceError:
        """Error of the fingertip forces."""
        direction = self._spread("force.direction")
        in_degrees = Spread(
            rms=None if direction.rms is None else float(np.degrees(direction.rms)),
            max=None if direction.max is None else float(np.degrees(direction.max)),
        )
        return ForceError(magnitude_n=self._spread("force.magnitude"), direction_deg=in_degrees)
