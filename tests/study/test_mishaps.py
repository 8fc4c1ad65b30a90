"""Mishaps: each happens once, when and as hard as it says, and is over then."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.knock_out import ASIDE, MOST, KnockOut
from turnscrew.study.disturbances.lost_commands import LossyLine
from turnscrew.study.disturbances.mishaps import MISHAPS, MOMENT, PUSH
from turnscrew.study.trials.trial import attempt
from turnscrew.task.fasten import Run
from turnscrew.task.line import Line
from turnscrew.task.scenario import load


def sent(line: Line, clock: SimpleNamespace, times: np.ndarray) -> list[float]:
    """What arrives of a command that names its time."""
    under_way: tuple[np.ndarray, ...] = ()
    arrived = []
    for time in times:
        clock.time = time
        under_way, due = line.update(under_way, np.full(24, time))
        arrived.append(float(due[0]))
    return arrived


@pytest.mark.parametrize("periods", [0, 2])
def test_lost_commands_leave_the_last_one_in_force(periods: int) -> None:
    times, clock = np.arange(20.0), SimpleNamespace(time=0.0)
    whole = sent(Line(periods), clock, times)
    lossy = sent(LossyLine(periods, Span(8.0, 12.0), clock), clock, times)
    assert lossy[:8] == whole[:8]
    assert lossy[8:12] == [whole[7]] * 4
    # what was sent meanwhile is lost; the line goes on where it would have been
    assert lossy[12:] == whole[12:]


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
