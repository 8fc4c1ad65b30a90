"""Whether trouble that was named was there by the truth, and since when there was trouble to name.

An alarm is false when the simulator's state, just before, shows nothing of what it says:

| fault | false when |
|---|---|
| `TIP_SLIP` | the tip's edge centre has kept within `SLIPPED` of where it was in the slot, for `LATELY` |
| `CAM_OUT` | the tip was in its drive all the time, for `LATELY` |
| `FINGER_SLIP` | no fingertip slid over the handle by `SLID` within `FINGERS_LATELY`, nor was it about to |
| `VISION_LOST` | a frame with a pose arrived within the time for which the camera is missed |
| `POSE_SUSPECT` | neither the frame nor the estimate errs by more than it claims, and all readings are numbers |
| `FORCE_SUSPECT` | no force sensor was made to hang |
| `CONTACT_LOST` | two fingertips touch the tool |
| `TOOL_DROPPED` | the tool leans by less than half of what is said |

A blade that crosses its play in the slot does not slip: with the default blade and slot its edge centre moves by .4 mm
along the slot and .2 mm across it at most, .45 mm in all.  Other faults state what the robot's own clock, commands
or readings say, and cannot be false.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from turnscrew.contact.rolling import slip_velocity
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.euler import tilt
from turnscrew.geometry.rotations import log_so3
from turnscrew.plant.truth import Truth
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import Fault, FaultKind
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.task.loop import Tick
from turnscrew.task.watch import Watch, legible, unread

WATCH = Watch(time_limit=0.0)
"""What the watch goes by."""

LATELY = 0.3
"""Time before an alarm of the tip in which the truth is looked at [s]: three times what naming a slip may take."""

SLIPPED = 5e-4
"""Way of the tip in its slot below which it has not slipped [m]: more than the blade's play, half a slip."""

FINGERS_LATELY = 0.2
"""The same of the fingers [s]: what their detector remembers."""

SLID = 2e-4
"""Way of a fingertip below which it has not slid [m]: half of what raises the alarm."""

SLIDES = 1e-3
"""Way of a fingertip that has to be named [m]: ten times what one creeps in a tenth of a second."""

SPARE = 2.0 * WATCH.spare
"""Force that a fingertip has to spare before friction gives way, from which on it is not about to slide [N]."""

SURPRISE = 22.5
"""Squared normalised error of a pose that its covariance explains: 99.9 % of chi-square with six degrees of freedom."""


