"""The judge of a run: reads the truth beside the loop's signals and says how it went."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from math import acos, degrees, dist, hypot, sqrt

import numpy as np

from turnscrew.contact.rolling import slip_velocity
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.euler import tilt
from turnscrew.geometry.rotations import log_so3
from turnscrew.plant.truth import Truth
from turnscrew.robot.joints import FINGERS
from turnscrew.task.loop import Tick
from turnscrew.task.summary import ForceError, PoseError, PoseErrorOf, Spread, WrenchError

LEAST_ROUND = np.radians(20.0)
"""Net angle of the screw below which a round does not count [rad]."""

LEAST_FORCE = 0.5
"""Force below which its direction is not judged [N]."""

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


@compiled
def slipped(
    slip: Array, touching: Flags, c_W: Array, p_WT: Array, R_WT: Array, V_WT: Array, p_WF: Array, V_WF: Array, dt: float
) -> tuple[Array, float]:
    """How far fingertips have slipped over the handle since each began to touch.

    Args:
        slip: (5, 3) at the last tick, in W [m].
        touching: Which touch now; the other arguments are the truth's, too.
        c_W: (5, 3).
        p_WT: (3,).
        R_WT: (3, 3).
        V_WT: (6,).
        p_WF: (5, 3).
        V_WF: (5, 6).
        dt: Time since the last tick [s].

    Returns:
        (5, 3) in W, and the farthest of them [m].
    """
    after, farthest = np.zeros((len(slip), 3)), 0.0
    for row in range(len(slip)):
        if touching[row]:
            v = slip_velocity(c_W[row], p_WT, V_WT, p_WF[row], V_WF[row])
            # what goes along the normal dents the fingertip and slides nowhere
            r = c_W[row] - p_WT
            across = r - np.dot(r, R_WT[:, 2].copy()) * R_WT[:, 2]
            n = across / sqrt(np.dot(across, across))
            after[row] = slip[row] + (v - np.dot(v, n) * n) * dt
            farthest = max(farthest, sqrt(np.dot(after[row], after[row])))
    return after, farthest


@compiled
def force_errors(f_W: Array, true_f_W: Array, counts: Flags) -> tuple[Array, Array]:
    """Errors of fingertip forces (5, 3) that count: of their size [N], and the angle to the true one [rad], (5,) each.

    Not a number where a force does not count or, for the angle, where one of the two is below half a newton.
    """
    size, angle = np.full(len(f_W), np.nan), np.full(len(f_W), np.nan)
    for row in range(len(f_W)):
        if counts[row]:
            f, g = true_f_W[row], f_W[row]
            true, read = sqrt(np.dot(f, f)), sqrt(np.dot(g, g))
            size[row] = read - true
            if true > LEAST_FORCE and read > LEAST_FORCE:
                angle[row] = acos(min(max(np.dot(f, g) / (true * read), -1.0), 1.0))
    return size, angle


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
    samples: dict[str, Sample] = field(default_factory=lambda: defaultdict(Sample))
    _slip: Array = field(default_factory=lambda: np.zeros((len(FINGERS), 3)))
    _gait_round: int = 0
    _theta: float = 0.0
    _in_drive: bool = True
    _free: bool = False
    _before: tuple[float, float] = (0.0, 0.0)

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
        if self._free and not tick.goal.tip_free:
            # a round begins anew when the robot takes the tip to be back in its drive
            self._theta, self._in_drive = truth.theta, truth.tip_in_drive
            self._before = self.turning, self.supported
        self._free = tick.goal.tip_free
        if tick.goal.round != self._gait_round:
            self._gait_round = tick.goal.round
            whole = self._in_drive and self._support_since() > LEAST_SUPPORT
            self.rounds += bool(truth.theta - self._theta >= LEAST_ROUND and whole)
            self._theta, self._in_drive = truth.theta, truth.tip_in_drive

    def _support_since(self) -> float:
        """Share of the turning time with at least two fingertips in contact, since the tip was last put in its drive.

        What has knocked it out may have taken the handle from a finger, too; that round does not count anyhow.
        """
        turning, supported = self._before
        return (self.supported - supported) / (self.turning - turning) if self.turning > turning else 1.0

    @property
    def support_fraction(self) -> float:
        """Share of the turning time with at least two fingertips in contact."""
        return self.supported / self.turning if self.turning else 1.0

    def _watch_fingers(self, truth: Truth) -> None:
        self._slip, farthest = slipped(
            self._slip, truth.touching, truth.c_W, truth.p_WT, truth.R_WT, truth.V_WT, truth.p_WF, truth.V_WF, self.dt
        )
        self.finger_slip = max(self.finger_slip, farthest)

    def _watch_errors(self, truth: Truth, tick: Tick) -> None:
        estimate, vision = tick.estimate, tick.measurement.vision
        self._pose("refined", estimate.p_WT, estimate.R_WT, truth)
        if vision is not None:
            self._pose("raw", vision.p_WT, vision.R_WT, truth)
        x, y, z, _, _, torque = (estimate.F_s - truth.F_s).tolist()
        self._sample("wrench.force", hypot(x, y, z))
        self._sample("wrench.torque", torque)
        sizes, angles = force_errors(estimate.f_W, truth.f_W, truth.touching & estimate.touching)
        for size, angle in zip(sizes.tolist(), angles.tolist(), strict=True):
            self._sample("force.magnitude", size)
            self._sample("force.direction", angle)

    def _pose(self, name: str, p_WT: Array, R_WT: Array, truth: Truth) -> None:
        position, lean, turn = pose_error(p_WT, R_WT, truth.p_WT, truth.R_WT)
        self._sample(f"{name}.position", position * 1e3)
        self._sample(f"{name}.tilt", degrees(lean))
        self._sample(f"{name}.yaw", degrees(turn))

    def _sample(self, name: str, value: float) -> None:
        self.samples[name].add(value)

    def _spread(self, name: str) -> Spread:
        return self.samples[name].spread()

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
