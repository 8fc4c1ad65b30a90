"""The tip is knocked out of its drive: named within half a second, and nobody presses on nothing any more.

By positions it is then searched for, which takes longer than here; with torques the run ends.
"""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.decide.recovery import Action
from turnscrew.signals import FaultKind
from turnscrew.study.disturbances.knock_out import KnockOut
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load


@pytest.mark.parametrize(("actuation", "seed"), [("position", 777031), ("torque", 777032)])
def test_a_lost_tip_is_named_soon_and_nothing_presses_any_more(actuation: str, seed: int) -> None:
    run = Run.begin(load(None, [f"robot.actuation={actuation}"], seed))
    knock = KnockOut(run.cell, 1.2, 2.0, run.scenario.screw.slot_depth)
    ticks = []
    while run.cell.time < 2.8:
        tick, _ = run.tick()
        ticks.append(tick)
        if tick.over is not None:
            break
        run.advance(knock.step)
    assert knock.out is not None
    named = [fault for tick in ticks for fault in tick.faults if fault.kind is FaultKind.CAM_OUT]
    assert named
    # frames come 33 ms late; what a loss leaves is seen in a third of a second (docs/trials.md)
    assert knock.out < named[0].time < knock.out + 0.6
    assert ticks[-1].over is None
    assert ticks[-1].goal.action == Action.RESEAT
    assert ticks[-1].goal.tip_force == 0.0
    assert ticks[-1].goal.turn_rate == 0.0
    before = [tick.estimate.tip_out for tick in ticks if tick.estimate.time < 1.2]
    assert np.max(before) < 1.0
