"""When a grasp really gives way: it holds the tool on the bench, against a torque that rises until it does."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from turnscrew.contact.envelope import largest_torque
from turnscrew.contact.rolling import slip_velocity
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.euler import tilt
from turnscrew.plant.truth import Truth
from turnscrew.robot.chain import robot_chain
from turnscrew.robot.joints import DRIVEN, FINGERS, finger_joints
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.signals import Estimate
from turnscrew.study.envelope.bench import BEAT, Bench, Case
from turnscrew.task.envelope import Grip

SETTLE, ENGAGE = 0.8, 1.0
"""Time for the first grip, and for the torque's rise to `BEGIN` [s]."""

BEGIN, END, SECONDS = 0.5, 1.4, 4.5
"""Then the torque that is asked for goes from the first to the second share of a guess, in that time [s]."""

SLIPPED = 1e-3
"""Slip of a finger that counts as giving way [m]."""

LACKING = 0.1
"""Share of the guess by which the torque may stay behind what is asked for: the contacts' damping and joint friction
take 2 %."""

LEANING = np.radians(5.0)
"""Tilt that counts as giving way [rad]: two and a half times what a run may show."""

SMOOTH = 0.05
"""Time constant of the torque that is read [s]: the blade chatters in its slot."""


class End(StrEnum):
    """How a grasp gave way."""

    SLIPPED = "slipped"
    LACKING = "torque lacking"
    LEANING = "tool leaning"
    TIP_OUT = "tip out"
    HELD = "held"


@dataclass
class Traces:
    """What was seen, beat by beat.

    Attributes:
        time: Since the grip had settled [s].
        asked: Torque asked for [N.m].
        got: Torque on the screw, smoothed [N.m].
        turned: Angle by which the screw has turned [rad].
        slip: (5,) of each fingertip [m].
        pressing: (5,) its squeeze [N].
        load: Largest torque of a drive over its limit.
        room: Least distance of a joint of the holding fingers from its limit [rad].
    """

    time: list[float] = field(default_factory=list)
    asked: list[float] = field(default_factory=list)
    got: list[float] = field(default_factory=list)
    turned: list[float] = field(default_factory=list)
    slip: list[Array] = field(default_factory=list)
    pressing: list[Array] = field(default_factory=list)
    load: list[float] = field(default_factory=list)
    room: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class GaveWay:
    """What was found.

    Attributes:
        torque: Largest torque on the screw [N.m].
        there: What the envelope says of posture and contacts at that moment [N.m]: by then the grasp has rolled on.
        end: What ended it.
        finger: Which finger had slipped farthest.
        slip: How far [m].
        traces: What was seen.
    """

    torque: float
    there: float
    end: End
    finger: str
    slip: float
    traces: Traces


def give_way(case: Case, guess: float) -> GaveWay:
    """Raises the torque until the grasp gives way.

    Args:
        case: The grasp.
        guess: Torque at which it may [N.m]; the torque rises to 1.4 times that.
    """
    bench, traces = Bench(case), Traces()
    cell = bench.cell
    last = bench.estimate(cell.truth())
    slip, got, best, end = np.zeros((len(FINGERS), 3)), 0.0, 0.0, End.HELD
    steps = round(BEAT * case.scenario.rate.plant)
    joints = [joint for finger in case.grip.fingers for joint in finger_joints(finger)]
    low, high = robot_chain().limits[joints].T
    while end is End.HELD and cell.time < SETTLE + ENGAGE + SECONDS:
        truth = cell.truth()
        asked = guess * ramp(cell.time - SETTLE)
        estimate = bench.beat(truth, asked)
        got += BEAT / SMOOTH * (float(truth.F_s[5]) - got)
        if cell.time > SETTLE:
            slip = slip + BEAT * _sliding(truth, case.grip)
            _note(traces, truth, estimate, asked, got, slip)
            traces.load.append(float((np.abs(cell.data.ctrl[: len(DRIVEN)]) / DRIVE_LIMITS).max()))
            traces.room.append(float(np.minimum(cell.q[joints] - low, high - cell.q[joints]).min()))
            best, last = (got, estimate) if got > best else (best, last)
            end = _ended(truth, traces, guess)
        for _ in range(steps):
            cell.prepare()
            cell.step()
    worst = int(np.argmax(traces.slip[-1]))
    there = largest_torque(bench.hold(last)).torque
    return GaveWay(best, there, end, FINGERS[worst], float(traces.slip[-1][worst]), traces)


def ramp(time: float) -> float:
    """Share of the guess that is asked for, a time after the grip has settled [s]."""
    if time <= ENGAGE:
        return BEGIN * max(time, 0.0) / ENGAGE
    return BEGIN + (END - BEGIN) * (time - ENGAGE) / SECONDS


def _sliding(truth: Truth, grip: Grip) -> Array:
    """Velocities (5, 3) of the handle against the fingertips that hold it [m/s]."""
    v = np.zeros((len(FINGERS), 3))
    for row in (FINGERS.index(finger) for finger in grip.fingers):
        if truth.touching[row]:
            v[row] = slip_velocity(truth.c_W[row], truth.p_WT, truth.V_WT, truth.p_WF[row], truth.V_WF[row])
    return v


def _note(traces: Traces, truth: Truth, estimate: Estimate, asked: float, got: float, slip: Array) -> None:
    traces.time.append(estimate.time - SETTLE)
    traces.asked.append(asked)
    traces.got.append(got)
    traces.turned.append(truth.theta)
    traces.slip.append(np.sqrt((slip * slip).sum(axis=1)))
    traces.pressing.append(-(truth.f_W * estimate.n_W).sum(axis=1))


def _ended(truth: Truth, traces: Traces, guess: float) -> End:
    if traces.slip[-1].max() > SLIPPED:
        return End.SLIPPED
    if traces.asked[-1] - traces.got[-1] > LACKING * guess and traces.time[-1] > ENGAGE:
        return End.LACKING
    if tilt(truth.R_WT) > LEANING:
        return End.LEANING
    return End.HELD if truth.tip_in_drive else End.TIP_OUT
