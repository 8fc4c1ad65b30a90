"""Slips of the tip against the alarms that were raised, one event each."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.truth import Truth
from turnscrew.study.disturbances.tip_slips import Slip
from turnscrew.task.loop import Tick

FALSE = "false alarm"

IN_TIME = 0.1
"""Time after a millimetre of travel within which a slip is detected in time [s]."""

LATEST = 1.0
"""Time after it from which on an alarm is not that slip's any more [s]."""

APART = 1.0
"""Alarms with less between them are one [s]."""

IN_SLOT = 0.0023
"""Distance of the tip from the drive's centre below which it is in the open slot [m]: 2 mm of way, and its play."""

WINDOW = (-0.2, 0.5)
"""Stretch around a slip in which the signal is kept [s]."""


@dataclass(frozen=True)
class SlipEvent:
    """One disturbance that was to make the tip slip.

    Attributes:
        kind: What was done.
        seed: Of the run.
        phase: Phase of the gait in which it began.
        start: When [s].
        length: How long it lasted [s].
        peak: Largest force along the slot [N].
        rise: Time until the tip had travelled by a millimetre [s]; None if it never did.
        travel_mm: How far it travelled at most.
        delay: Time from that millimetre to the alarm [s], negative when the alarm came first; None without alarm.
        signal: Largest signal from the start to `LATEST` after the millimetre; 1 is the alarm.
        verdict: "in time", "late", "missed"; or why it does not count: "not in slot" (when it began), "no slip" (under
            a millimetre), "alarm stood" (when it began), "run over" (before the time to detect it was).
    """

    kind: str
    seed: int
    phase: str
    start: float
    length: float
    peak: float
    rise: float | None
    travel_mm: float
    delay: float | None
    signal: float
    verdict: str


COUNTED = ("in time", "late", "missed")
"""Verdicts of slips that count."""


@dataclass(frozen=True)
class AlarmEvent:
    """One alarm in a run in which nothing slipped.

    Attributes:
        kind: "false alarm".
        seed: Of the run.
        phase: Phase of the gait.
        start: When [s].
        signal: Largest signal of this alarm.
    """

    kind: str
    seed: int
    phase: str
    start: float
    signal: float


@dataclass
class SlipWatch:
    """Notes at each tick the signal and where the tip is.

    Attributes:
        time: Of each tick [s].
        signal: `Estimate.tip_slip`.
        in_slot: Whether the tip is in its slot.
        phase: Phase of the gait.
    """

    time: list[float] = field(default_factory=list)
    signal: list[float] = field(default_factory=list)
    in_slot: list[bool] = field(default_factory=list)
    phase: list[str] = field(default_factory=list)

    def see(self, tick: Tick, truth: Truth) -> None:
        """One tick."""
        self.time.append(tick.measurement.time)
        self.signal.append(tick.estimate.tip_slip)
        self.in_slot.append(float(np.hypot(*(truth.p_WT - truth.p_WS)[:2])) < IN_SLOT)
        self.phase.append(str(tick.goal.phase))

    def left(self) -> bool:
        """Whether the tip has left its slot so long ago that a last slip has been heard: none will follow."""
        last = self.time[-1] - LATEST
        return last > 0.0 and not any(self.in_slot[int(np.searchsorted(self.time, last)) :])


def slip_event(slip: Slip, kind: str, seed: int, watch: SlipWatch) -> SlipEvent:
    """What came of a disturbance in a run that is over."""
    time, signal = np.array(watch.time), np.array(watch.signal)
    begun = min(int(np.searchsorted(time, slip.start)), len(time) - 1)
    end = slip.start if slip.reached is None else slip.reached
    heard = (time > slip.start) & (time <= end + LATEST)
    rung = np.flatnonzero(heard & (signal >= 1.0))
    delay = float(time[rung[0]] - end) if len(rung) and slip.reached is not None else None
    before = signal[(time > slip.start - 0.1) & (time <= slip.start)]
    if not watch.in_slot[begun]:
        verdict = "not in slot"
    elif slip.reached is None:
        verdict = "no slip"
    elif time[-1] < slip.reached + IN_TIME:
        verdict = "run over"
    elif len(before) and before[-1] >= 1.0:
        verdict = "alarm stood"
    elif delay is None:
        verdict = "missed"
    else:
        # ticks are told apart by less than rounding
        verdict = "in time" if delay <= IN_TIME + 1e-9 else "late"
    return SlipEvent(
        kind=kind,
        seed=seed,
        phase=watch.phase[begun],
        start=slip.start,
        length=slip.length,
        peak=slip.peak,
        rise=None if slip.reached is None else slip.reached - slip.start,
        travel_mm=1e3 * slip.travel,
        delay=delay,
        signal=float(signal[heard].max()) if heard.any() else 0.0,
        verdict=verdict,
    )


def false_alarms(seed: int, watch: SlipWatch) -> list[AlarmEvent]:
    """Alarms of a run in which nothing was disturbed."""
    alarms: list[AlarmEvent] = []
    last = -np.inf
    for time, signal, phase in zip(watch.time, watch.signal, watch.phase, strict=True):
        if signal < 1.0:
            continue
        if time - last > APART:
            alarms.append(AlarmEvent(FALSE, seed, phase, time, signal))
        else:
            alarms[-1] = replace(alarms[-1], signal=max(alarms[-1].signal, signal))
        last = time
    return alarms


def around(slip: Slip, watch: SlipWatch, dt: float) -> Array:
    """(m,) signal at the ticks of `WINDOW` around a slip's millimetre; not a number beyond the run.

    Args:
        slip: That has travelled its millimetre.
        watch: Of its run.
        dt: Period of the tick [s].
    """
    middle = int(np.searchsorted(watch.time, slip.start if slip.reached is None else slip.reached))
    rows = middle + np.arange(round(WINDOW[0] / dt), round(WINDOW[1] / dt) + 1)
    signal = np.full(len(rows), np.nan)
    inside = (rows >= 0) & (rows < len(watch.signal))
    signal[inside] = np.array(watch.signal)[rows[inside]]
    return signal
