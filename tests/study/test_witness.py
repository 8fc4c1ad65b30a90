"""What is a false alarm by the truth, and since when there is something to name."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from turnscrew.geometry.rotations import exp_so3
from turnscrew.plant.truth import Truth
from turnscrew.signals import Fault, FaultKind, Vision
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.trials.trial import LATEST, Notes
from turnscrew.study.trials.witness import SLIPPED, Witness

DT = 0.01
STILL = Truth(
    p_WT=np.zeros(3), R_WT=np.eye(3), p_WS=np.zeros(3), theta=0.0, advance=0.0, thread_torque=0.0, F_s=np.zeros(6),
    f_W=np.array([[5.0, 0, 0], [0, 0, 0], [-5.0, 0, 0], [0, 0, 0], [0, 0, 0]]),
    touching=np.array([True, False, True, False, False]), tip_in_drive=True, V_WT=np.zeros(6),
    p_WF=np.tile([0.0, 0.0, 0.125], (5, 1)), V_WF=np.zeros((5, 6)),
    c_W=np.array([[-0.018, 0, 0.125], [np.nan] * 3, [0.018, 0, 0.125], [np.nan] * 3, [np.nan] * 3]),
)  # fmt: skip


def tick(time: float, vision: Vision | None = None, kinds: tuple[FaultKind, ...] = ()) -> SimpleNamespace:
    """What the witness hears of a tick: sound readings, and an estimate that is right."""
    reading = np.zeros(28)
    measurement = SimpleNamespace(time=time, q=reading, v=reading, f_F=np.zeros((5, 3)), tau=None, vision=vision)
    estimate = SimpleNamespace(p_WT=np.zeros(3), R_WT=np.eye(3), P=1e-6 * np.eye(6))
    faults = tuple(Fault(kind, time, "", ends=False) for kind in kinds)
    return SimpleNamespace(
        measurement=measurement, estimate=estimate, faults=faults, goal=SimpleNamespace(phase="roll", round=0)
    )


def witness(*truths: Truth, seconds: float = 0.5) -> Witness:
    """One that has seen a tip at rest for half a second, and then these truths."""
    found = Witness(DT, 0.9)
    for k, truth in enumerate([STILL] * round(seconds / DT) + list(truths)):
        found.see(tick(k * DT), truth)
    return found


def false(kind: FaultKind, found: Witness, truth: Truth = STILL) -> bool:
    return found.false(Fault(kind, found.time[-1], ""), tick(found.time[-1]), truth)


@pytest.mark.parametrize(("way", "is_false"), [(0.9 * SLIPPED, True), (1.1 * SLIPPED, False)])
def test_a_tip_that_stays_within_its_play_has_not_slipped(way: float, is_false: bool) -> None:
    moved = replace(STILL, p_WT=np.array([way, 0.0, 0.0]))
    assert false(FaultKind.TIP_SLIP, witness(moved)) == is_false
    # what lies longer back is no reason of an alarm now
    assert false(FaultKind.TIP_SLIP, witness(*[moved] * 40))


def test_a_tip_beside_the_centre_that_turns_with_the_screw_does_not_slip() -> None:
    turning = []
    for theta in np.linspace(0.0, 3.0, 40):
        place = exp_so3(np.array([0.0, 0.0, -theta])) @ np.array([0.001, 0.0, 0.0])
        turning.append(replace(STILL, p_WT=place, theta=float(theta)))
    assert false(FaultKind.TIP_SLIP, witness(*turning))
    # the same places beside a screw that stands would be a slip
    assert not false(FaultKind.TIP_SLIP, witness(*(replace(truth, theta=0.0) for truth in turning)))


def test_a_tip_out_of_its_drive_is_no_false_alarm() -> None:
    out = replace(STILL, tip_in_drive=False)
    assert false(FaultKind.CAM_OUT, witness())
    assert not false(FaultKind.CAM_OUT, witness(out))
    assert witness(out).trouble(FaultKind.CAM_OUT, Span(0.0, 0.0))
    assert not witness().trouble(FaultKind.CAM_OUT, Span(0.0, 0.0))


def test_fingers_that_slide_or_are_about_to_are_no_false_alarm() -> None:
    assert false(FaultKind.FINGER_SLIP, witness())
    # 10 mm/s down the handle for 30 ms: .3 mm
    sliding = replace(STILL, V_WT=np.array([0.0, 0.0, 0.01, 0.0, 0.0, 0.0]))
    assert not false(FaultKind.FINGER_SLIP, witness(*[sliding] * 3))
    # along its normal a fingertip is dented
    dented = replace(STILL, V_WT=np.array([0.01, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert witness(*[dented] * 11).slid() == 0.0
    # of .9 x 5 N that friction holds .5 N are left
    strained = replace(STILL, f_W=STILL.f_W + np.array([[0.0, 0, 4.0]] + [[0.0, 0, 0]] * 4))
    assert not false(FaultKind.FINGER_SLIP, witness(strained))


@pytest.mark.parametrize(
    ("ticks", "mishap", "is_trouble"),
    [
        (9, Span(0.0, 1.0), False),
        (11, Span(0.0, 1.0), True),
        # what slid before the fingertip became slick, or once it has its friction back, is no trouble of its
        (11, Span(0.55, 1.0), False),
        (11, Span(0.0, 0.3), False),
    ],
)
def test_a_slick_fingertip_is_trouble_once_it_has_slid_by_a_millimetre(
    ticks: int, mishap: Span, is_trouble: bool
) -> None:
    # 10 mm/s down the handle
    sliding = replace(STILL, V_WT=np.array([0.0, 0.0, 0.01, 0.0, 0.0, 0.0]))
    assert witness(*[sliding] * ticks).trouble(FaultKind.FINGER_SLIP, mishap) is is_trouble


def test_a_camera_that_sees_is_not_lost_and_a_sound_pose_not_suspect() -> None:
    found = witness()
    sound = Vision(0.45, np.array([1e-4, 0.0, 0.0]), np.eye(3), 1e-6 * np.eye(6))
    found.see(tick(0.5, sound), STILL)
    assert false(FaultKind.VISION_LOST, found)
    assert false(FaultKind.POSE_SUSPECT, found)
    # 6 mm beside what it claims to know to 1 mm
    found.see(tick(0.51, replace(sound, p_WT=np.array([0.006, 0.0, 0.0]))), STILL)
    assert not false(FaultKind.POSE_SUSPECT, found)
    for k in range(45):
        found.see(tick(0.52 + DT * k), STILL)
    assert false(FaultKind.VISION_LOST, found)
    for k in range(45, 50):
        found.see(tick(0.52 + DT * k), STILL)
    # the watch names it after half a second, to rounding
    assert not false(FaultKind.VISION_LOST, found)


def test_other_faults() -> None:
    found = witness()
    assert false(FaultKind.FORCE_SUSPECT, found)
    found.hung = Span(0.4, 1.0)
    assert not false(FaultKind.FORCE_SUSPECT, found)
    assert false(FaultKind.CONTACT_LOST, found)
    assert not false(FaultKind.CONTACT_LOST, found, replace(STILL, touching=np.zeros(5, dtype=bool)))
    assert false(FaultKind.TOOL_DROPPED, found)
    assert not false(FaultKind.STALLED, found)


@pytest.mark.parametrize(
    ("out_at", "named_at", "until", "named", "delay"),
    [
        (1.2, 1.25, 3.0, "named", 0.05),
        (1.2, None, 3.0, "missed", math.nan),
        (1.2, 1.2 + LATEST + 0.05, 3.0, "missed", math.nan),
        (1.2, None, 1.5, "run over", math.nan),
        (None, None, 3.0, "nothing", math.nan),
    ],
)
def test_what_becomes_of_a_mishap(
    out_at: float | None, named_at: float | None, until: float, named: str, delay: float
) -> None:
    cell = SimpleNamespace(q=np.zeros(28))
    notes = Notes(cell, np.tile([-1.0, 1.0], (28, 1)), Witness(DT, 0.9), mishap=Span(1.0, 1.3))  # type: ignore[arg-type]
    notes.expected = FaultKind.CAM_OUT
    for k in range(round(until / DT)):
        time = round(k * DT, 2)
        truth = replace(STILL, tip_in_drive=out_at is None or time < out_at)
        kinds = (FaultKind.CAM_OUT,) if named_at is not None and time == round(named_at, 2) else ()
        notes.see(tick(time, kinds=kinds), truth)  # type: ignore[arg-type]
    assert notes.naming() == (named, pytest.approx(delay, nan_ok=True))
    assert not notes.false
