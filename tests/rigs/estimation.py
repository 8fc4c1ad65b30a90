"""A synthetic gait with known truth: the Shadow Hand's fingertips roll a handle, hand over, relocate and return.

The motion is kinematic and exact: gripping fingertips follow the handle's material without slip, at a set depth of
penetration; free ones travel in joint space.  Sensors of `turnscrew.sense` then blur it, seed by seed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from rigs.plants import Still

from turnscrew.estimate.filter_state import Prior
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import ClosestPoints, closest_points
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.joints import COUPLED, FINGERS, HAND_FINGERS, INDEX, JOINTS
from turnscrew.robot.model import Fingertips, RobotModel, driven_jacobian
from turnscrew.sense.encoders import Encoders
from turnscrew.sense.fingertip_force import FingertipForce
from turnscrew.sense.vision import NoisyTruthVision
from turnscrew.signals import Measurement
from turnscrew.study.solvers.random_corrections import Grip, Instance, drawn_corrections

DT = 0.005
RADIUS = 0.018
HANDLE = Cylinder(RADIUS, 0.05, 0.22)
P_WS = np.array([0.99137, 0.00038, 0.20549])
PENETRATION = 16e-6
"""Depth per newton [m/N]: .16 mm at 10 N."""

ARM = {"WAMJ1": -0.030, "WAMJ2": 1.187, "WAMJ3": 0.084, "WAMJ4": 0.793, "WRJ2": -0.091, "WRJ1": -0.375}
START = {
    "TH": (0.563, 1.162, 0.034, -0.100, -0.832),
    "MF": (0.219, 0.419, 0.651, 0.651),
    "FF": (0.199, 0.769, 0.535, 0.535),
    "RF": (0.016, 0.802, 0.535, 0.535),
}
AWAY = {
    "TH": (0.563, 1.162, 0.034, -0.300, -0.600),
    "MF": (0.219, 0.250, 0.500, 0.500),
    "FF": (0.155, 0.604, 0.468, 0.468),
    "RF": (-0.048, 0.700, 0.500, 0.500),
}
ROBOT = RobotModel()


@dataclass(frozen=True)
class Truth:
    """What is so at one tick."""

    time: float
    q: Array
    p_WT: Array
    R_WT: Array
    f_F: Array
    phase: str


def contact(tips: Fingertips, i: int, p_WT: Array, R_WT: Array, handle: Cylinder = HANDLE) -> ClosestPoints:
    """Closest points of fingertip i and the handle."""
    capsule = Capsule(float(tips.rho[i]), float(tips.length[i]))
    return closest_points(handle, capsule, p_WT, R_WT, tips.p_WF[i], tips.R_WF[i])


class Gait:
    """Builds the truth tick by tick."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self.q = np.zeros(len(JOINTS))
        for name, value in ARM.items():
            self.q[INDEX[name]] = value
        for finger in START:
            self._set(finger, np.array(START[finger]))
        self.time, self.yaw = 0.0, 0.0
        self.force = dict.fromkeys(FINGERS, 0.0)
        self.R_WT = self._orientation(0.0, 0.0)
        self.truths: list[Truth] = []
        for finger in ("FF", "RF"):
            self._set(finger, np.array(AWAY[finger]))
        self.force |= {"TH": 5.0, "MF": 5.0}
        self.press("TH", "MF")

    def _columns(self, finger: str) -> list[int]:
        return [INDEX[name] for name in HAND_FINGERS[finger]]

    def _set(self, finger: str, values: Array) -> None:
        self.q[self._columns(finger)] = values

    def _orientation(self, time: float, yaw: float) -> Array:
        wobble = np.deg2rad(0.8) * np.array([np.sin(2.1 * time), np.sin(3.3 * time), 0.0])
        return exp_so3(wobble) @ exp_so3(np.array([0.0, 0.0, yaw]))

    def _step_joints(self, finger: str, J: Array, d: Array) -> None:
        columns = self._columns(finger)
        J = driven_jacobian(J)[:, columns]
        dq = J.T @ np.linalg.solve(J @ J.T + 1e-12 * np.eye(len(J)), d)
        for k, column in enumerate(columns):
            name = JOINTS[column]
            self.q[column] += dq[columns.index(INDEX[COUPLED[name]])] if name in COUPLED else dq[k]

    def press(self, *fingers: str) -> None:
        """Bring fingertips to their depth along the normal."""
        for finger in fingers:
            self._press(finger)

    def _press(self, finger: str) -> None:
        i = FINGERS.index(finger)
        # Newton from within 2 mm: six steps leave rounding.
        for _ in range(6):
            tips = ROBOT.fingertips(self.q)
            point = contact(tips, i, P_WS, self.R_WT)
            J = tips.J[i, :3] - _skew(point.tip_W - tips.p_WF[i]) @ tips.J[i, 3:]
            error = -PENETRATION * self.force[finger] - point.gap
            self._step_joints(finger, point.n_W[None] @ J, np.array([error]))

    def run(
        self,
        duration: float,
        phase: str,
        turn: float = 0.0,
        force: dict[str, float] | None = None,
        travel: dict[str, Array] | None = None,
    ) -> None:
        """One phase: the tool turns by `turn`, forces ramp to `force`, free fingers go to joint angles `travel`."""
        steps = max(round(duration / self.speed / DT), 1)
        ramp = {f: (self.force[f], goal) for f, goal in (force or {}).items()}
        trips = {f: (self.q[self._columns(f)].copy(), goal) for f, goal in (travel or {}).items()}
        yaw0 = self.yaw
        for step in range(1, steps + 1):
            share = step / steps
            smooth = share * share * (3.0 - 2.0 * share)
            self.time += DT
            before = self.R_WT
            self.yaw = yaw0 + smooth * turn
            self.R_WT = self._orientation(self.time, self.yaw)
            tips = ROBOT.fingertips(self.q)
            for finger, (low, high) in ramp.items():
                self.force[finger] = low + share * (high - low)
            for i, finger in enumerate(FINGERS):
                if self.force[finger] <= 0.0:
                    continue
                point = contact(tips, i, P_WS, before)
                c = point.tip_W
                J = tips.J[i, :3] - _skew(c - tips.p_WF[i]) @ tips.J[i, 3:]
                d = self.R_WT @ before.T @ (c - P_WS) + P_WS - c
                d = d + point.n_W * (-PENETRATION * self.force[finger] - point.gap)
                self._step_joints(finger, J, d)
            for finger, (a, b) in trips.items():
                self._set(finger, a + smooth * (b - a))
            self._record(phase)

    def _record(self, phase: str) -> None:
        tips = ROBOT.fingertips(self.q)
        f_F = np.zeros((5, 3))
        for i, finger in enumerate(FINGERS):
            if self.force[finger] > 0.0:
                f_F[i] = tips.R_WF[i].T @ (-self.force[finger] * contact(tips, i, P_WS, self.R_WT).n_W)
        self.truths.append(Truth(self.time, self.q.copy(), P_WS, self.R_WT, f_F, phase))

    def touch(self, finger: str) -> Array:
        """Joint angles at which the free finger would just touch, from its start posture."""
        q = self.q.copy()
        self._set(finger, np.array(START[finger]))
        self._press(finger)
        out = self.q[self._columns(finger)].copy()
        self.q = q
        return out

    def round(self, turn: float = np.deg2rad(-45.0)) -> None:
        """Roll, four contacts, TH and MF away and back, four contacts, FF and RF away."""
        self.run(1.0, "roll", turn=turn)
        self.run(0.3, "hand over", travel={f: self.touch(f) for f in ("FF", "RF")})
        # The tool wobbles meanwhile: they aimed at where it was, so press them on to where it is.
        self.press("FF", "RF")
        self.run(0.2, "four", force={"FF": 5.0, "RF": 5.0})
        self.run(0.3, "four")
        self.run(0.15, "four", force={"TH": 0.0, "MF": 0.0})
        self.run(0.4, "support", travel={f: np.array(AWAY[f]) for f in ("TH", "MF")})
        self.run(0.4, "support", travel={f: self.touch(f) for f in ("TH", "MF")})
        self.press("TH", "MF")
        self.run(0.2, "four", force={"TH": 5.0, "MF": 5.0})
        self.run(0.3, "four")
        self.run(0.15, "four", force={"FF": 0.0, "RF": 0.0})
        self.run(0.4, "hand over", travel={f: np.array(AWAY[f]) for f in ("FF", "RF")})


