"""What a disturbance does to a measurement, and what it leaves alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from turnscrew.robot.joints import DRIVEN
from turnscrew.signals import Measurement, Vision
from turnscrew.study.disturbances.camera_faults import COLLAR, COVERED, FLIP, dark, flip, flipped
from turnscrew.study.disturbances.disturbance import Span, idle
from turnscrew.study.disturbances.reading_faults import HOLDING, frozen, no_number, silent
from turnscrew.study.disturbances.spoilt_sensors import Spoil, spoil_sensors
from turnscrew.study.disturbances.table import SENSOR_FAULTS
from turnscrew.study.disturbed import turn
from turnscrew.task.fasten import Run
from turnscrew.task.loop import Tick
from turnscrew.task.scenario import load

SPAN = Span(1.0, 1.5)


def frame(stamp: float) -> Vision:
    return Vision(stamp, np.array([0.4, 0.1, 0.2]), np.eye(3), np.eye(6))


def measured(time: float, stamp: float | None = None) -> Measurement:
    values = np.full(28, time)
    f_F, tau = np.full((5, 3), time), np.full(24, time)
    return Measurement(time, values, values, f_F, tau, None if stamp is None else frame(stamp), "")


def through(spoil: Spoil, *times: float) -> list[Measurement]:
    out: list[Measurement] = []
    for time in times:
        out.append(spoil(measured(time), out[-1] if out else None))
    return out


def test_dark_camera_loses_what_was_exposed_then() -> None:
    spoil = dark(SPAN)
    # exposed before, it still arrives; exposed within, it never does, however late
    assert spoil(measured(1.01, 0.98), None).vision is not None
    late = spoil(measured(1.52, 1.49), None)
    assert late.vision is None
    assert late.blind == COVERED
    assert spoil(measured(1.6, 1.5), None).vision is not None


def test_flip_turns_about_the_markers() -> None:
    was, now = frame(1.2), flip(frame(1.2), 0.7)
    np.testing.assert_allclose(now.p_WT + now.R_WT @ COLLAR, was.p_WT + was.R_WT @ COLLAR, atol=1e-15)
    # trace of a rotation: 1 + 2 cos
    assert np.arccos(0.5 * (np.trace(now.R_WT) - 1.0)) == pytest.approx(FLIP)
    assert now.R_WT[:, 2] @ [np.cos(0.7), np.sin(0.7), 0.0] == pytest.approx(0.0, abs=1e-15)
    assert flipped(SPAN)(measured(1.3, 1.2), None).vision.R_WT[2, 2] < 0.9
    assert flipped(SPAN)(measured(1.3, 0.9), None).vision.R_WT[2, 2] == 1.0


@pytest.mark.parametrize("seed", range(6))
def test_one_reading_is_no_number(seed: int) -> None:
    before, within, after = through(no_number(SPAN, np.random.default_rng(seed)), 0.9, 1.2, 1.5)

    def bad(m: Measurement) -> int:
        return sum(int(np.isnan(values).sum()) for values in (m.q, m.v, m.f_F, m.tau))

    assert (bad(before), bad(within), bad(after)) == (0, 1, 0)


def test_force_hangs_at_its_last_value() -> None:
    found = through(frozen(SPAN, np.random.default_rng(0)), 0.99, 1.0, 1.2, 1.5)
    sizes = [sorted({float(row[0]) for row in m.f_F}) for m in found]
    assert sizes == [[0.99], [0.99, 1.0], [0.99, 1.2], [1.5]]


def test_silent_finger_reads_zero_in_tips_and_drives() -> None:
    _, within = through(silent(SPAN, np.random.default_rng(0)), 0.9, 1.2)
    (row,) = np.flatnonzero((within.f_F == 0.0).all(axis=1))
    names = {DRIVEN[i][:2] for i in np.flatnonzero(within.tau == 0.0)}
    assert names == {("TH", "FF", "MF", "RF", "LF")[row]} <= set(HOLDING)


def test_hand_without_gauges_stays_so() -> None:
    spoil = silent(SPAN, np.random.default_rng(0))
    assert spoil(replace(measured(1.2), tau=None), None).tau is None


def test_nothing_leaves_the_run_as_it_is() -> None:
    def commands(spoilt: bool) -> list[float]:
        seen: list[float] = []

        def see(tick: Tick, truth: object) -> None:
            seen.append(float(tick.command.q.sum()))

        run = Run.begin(load(None, ["goal.time_limit=0.3"], 7))
        if spoilt:
            spoil_sensors(run, lambda now, last: now)
        hook = SENSOR_FAULTS["nothing"].put(run, Span(0.1, 0.2), np.random.default_rng(0))
        assert turn(run, hook, see) == "TIMEOUT"
        return seen

    assert commands(True) == commands(False)


@pytest.mark.parametrize("actuation", ["position", "torque"])
def test_a_frozen_reading_stays_however_often_the_joints_are_read_meanwhile(actuation: str) -> None:
    seen: list[np.ndarray] = []

    def see(tick: Tick, truth: object) -> None:
        if tick.measurement.time >= 0.2:
            seen.append(tick.measurement.f_F)

    run = Run.begin(load(None, [f"robot.actuation={actuation}", "goal.time_limit=0.3"], 7))
    spoil_sensors(run, frozen(Span(0.15, 1.0), np.random.default_rng(0)))
    with run.cell:
        turn(run, idle, see)
    # of one finger, and of no other
    assert np.sum(np.ptp(seen, axis=0).max(axis=1) == 0.0) == 1


def test_every_fault_says_what_it_is() -> None:
    scenario = load(None, [], 0)
    for name, fault in SENSOR_FAULTS.items():
        assert fault.meaning, name
        # a run of two rounds lasts 7.8 s, and a fault begins by 4.6 s
        assert 0.0 < fault.length(scenario) <= 2.0, name
