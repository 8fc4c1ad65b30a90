"""A finger whose force sensor hangs: known by its repeating itself, and done without.

A sensor at work never gives the same number twice while it is pressed.  One that does is not believed: whether its
finger touches is told by where it is, and how it presses by the finger opposite, since two fingers that hold a round
handle between them share its thrust and its torque.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.rotations import cross
from turnscrew.robot.coupling import DRIVE
from turnscrew.robot.joints import COUPLED, FINGERS, HAND_FINGERS
from turnscrew.signals import Measurement

OPPOSITE = {"TH": "MF", "MF": "TH", "FF": "RF", "RF": "FF"}
"""The finger that holds the handle together with each; the little finger holds it with none."""

DRIVES = [[DRIVE[joint] for joint in HAND_FINGERS[finger] if joint not in COUPLED] for finger in FINGERS]


@dataclass(frozen=True, slots=True)
class HungState:
    """What is remembered of the readings.

    Attributes:
        last: (5, m) each finger's last reading: three forces [N], or its drives' torques and zeros [N.m].
        same: (5,) time for which it has been the same to the last bit [s].
    """

    last: Array
    same: Array


@dataclass(frozen=True, slots=True)
class HungForce:
    """Finds hung sensors, and replaces what they say.

    Attributes:
        longest: Time for which a reading may stay the same [s]: five ticks.
        near: Distance from the handle up to which a finger without a sensor counts as touching it [m]: of fingers that
            touch, 999 of 1000 estimated distances are below .23 mm (forty runs), and one that leaves is beyond .6 mm
            within .1 s (600 times).
    """

    longest: float = 0.05
    near: float = 0.0006

    def init(self, measurement: Measurement) -> HungState:
        """All sensors are at work."""
        return HungState(_readings(measurement), np.zeros(len(FINGERS)))

    def update(self, state: HungState, measurement: Measurement, dt: float) -> HungState:
        """Takes a reading; one of zero is that of a finger which touches nothing, and may stay."""
        now = _readings(measurement)
        return HungState(now, _repeated(state.last, now, state.same, dt))

    def hung(self, state: HungState) -> Flags:
        """Which fingers' sensors hang (5,)."""
        return np.asarray(state.same >= self.longest)

    def believed(self, state: HungState, f_F: Array, R_WF: Array, gap: Array, n_W: Array, axis: Array) -> Array:
        """Fingertip forces (5, 3), each in its frame F, with those of hung sensors replaced [N].

        Args:
            state: Of the sensors.
            f_F: (5, 3) forces as read, each in its frame F [N].
            R_WF: (5, 3, 3) orientations of the fingertips.
            gap: (5,) distances from the handle [m].
            n_W: (5, 3) the handle's outward unit normals at the nearest points, in W.
            axis: (3,) the tool's axis in W.
        """
        hung = self.hung(state)
        if not hung.any():
            return f_F
        f_F = f_F.copy()
        for row in np.flatnonzero(hung).tolist():
            other = OPPOSITE.get(FINGERS[row])
            if gap[row] > self.near or other is None:
                f_F[row] = 0.0
            elif not hung[partner := FINGERS.index(other)]:
                f_W = R_WF[partner] @ f_F[partner]
                f_F[row] = R_WF[row].T @ _mirrored(f_W, n_W[partner], n_W[row], axis)
        return f_F


@compiled
def _repeated(last: Array, now: Array, same: Array, dt: float) -> Array:
    """Time (5,) for which readings (5, m) have been the same, and not zero [s]."""
    lasted = np.zeros(len(same))
    for row in range(len(same)):
        if (now[row] == last[row]).all() and now[row].any():
            lasted[row] = same[row] + dt
    return lasted


def _readings(measurement: Measurement) -> Array:
    """What each finger's force sensors say (5, m)."""
    if measurement.f_F is not None:
        return measurement.f_F
    readings = np.zeros((len(FINGERS), max(map(len, DRIVES))))
    if measurement.tau is not None:
        for row, drives in enumerate(DRIVES):
            readings[row, : len(drives)] = measurement.tau[drives]
    return readings


def _mirrored(f_W: Array, n: Array, other: Array, axis: Array) -> Array:
    """A force at normal n as it is at another normal: as much along normal, axis and the way round, in W [N]."""
    return np.asarray((f_W @ n) * other + (f_W @ axis) * axis + (f_W @ cross(axis, n)) * cross(axis, other))
