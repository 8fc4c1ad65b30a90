"""From the record of a run to the figures that the study compares."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.plant.drive_work import DriveWork, read_drives
from turnscrew.robot.joints import ARM, FINGERS
from turnscrew.study.actuation.trace import Trace
from turnscrew.task.signal_table import read_signals

FIRM = 0.4
"""Pressing force from which on a fingertip holds the handle [N]: what a guarded contact seeks.  One that presses less
may slide, it carries nothing."""

SLIP, WITHIN = 3e-4, 0.1
"""A slip: the handle's surface moves past a fingertip that holds it by so much [m] within so much time [s].  The slow
creep of a held contact is a tenth of that; it counts in the sliding of a round."""

CLOSE = 1.0
"""Error of the tip force that counts as small [N]."""

BEGUN = 1.0
"""Time from which on the tip force is judged [s]: the first grip has built up, and the gains have eased in."""


@dataclass(frozen=True)
class RunFigures:
    """A run in numbers, all of them true ones but where it says otherwise.

    Attributes:
        time: It lasted [s].
        turned_deg: Net angle of the screw.
        tilt_deg: Largest tilt of the tool.
        tip_error: Root mean square error of the tip force while rolling [N].
        tip_close: Share of the rolling time with the tip force within `CLOSE` of the wanted.
        pressed: Pressing force, mean over all contacts and their time [N].
        asked: The same as the robot wanted it [N].
        peak: Largest pressing force of a fingertip [N].
        sliding_mm: Way of the handle's surface past fingertips that hold it, summed over holds and fingers.
        slips: How often it moved by `SLIP` within `WITHIN`.
        tip_slip_mm: Largest distance of the tip from the drive's centre.
        work_hand: Mechanical work that the hand's drives have put in [J].
        work_arm: The same of the arm's.
        heat_hand: Integral of the squared torques of the hand's drives [N2.m2.s].
        heat_arm: The same of the arm's.
    """

    time: float
    turned_deg: float
    tilt_deg: float
    tip_error: float
    tip_close: float
    pressed: float
    asked: float
    peak: float
    sliding_mm: float
    slips: int
    tip_slip_mm: float
    work_hand: float
    work_arm: float
    heat_hand: float
    heat_arm: float


def read_figures(folder: Path) -> RunFigures:
    """Figures of a run's record, as `turnscrew fasten` leaves one.

    Raises:
        RecordError: it cannot be read.
    """
    return figures_of(Trace.of(read_signals(folder)), read_drives(folder))


def figures_of(trace: Trace, drives: DriveWork) -> RunFigures:
    """Figures of a run.

    Args:
        trace: What was so at its ticks.
        drives: What its drives did.
    """
    arm, hand = slice(0, len(ARM)), slice(len(ARM), None)
    errors = trace.tip_error[trace.rolling & (trace.time > BEGUN)]
    holding = trace.pressed >= FIRM
    return RunFigures(
        time=float(trace.time[-1]),
        turned_deg=float(np.degrees(trace.theta[-1])),
        tilt_deg=float(np.degrees(trace.tilt.max())),
        tip_error=_mean(errors**2) ** 0.5,
        tip_close=_mean(np.abs(errors) <= CLOSE),
        pressed=_mean(trace.pressed[holding]),
        asked=_mean(trace.asked[np.isfinite(trace.asked)]),
        peak=float(trace.pressed.max()),
        sliding_mm=1e3 * float(travelled(trace, holding).sum()),
        slips=len(slips(trace, holding)),
        tip_slip_mm=1e3 * float(trace.tip_slip.max()),
        work_hand=float(drives.work[hand].sum()),
        work_arm=float(drives.work[arm].sum()),
        heat_hand=float(drives.heat[hand].sum()),
        heat_arm=float(drives.heat[arm].sum()),
    )


def travelled(trace: Trace, holding: Flags) -> Array:
    """(5,) way of the handle's surface past each fingertip [m]: the farthest of each hold, summed over its holds."""
    total = np.zeros(len(FINGERS))
    for finger in range(len(FINGERS)):
        # a hold lies between two changes of the flag
        edges = np.flatnonzero(np.diff(holding[:, finger].astype(int), prepend=0, append=0))
        for begin, end in edges.reshape(-1, 2):
            way = trace.sliding[begin:end, finger].cumsum(axis=0) * trace.dt
            total[finger] += np.linalg.norm(way, axis=1).max()
    return total


def slips(trace: Trace, holding: Flags) -> list[tuple[float, str]]:
    """Time [s] and finger of each slip; one that goes on is one."""
    steps = max(round(WITHIN / trace.dt), 1)
    way = np.where(holding[:, :, None], trace.sliding, 0.0).cumsum(axis=0) * trace.dt
    moved = way - np.concatenate([np.zeros((steps, *way.shape[1:])), way])[: len(way)]
    slipping = np.linalg.norm(moved, axis=-1) > SLIP
    begins = slipping & ~np.vstack([np.zeros((1, len(FINGERS)), dtype=bool), slipping[:-1]])
    return [(float(trace.time[row]), FINGERS[finger]) for row, finger in np.argwhere(begins)]


def _mean(values: Array | Flags) -> float:
    return float(values.mean()) if len(values) else float("nan")
