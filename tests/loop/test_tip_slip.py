"""Slips of the tip in the closed loop, on seeds that nothing was tuned on."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.study.disturbances.tip_slips import OPEN_SLOT, REACH, Kind, Slips
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load

FINE = ("force.noise=0.05", "force.direction_noise=0.05")


def signals(run: Run, until: float, slips: Slips | None = None) -> np.ndarray:
    """Rows (time, tip_slip, distance of the tip from the drive's centre) of a run."""
    rows = []
    while run.cell.time < until:
        tick, truth = run.tick()
        rows.append((tick.estimate.time, tick.estimate.tip_slip, np.hypot(*(truth.p_WT - truth.p_WS)[:2])))
        if run.reached_goal(tick):
            break
        for _ in range(run.scenario.steps_per_tick):
            run.cell.prepare()
            if slips is not None:
                slips.step()
            run.cell.step()
    return np.array(rows)


def test_a_round_without_slip_raises_none() -> None:
    seen = signals(Run.begin(load(None, ["goal.rounds=1"], 777002)), 6.0)
    # default forces, 25 % and 30 deg, through all phases of the gait
    assert seen[:, 1].max() < 1.0
    assert seen[:, 2].max() < REACH


@pytest.mark.parametrize("kind", ["knock", "slick"])
def test_a_slip_is_seen_within_a_tenth_of_a_second(kind: Kind) -> None:
    run = Run.begin(load(None, [*OPEN_SLOT, *FINE], 777003))
    slips = Slips(run.cell, np.random.default_rng(8), kind, first=1.0, pause=0.5, length=(0.04, 0.05))
    seen = signals(run, 2.4, slips)
    # a disturbance of drawn strength need not move the tip by REACH
    slip = next(slip for slip in slips.made if slip.reached is not None)
    before = seen[seen[:, 0] < slip.start]
    assert before[:, 1].max() < 1.0
    after = seen[(seen[:, 0] > slip.start) & (seen[:, 0] <= slip.reached + 0.1)]
    assert after[:, 1].max() >= 1.0
