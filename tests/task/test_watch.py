"""Trouble is named from what the robot can know, and nothing is named while all is well."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.messages import estimate_of, goal_of

from turnscrew.geometry.rotations import exp_so3
from turnscrew.signals import FaultKind, Measurement, Role, Vision
from turnscrew.task.watch import Watch

WATCH = Watch(time_limit=10.0)
DT = 0.01
GRIP = np.array([Role.GRIP, 0, Role.GRIP, 0, 0])
HELD = np.array([True, False, True, False, False])


def measured(time, q=0.0, frame=True):
    vision = Vision(time, np.zeros(3), np.eye(3), np.eye(6)) if frame else None
    return Measurement(time, np.full(28, q), np.zeros(28), np.zeros((5, 3)), None, vision, "")


def watch(seconds, estimate=None, goal=None, **reading):
    state, kinds = WATCH.init(), set()
    for i in range(round(seconds / DT)):
        e = (estimate or (lambda t: estimate_of(touching=HELD)))(i * DT)
        g = (goal or (lambda t: goal_of(roles=GRIP, phase="roll" if t % 2 < 1 else "add")))(i * DT)
        state, faults = WATCH.update(state, measured(i * DT, **reading), e, g, DT)
        kinds |= {fault.kind for fault in faults}
    return kinds


def test_nothing_is_named_while_all_is_well():
    assert watch(5.0) == set()


@pytest.mark.parametrize(
    ("kind", "seconds", "arguments"),
    [
        (FaultKind.TOOL_DROPPED, 0.1, {"estimate": lambda t: estimate_of(R_WT=exp_so3(np.array([0.3, 0, 0])))}),
        (FaultKind.TIP_SLIP, 0.1, {"estimate": lambda t: estimate_of(p_WT=np.array([0.005, 0, 0]), touching=HELD)}),
        (FaultKind.CONTACT_LOST, 0.4, {"estimate": lambda t: estimate_of(touching=HELD & [1, 0, 0, 0, 0])}),
        (FaultKind.STALLED, 9.0, {"goal": lambda t: goal_of(roles=GRIP, phase="add")}),
        (FaultKind.STALLED, 1.0, {"goal": lambda t: goal_of(roles=GRIP, round=int(t > 0.5))}),
        (FaultKind.VISION_LOST, 2.2, {"frame": False}),
        (FaultKind.TIMEOUT, 10.2, {}),
        (FaultKind.DIVERGED, 0.1, {"q": np.nan}),
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


def test_evidence_tells_the_figure():
    tilted = estimate_of(R_WT=exp_so3(np.array([np.radians(20), 0, 0])))
    _, (fault,) = WATCH.update(WATCH.init(), measured(1.0), tilted, goal_of(), DT)
    assert "20.0 deg" in fault.evidence