@dataclass
class Witness:
    """Notes at each tick what is true.

    Attributes:
        dt: Period of the tick [s].
        friction: True friction of the fingertips.
        hung: When a force sensor is made to hang, if ever.
        time: Of each tick [s].
        tip: (2,) the edge centre in the screw's frame at each tick, but for a constant turn [m].
        in_drive: Whether the tip is in its drive.
        pose: True tip and orientation, for frames that come late.
        way: (5, 3) by what each fingertip slid in each tick [m].
        near: Whether a fingertip is near the end of its friction.
        framed: When the last frame with a pose arrived [s].
        sound: Whether neither that frame nor the estimate err by more than they claim.
    """

    dt: float
    friction: float
    hung: Span | None = None
    time: list[float] = field(default_factory=list)
    tip: list[Array] = field(default_factory=list)
    in_drive: list[bool] = field(default_factory=list)
    pose: list[tuple[Array, Array]] = field(default_factory=list)
    way: list[Array] = field(default_factory=list)
    near: list[bool] = field(default_factory=list)
    framed: float = -math.inf
    sound: bool = True

    def see(self, tick: Tick, truth: Truth) -> None:
        """One tick: what the loop heard and said, and the truth when the measurement was taken."""
        away, cos, sin = (truth.p_WT - truth.p_WS)[:2], math.cos(truth.theta), math.sin(truth.theta)
        self.time.append(tick.measurement.time)
        # the screw turns in by theta, clockwise
        self.tip.append(np.array([cos * away[0] - sin * away[1], sin * away[0] + cos * away[1]]))
        self.in_drive.append(truth.tip_in_drive)
        self.pose.append((truth.p_WT, truth.R_WT))
        way, spare = np.zeros((len(FINGERS), 3)), math.inf
        for row in np.flatnonzero(truth.touching).tolist():
            way[row], left = _contact(truth, row, self.friction)
            spare = min(spare, left)
        self.way.append(self.dt * way)
        self.near.append(spare < SPARE)
        self._look(tick, truth)

    def false(self, fault: Fault, tick: Tick, truth: Truth) -> bool:
        """Whether a fault of this tick is a false alarm."""
        kind, now = fault.kind, tick.measurement.time
        if kind is FaultKind.TIP_SLIP:
            return self._kept() < SLIPPED and all(self.in_drive[-self._ticks(LATELY) :])
        if kind is FaultKind.CAM_OUT:
            return all(self.in_drive[-self._ticks(LATELY) :])
        if kind is FaultKind.FINGER_SLIP:
            return self.slid() < SLID and not any(self.near[-self._ticks(FINGERS_LATELY) :])
        if kind is FaultKind.VISION_LOST:
            # a tick less: sums of ticks round
            return now - self.framed < WATCH.unseen - self.dt
        if kind is FaultKind.POSE_SUSPECT:
            return self.sound and not unread(tick.measurement)
        if kind is FaultKind.FORCE_SUSPECT:
            return self.hung is None or not self.hung.start <= now <= self.hung.end + LATELY
        if kind is FaultKind.CONTACT_LOST:
            return int(truth.touching.sum()) >= 2
        if kind is FaultKind.TOOL_DROPPED:
            return tilt(truth.R_WT) < 0.5 * WATCH.dropped
        return False

    def trouble(self, kind: FaultKind, mishap: Span) -> bool:
        """Whether a mishap has led to what a fault of this kind has to name; sensors that fail do so at once.

        At full pace fingers that come or leave may slide as far: what has slid before a fingertip became slick, or when
        it has its friction back, is not the mishap's.
        """
        if kind is FaultKind.FINGER_SLIP:
            since, now = mishap.start, self.time[-1]
            return now < mishap.end + FINGERS_LATELY and self.slid(now - since) >= SLIDES
        if kind is FaultKind.CAM_OUT:
            return not self.in_drive[-1]
        return True

    def slid(self, lately: float = FINGERS_LATELY) -> float:
        """Largest way by which a fingertip has slid over the handle within `FINGERS_LATELY`, or a shorter time [m]."""
        ticks = max(self._ticks(min(lately, FINGERS_LATELY)), 1)
        way = np.sum(self.way[-ticks:], axis=0)
        return float(np.linalg.norm(way, axis=1).max())

    def _ticks(self, span: float) -> int:
        return round(span / self.dt)

    def _kept(self) -> float:
        """Largest distance between two places of the tip in the slot, lately [m]."""
        places = np.array(self.tip[-self._ticks(LATELY) :])
        return float(np.linalg.norm(places[:, None] - places[None], axis=2).max())

    def _look(self, tick: Tick, truth: Truth) -> None:
        """A camera frame, if one came: whether it and the estimate err by no more than they claim."""
        frame = tick.measurement.vision
        if frame is None or not legible(frame):
            return
        exposed = int(np.argmin(np.abs(np.array(self.time[-100:]) - frame.stamp)))
        seen = _surprise(frame.p_WT, frame.R_WT, frame.P, *self.pose[-100:][exposed])
        believed = _surprise(tick.estimate.p_WT, tick.estimate.R_WT, tick.estimate.P, truth.p_WT, truth.R_WT)
        self.framed, self.sound = tick.measurement.time, max(seen, believed) < SURPRISE


def _contact(truth: Truth, row: int, friction: float) -> tuple[Array, float]:
    """How fast the handle slides over a fingertip [m/s], and the force that it has to spare before it does [N]."""
    c, f, z = truth.c_W[row] - truth.p_WT, truth.f_W[row], truth.R_WT[:, 2]
    out = c - (c @ z) * z
    n = out / np.linalg.norm(out)
    v = slip_velocity(truth.c_W[row], truth.p_WT, truth.V_WT, truth.p_WF[row], truth.V_WF[row])
    squeeze = -float(f @ n)
    # what goes along the normal dents the fingertip and slides nowhere
    return v - (v @ n) * n, friction * squeeze - float(np.linalg.norm(f + squeeze * n))


def _surprise(p: Array, R: Array, P: Array, p_true: Array, R_true: Array) -> float:
    """Squared normalised error of a pose; of one that claims to be exact, none."""
    error = np.concatenate([p_true - p, log_so3(R_true @ R.T)])
    return float(error @ np.linalg.solve(P, error)) if np.diag(P).all() else 0.0
