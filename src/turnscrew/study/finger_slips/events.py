"""Slips of fingers against the alarms that were raised, one event each."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.contact.rolling import slip_velocity
from turnscrew.geometry.arrays import Array
from turnscrew.plant.truth import Truth
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import GRIP
from turnscrew.study.disturbances.finger_slips import FingerMoment
from turnscrew.task.loop import Tick

IN_TIME = 0.1
"""Time after a millimetre of way within which a slip is detected in time [s]."""

LATEST = 0.5
"""Time after it from which on an alarm is not that slip's any more [s]."""

LATELY = 0.2
"""Time over which an alarm's true way is told [s]: what the detector remembers."""

TRULY = 0.0002
"""True way below which an alarm is false [m]: half of what raises it."""

WINDOW = (-0.1, 0.3)
"""Stretch around a slip in which the signal is kept [s]."""


@dataclass(frozen=True)
class FingerSlipEvent:
    """One moment in which a finger rubbed less.

    Attributes:
        kind: Of the run.
        seed: Of the run.
        finger: Its name.
        phase: Phase of the gait in which it began.
        start: When [s].
        ratio: The contact's force across its normal over that along it, when it began.
        rise: Time until the finger had slid by a millimetre [s]; None if it never did.
        travel_mm: How far it slid at most.
        down_mm: How far of it down the handle.
        delay: Time from that millimetre to the alarm [s], negative when the alarm came first; None without alarm.
        signal: Largest signal from the start to `LATEST` after the millimetre; 1 is the alarm.
        verdict: "in time", "late", "missed"; or why it does not count: "no slip" (under a millimetre), "alarm stood"
            (when it began), "run over" (before the time to detect it was).
    """

    kind: str
    seed: int
    finger: str
    phase: str
    start: float
    ratio: float
    rise: float | None
    travel_mm: float
    down_mm: float
    delay: float | None
    signal: float
    verdict: str


COUNTED = ("in time", "late", "missed")
"""Verdicts of slips that count."""


@dataclass(frozen=True)
class FingerAlarm:
    """One alarm in a run in which nothing was disturbed.

    Attributes:
        seed: Of the run.
        finger: Its name.
        phase: Phase of the gait.
        start: When [s].
        slid_mm: How far the finger had truly slid within `LATELY`.
        false: Whether that is less than `TRULY`.
    """

    seed: int
    finger: str
    phase: str
    start: float
    slid_mm: float
    false: bool


@dataclass
class FingerWatch:
    """Notes at each tick the signals and the fingers' true speeds.

    Attributes:
        threshold: Way that raises an alarm [m].
        time: Of each tick [s].
        signal: (5,) of each, `Estimate.finger_slip` over the threshold where a finger grips.
        speed: (5, 3) true velocities of the handle over the fingertips [m/s].
        phase: Phase of the gait.
    """

    threshold: float
    time: list[float] = field(default_factory=list)
    signal: list[Array] = field(default_factory=list)
    speed: list[Array] = field(default_factory=list)
    phase: list[str] = field(default_factory=list)

    def see(self, tick: Tick, truth: Truth) -> None:
        """One tick."""
        speed = np.zeros((len(FINGERS), 3))
        for row in np.flatnonzero(truth.touching):
            speed[row] = slip_velocity(truth.c_W[row], truth.p_WT, truth.V_WT, truth.p_WF[row], truth.V_WF[row])
        self.time.append(tick.measurement.time)
        self.signal.append((tick.goal.roles == GRIP) * tick.estimate.finger_slip / self.threshold)
        self.speed.append(speed)
        self.phase.append(str(tick.goal.phase))


def slip_event(moment: FingerMoment, kind: str, seed: int, watch: FingerWatch) -> FingerSlipEvent:
    """What came of a moment in a run that is over."""
    time, signal = np.array(watch.time), np.array(watch.signal)[:, moment.finger]
    end = moment.start if moment.reached is None else moment.reached
    heard = (time > moment.start) & (time <= end + LATEST)
    rung = np.flatnonzero(heard & (signal >= 1.0))
    before = signal[time <= moment.start]
    delay = float(time[rung[0]] - end) if len(rung) and moment.reached is not None else None
    if moment.reached is None:
        verdict = "no slip"
    elif len(before) and before[-1] >= 1.0:
        verdict = "alarm stood"
    elif delay is None:
        verdict = "run over" if time[-1] < moment.reached + IN_TIME else "missed"
    else:
        # ticks are told apart by less than rounding
        verdict = "in time" if delay <= IN_TIME + 1e-9 else "late"
    return FingerSlipEvent(
        kind=kind,
        seed=seed,
        finger=FINGERS[moment.finger],
        phase=watch.phase[min(int(np.searchsorted(time, moment.start)), len(time) - 1)],
        start=moment.start,
        ratio=moment.ratio,
        rise=None if moment.reached is None else moment.reached - moment.start,
        travel_mm=1e3 * moment.travel,
        down_mm=1e3 * moment.down,
        delay=delay,
        signal=float(signal[heard].max()) if heard.any() else 0.0,
        verdict=verdict,
    )


def quiet_alarms(seed: int, watch: FingerWatch, dt: float) -> list[FingerAlarm]:
    """Alarms of a run in which nothing was disturbed; dt is the tick's period [s]."""
    signal, speed, ticks = np.array(watch.signal), np.array(watch.speed), round(LATELY / dt)
    alarms = []
    for row, finger in enumerate(FINGERS):
        loud = signal[:, row] >= 1.0
        for k in np.flatnonzero(loud & ~np.concatenate([[False], loud[:-1]])):
            slid = float(np.linalg.norm(dt * speed[max(0, k - ticks) : k + 1, row].sum(axis=0)))
            alarms.append(FingerAlarm(seed, finger, watch.phase[k], watch.time[k], 1e3 * slid, slid < TRULY))
    return alarms


def around(moment: FingerMoment, watch: FingerWatch, dt: float) -> Array:
    """(m,) signal at the ticks of `WINDOW` around a slip's millimetre; not a number beyond the run.

    Args:
        moment: In which the finger slid by its millimetre.
        watch: Of its run.
        dt: Period of the tick [s].
    """
    middle = int(np.searchsorted(watch.time, moment.start if moment.reached is None else moment.reached))
    rows = middle + np.arange(round(WINDOW[0] / dt), round(WINDOW[1] / dt) + 1)
    signal = np.full(len(rows), np.nan)
    inside = (rows >= 0) & (rows < len(watch.signal))
    signal[inside] = np.array(watch.signal)[rows[inside], moment.finger]
    return signal
