"""Mishaps: each happens once, when and as hard as it says, and is over then."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.knock_out import ASIDE, MOST, KnockOut
from turnscrew.study.disturbances.mishaps import MISHAPS, MOMENT, PUSH
from turnscrew.study.trials.trial import attempt
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load


def test_lost_commands_are_those_of_a_while() -> None:
    run = Run.begin(load(None, [], 7801))
    hook, heard = MISHAPS["dropout"].put(run, Span(0.2, 0.4), np.random.default_rng(1)), []
    for time in np.arange(0.0, 1.0, 0.01):
        run.cell.data.time = time
        hook()
        run.cell.write(np.full(24, time))
        heard.append(run.cell.data.ctrl[0] == time)
    assert heard == [not 0.2 <= time < 0.4 for time in np.arange(0.0, 1.0, 0.01)]


def test_knocked_tip_lies_beside_the_drive_and_is_let_go() -> None:
    run = Run.begin(load(None, ["robot.actuation=torque"], 7801))
    knock = KnockOut(run.cell, 0.8, 0.5, run.scenario.screw.slot_depth)
    forces = []

    def hook() -> None:
        knock.step()
        forces.append(np.linalg.norm(run.cell.data.xfrc_applied[run.cell.model.body("tool").id][:3]))

    while run.cell.time < 1.0:
        run.tick()
        run.advance(hook)
    truth = run.cell.truth()
    assert knock.out is not None
    assert max(forces) <= MOST + 1e-9
    assert forces[-1] == 0.0
    # let go `ASIDE` from the middle; a tool that two fingers hold swings on about their contacts
    assert np.hypot(*(truth.p_WT - truth.p_WS)[:2]) > ASIDE


def test_a_push_comes_once() -> None:
    run = Run.begin(load(None, [], 7801))
    hook = MISHAPS["push"].put(run, Span(0.2, 0.3), np.random.default_rng(1))
    tool, pushed = run.cell.model.body("tool").id, []
    for time in np.arange(0.0, 1.0, 0.001):
        run.cell.data.time = time
        hook()
        pushed.append(float(np.linalg.norm(run.cell.data.xfrc_applied[tool][:3])))
    # to a step at either end
    assert np.count_nonzero(pushed) == pytest.approx(100, abs=1)
    assert max(pushed) == pytest.approx(PUSH)


def test_a_trial_tells_what_happened_in_which_phase() -> None:
    trial = attempt(load(None, ["goal.time_limit=0.05"], 7801), "dark")
    assert trial.mishap == "dark"
    assert MOMENT[0] <= trial.mishap_s <= MOMENT[1]
    # the run was over before
    assert trial.mishap_phase == ""