@cache
def gait(rounds: int = 2, speed: float = 1.0) -> tuple[Truth, ...]:
    """The truth of a few rounds."""
    built = Gait(speed)
    built.run(0.5, "still")
    for _ in range(rounds):
        built.round()
    return tuple(built.truths)


@dataclass(frozen=True)
class Noise:
    """The noise figures of a run."""

    encoders: Encoders = field(default_factory=Encoders)
    force: FingertipForce = field(default_factory=FingertipForce)
    vision: NoisyTruthVision = field(default_factory=NoisyTruthVision)
    calibration: tuple[float, float, float] = (0.0015, 0.0015, 0.002)
    radius: float = 0.0005


@dataclass(frozen=True)
class Blurred:
    """What the robot gets: measurements, what its joints were told before each, and its wrong beliefs."""

    measurements: tuple[Measurement, ...]
    sent: Array
    p_WS: Array
    handle: Cylinder
    b_W: Array
    radius_error: float
    offset: Array


def blur(truths: tuple[Truth, ...], seed: int, noise: Noise | None = None) -> Blurred:
    """Pass the truth through the sensors."""
    noise = noise or Noise()
    rng = np.random.default_rng(seed)
    encoders, gauges, camera = noise.encoders.init(rng), noise.force.init(rng), noise.vision.init(rng)
    b = rng.normal(size=3) * noise.calibration
    radius_error = float(rng.normal() * noise.radius)
    out = []
    for truth in truths:
        encoders, (q, v) = noise.encoders.update(encoders, truth.q, truth.time)
        plant = Still(truth.time, truth.q, truth.f_F, truth.p_WT, truth.R_WT)
        gauges, f_F, _ = noise.force.update(gauges, plant)
        camera, frame, _ = noise.vision.update(camera, plant)
        out.append(Measurement(truth.time, q, v, f_F, None, frame, ""))
    handle = replace(HANDLE, radius=RADIUS - radius_error)
    q = np.array([truth.q for truth in truths])
    sent = np.diff(q, axis=0, prepend=q[:1])
    return Blurred(tuple(out), sent, P_WS - b, handle, b, radius_error, encoders.offset)


def instances(truth: Truth, rng: np.random.Generator, filter_: ToolFilter, prior: Prior, n: int) -> Iterator[Instance]:
    """Corrections to make while the tool is held as in this truth."""
    grip = Grip(truth.q, truth.p_WT, truth.R_WT, np.linalg.norm(truth.f_F, axis=1), HANDLE)
    return drawn_corrections(grip, ROBOT, rng, filter_, prior, n)


def _skew(a: Array) -> Array:
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
