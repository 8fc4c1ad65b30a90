"""A finger loses most of its friction under load: noticed at once, and held by more squeeze."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.study.disturbances.finger_slips import SlickFingers
from turnscrew.study.finger_slips.run import deaf
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load

THRESHOLD = 4e-4


def slipping(*, reacts: bool) -> tuple[SlickFingers, np.ndarray]:
    """Rows (time, signals of the five fingers [m]) of a torque run with one slick moment in its first roll."""
    run = Run.begin(load(None, ["robot.actuation=torque"], 777014))
    if not reacts:
        deaf(run)
    slick = SlickFingers(run.cell, np.random.default_rng(1), 0.2, first=1.1, pause=0.01)
    rows = []
    while run.cell.time < 1.55:
        tick, _ = run.tick()
        rows.append((tick.estimate.time, *tick.estimate.finger_slip))
        run.advance(slick.step)
    return slick, np.array(rows)


@pytest.fixture(scope="module")
def both() -> dict[bool, tuple[SlickFingers, np.ndarray]]:
    return {reacts: slipping(reacts=reacts) for reacts in (True, False)}


def test_a_slip_is_seen_within_a_tenth_of_a_second(both: dict[bool, tuple[SlickFingers, np.ndarray]]) -> None:
    slick, seen = both[False]
    moment = slick.made[0]
    assert moment.reached is not None
    assert seen[seen[:, 0] < moment.start, 1:].max() < THRESHOLD
    after = seen[(seen[:, 0] > moment.start) & (seen[:, 0] <= moment.reached + 0.1)]
    assert after[:, 1 + moment.finger].max() >= THRESHOLD


def test_squeeze_holds_the_finger(both: dict[bool, tuple[SlickFingers, np.ndarray]]) -> None:
    held, lost = both[True][0].made[0], both[False][0].made[0]
    assert held.start == lost.start
    assert lost.travel > 0.003
    # a threshold of .4 mm, as much again until the squeeze is there, and twice that to spare
    assert held.travel < 0.0016
