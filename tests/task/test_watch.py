"""Trouble is named from what the robot can know, and nothing is named while all is well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.messages import estimate_of, goal_of

from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.joints import DRIVEN
from turnscrew.signals import Effort, FaultKind, Measurement, Role, Vision
from turnscrew.task.watch import Strain, Watch

WATCH = Watch(time_limit=10.0)
DT = 0.01
GRIP = np.array([Role.GRIP, 0, Role.GRIP, 0, 0])
HELD = np.array([True, False, True, False, False])


def measured(time, q=0.0, frame=True, blind=""):
    vision = Vision(time, np.zeros(3), np.eye(3), np.eye(6)) if frame else None
    return Measurement(time, np.full(28, q), np.zeros(28), np.zeros((5, 3)), None, vision, blind)


def faults_of(seconds, estimate=None, goal=None, **reading):
    """Faults of a while; readings may be functions of time."""
    state, found = WATCH.init(), []
    for i in range(round(seconds / DT)):
        e = (estimate or (lambda t: estimate_of(touching=HELD)))(i * DT)
        g = (goal or (lambda t: goal_of(roles=GRIP, phase="roll" if t % 2 < 1 else "add")))(i * DT)
        now = {name: value(i * DT) if callable(value) else value for name, value in reading.items()}
        state, faults = WATCH.update(state, measured(i * DT, **now), e, g, DT)
        found += faults
    return found


def watch(seconds, **given):
    return {fault.kind for fault in faults_of(seconds, **given)}


def test_nothing_is_named_while_all_is_well():
    assert watch(5.0) == set()


@pytest.mark.parametrize(
    ("kind", "seconds", "arguments"),
    [
        (FaultKind.TOOL_DROPPED, 0.1, {"estimate": lambda t: estimate_of(R_WT=exp_so3(np.array([0.3, 0, 0])))}),
        (FaultKind.TIP_SLIP, 0.1, {"estimate": lambda t: estimate_of(p_WT=np.array([0.005, 0, 0]), touching=HELD)}),
        (FaultKind.CONTACT_LOST, 0.4, {"estimate": lambda t: estimate_of(touching=HELD & [1, 0, 0, 0, 0])}),
        (FaultKind.STALLED, 9.0, {"goal": lambda t: goal_of(roles=GRIP, phase="add")}),
        (FaultKind.STALLED, 1.0, {"goal": lambda t: goal_of(roles=GRIP, vain=3 if t > 0.5 else 2)}),
        (FaultKind.VISION_LOST, 0.6, {"frame": False}),
        (FaultKind.TIMEOUT, 10.2, {}),
        (FaultKind.DIVERGED, 0.1, {"estimate": lambda t: estimate_of(q=np.full(28, np.nan))}),
    ],
)
def test_each_trouble_has_its_name(kind, seconds, arguments):
    assert kind in watch(seconds, **arguments)


def test_a_short_loss_of_contact_is_no_fault():
    assert watch(1.0, estimate=lambda t: estimate_of(touching=HELD if t % 0.3 > 0.2 else ~HELD & False)) == set()


def test_a_round_that_turned_the_screw_is_no_stall():
    turning = {
        "goal": lambda t: goal_of(roles=GRIP, round=int(t > 0.5)),
        "estimate": lambda t: estimate_of(touching=HELD, theta=2 * t),
    }
    assert watch(1.0, **turning) == set()


def test_camera_that_goes_dark_for_two_seconds_is_named_once_and_lived_with():
    faults = faults_of(4.0, frame=lambda t: not 1.0 < t < 3.0)
    assert [(fault.kind, fault.ends) for fault in faults] == [(FaultKind.VISION_LOST, False)]
    # half a second after the last frame, to a tick
    assert abs(faults[0].time - 1.5) < 2 * DT


def test_camera_that_stays_dark_ends_the_run_and_so_does_one_that_never_saw():
    dark = faults_of(12.0, frame=lambda t: t < 1.0)
    late = [fault.time for fault in dark if fault.ends and fault.kind is FaultKind.VISION_LOST]
    never = [fault for fault in faults_of(3.0, frame=False, blind="no marker of DICT_4X4_50 in view") if fault.ends]
    assert abs(late[0] - 11.0) < 2 * DT
    assert abs(never[0].time - 2.0) < 2 * DT
    assert never[0].evidence == "no pose from the camera since the start: no marker of DICT_4X4_50 in view"


def test_three_refused_frames_make_the_pose_suspect_until_one_is_taken():
    verdicts = {round(t / DT): "refused" for t in (0.1, 0.2, 0.3, 0.4)} | {round(0.5 / DT): "taken"}

    def seen(t):
        return estimate_of(touching=HELD, frame=verdicts.get(round(t / DT), "none"))

    faults = faults_of(1.0, estimate=seen)
    assert [(fault.kind, fault.ends) for fault in faults] == [(FaultKind.POSE_SUSPECT, False)]
    assert abs(faults[0].time - 0.3) < DT


def test_one_reading_without_a_number_is_named_and_a_lasting_one_ends_the_run():
    once = faults_of(1.0, q=lambda t: np.nan if abs(t - 0.5) < DT / 2 else 0.0)
    assert [(fault.kind, fault.ends) for fault in once] == [(FaultKind.POSE_SUSPECT, False)]
    assert once[0].evidence == "no number from encoders"
    assert any(fault.kind is FaultKind.DIVERGED and fault.ends for fault in faults_of(0.2, q=np.nan))


def test_camera_that_tells_no_numbers_counts_as_dark():
    nothing = Vision(0.0, np.full(3, np.nan), np.eye(3), np.eye(6))
    state, found = WATCH.init(), []
    for i in range(300):
        reading = replace(measured(i * DT), vision=nothing if i % 3 == 0 else None)
        goal = goal_of(roles=GRIP, phase="roll" if i % 200 < 100 else "add")
        state, faults = WATCH.update(state, reading, estimate_of(touching=HELD), goal, DT)
        found += faults
    # suspect from the third frame; dark for half a second: named; for two from the start: the run ends
    assert [(fault.kind, fault.ends) for fault in found[:3]] == [
        (FaultKind.POSE_SUSPECT, False),
        (FaultKind.VISION_LOST, False),
        (FaultKind.VISION_LOST, True),
    ]


def test_slip_of_the_tip_is_named_when_the_signal_reaches_one():
    def slipping(t):
        return estimate_of(touching=HELD, tip_slip=2.0 if t > 0.5 else 0.3)

    assert [(fault.kind, fault.ends) for fault in faults_of(1.0, estimate=slipping)] == [(FaultKind.TIP_SLIP, False)]


def test_evidence_tells_the_figure():
    tilted = estimate_of(R_WT=exp_so3(np.array([np.radians(20), 0, 0])))
    _, (fault,) = WATCH.update(WATCH.init(), measured(1.0), tilted, goal_of(), DT)
    assert "20.0 deg" in fault.evidence


def test_a_tool_that_is_brought_back_may_lean_but_not_lie():
    def leaning(angle):
        return lambda t: estimate_of(R_WT=exp_so3(np.array([angle, 0.0, 0.0])), touching=HELD)

    carried = {"goal": lambda t: goal_of(roles=GRIP, tip_free=True)}
    assert watch(0.1, estimate=leaning(0.7), **carried) == set()
    assert watch(0.1, estimate=leaning(1.5), **carried) == {FaultKind.TOOL_DROPPED}


def test_a_drive_at_its_limit_is_named_once_with_what_is_left_out():
    lost = np.array([0.0, 0.0, -1.5, 0.0, 0.0, -0.02])
    limited = np.array([name == "MFJ2" for name in DRIVEN])
    strained = Strain(Effort(np.zeros(6), np.zeros((5, 3)), lost, lost=lost, limited=limited), limited & False)
    cut = Strain(Effort(np.zeros(6), np.zeros((5, 3)), np.zeros(6)), limited)
    easy = Strain(Effort(np.zeros(6), np.zeros((5, 3)), np.zeros(6)), limited & False)
    state, found = WATCH.init(), []
    for i, strain in enumerate((easy, strained, easy, strained, *[easy] * 51, cut)):
        state, faults = WATCH.update(
            state, measured(i * DT), estimate_of(touching=HELD), goal_of(roles=GRIP), DT, strain
        )  # fmt: skip
        found += faults
    assert [fault.kind for fault in found] == [FaultKind.TORQUE_SATURATED] * 2
    assert not any(fault.ends for fault in found)
    assert found[0].evidence == "MFJ2 at the limit: 1.5 N and 0.020 N.m are left out"


def test_a_finger_that_slides_is_named_once_and_lived_with():
    def sliding(row):
        slid = 0.0007 * (np.arange(5) == row)
        return lambda t: estimate_of(touching=HELD, finger_slip=slid if 0.5 < t < 0.6 else np.zeros(5))

    (fault,) = faults_of(1.0, estimate=sliding(2))
    assert (fault.kind, fault.ends) == (FaultKind.FINGER_SLIP, False)
    assert fault.evidence == "MF slides: 0.7 mm down the handle"
    # a finger that does not grip may slide
    assert faults_of(1.0, estimate=sliding(1)) == []


def test_trouble_that_comes_back_within_half_a_second_is_the_same():
    def flickering(period):
        # a tick of trouble in each period
        return lambda t: estimate_of(touching=HELD, tip_slip=1.5 if t % period < DT / 2 else 0.9)

    assert len(faults_of(2.0, estimate=flickering(0.25))) == 1
    assert len(faults_of(2.0, estimate=flickering(1.0))) == 2


def test_a_finger_with_little_to_spare_is_named_before_it_slides():
    def margins(one, two):
        effort = Effort(np.zeros(6), np.zeros((5, 3)), np.zeros(6), margin=np.array([one, np.nan, two, np.nan, np.nan]))
        return Strain(effort, np.zeros(24, dtype=bool))

    goal, state = goal_of(roles=GRIP, share=GRIP / Role.GRIP), WATCH.init()
    state, none = WATCH.update(state, measured(0.0), estimate_of(touching=HELD), goal, DT, margins(1.0, 1.2))
    state, (fault,) = WATCH.update(state, measured(DT), estimate_of(touching=HELD), goal, DT, margins(1.0, 0.2))
    assert none == ()
    assert (fault.kind, fault.ends) == (FaultKind.FINGER_SLIP, False)
    assert fault.evidence == "MF is about to slide: 0.2 N to spare"
    for spare in (0.6, 0.4, 0.7, 0.3):
        # not named anew for as long as it has not recovered
        state, none = WATCH.update(state, measured(DT), estimate_of(touching=HELD), goal, DT, margins(1.0, spare))
        assert none == ()
    # one that comes or goes has less to spare, and carries less
    leaving = replace(goal, share=0.5 * goal.share)
    assert (
        WATCH.update(WATCH.init(), measured(0.0), estimate_of(touching=HELD), leaving, DT, margins(1.0, 0.2))[1] == ()
    )
