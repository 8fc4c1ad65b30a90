"""What happens to a robot at work, one thing in a run, by name: what its recovery is measured on."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from turnscrew.signals import FaultKind
from turnscrew.study.disturbances.camera_faults import dark
from turnscrew.study.disturbances.disturbance import Disturbance, Hook, Span
from turnscrew.study.disturbances.finger_slips import SlickFingers
from turnscrew.study.disturbances.knock_out import KnockOut
from turnscrew.study.disturbances.lost_commands import LostCommands
from turnscrew.study.disturbances.pushes import LENGTH as PUSH_LENGTH
from turnscrew.study.disturbances.pushes import Pushes
from turnscrew.study.disturbances.reading_faults import frozen
from turnscrew.study.disturbances.table import seconds, spoiling
from turnscrew.task.fasten import Run

MOMENT = (1.0, 7.0)
"""When a mishap begins, from and to [s]: after the first grip, and before the quickest run of five rounds is over."""

PUSH = 5.0
"""Of a push [N]: as much as the tip is pressed with."""

SLICK = 0.5
"""What a slick fingertip's friction is multiplied by."""


def _push(run: Run, span: Span, rng: Generator) -> Hook:
    return Pushes(run.cell, rng, span, pause=0.0, size=PUSH, most=1).step


def _slick(run: Run, span: Span, rng: Generator) -> Hook:
    return SlickFingers(run.cell, rng, SLICK, span.end - span.start, first=span.start, pause=0.0, most=1).step


def _knock(run: Run, span: Span, rng: Generator) -> Hook:
    heading = float(rng.uniform(0.0, 2.0 * np.pi))
    return KnockOut(run.cell, span.start, heading, run.scenario.screw.slot_depth).step


def _lose(run: Run, span: Span, rng: Generator) -> Hook:
    return LostCommands(run.cell, span).step


MISHAPS = {
    "push": Disturbance(f"a push of {PUSH:g} N for {PUSH_LENGTH:g} s on the handle", seconds(PUSH_LENGTH), _push),
    "slick": Disturbance(
        f"one fingertip's friction is {SLICK:g} of what it was for .3 s", seconds(0.3), _slick, FaultKind.FINGER_SLIP
    ),
    "knock": Disturbance("the tip is knocked out of the drive", seconds(0.3), _knock, FaultKind.CAM_OUT),
    "dark": Disturbance(
        "the camera is dark for 3 s", seconds(3.0), spoiling(lambda span, rng: dark(span)), FaultKind.VISION_LOST
    ),
    "frozen": Disturbance(
        "one finger's force reading hangs for 3 s", seconds(3.0), spoiling(frozen), FaultKind.FORCE_SUSPECT
    ),
    "dropout": Disturbance("no command arrives for .2 s", seconds(0.2), _lose),
}
"""Mishaps by name."""
