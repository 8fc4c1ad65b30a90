"""The tip is knocked out of its drive, and one corner of the blade comes to feel for the slot."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.signals import FaultKind
from turnscrew.study.disturbances.knock_out import KnockOut
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load

SEED = 777041


@pytest.mark.parametrize("actuation", ["position", "torque"])
def test_a_lost_tip_comes_down_on_the_head_beside_its_slot(actuation: str) -> None:
    run = Run.begin(load(None, [f"robot.actuation={actuation}", "speed.gait=2", "speed.turning=2"], SEED))
    knock = KnockOut(run.cell, 2.0, 1.0, run.scenario.screw.slot_depth)
    named = False
    with run.cell:
        while run.cell.time < 60.0:
            tick, truth = run.tick()
            named = named or any(fault.kind is FaultKind.CAM_OUT for fault in tick.faults)
            if tick.over is not None or tick.goal.phase == "reseat sweep":
                break
            run.advance(knock.step)
    assert knock.out is not None
    assert named
    assert tick.over is None
    assert tick.goal.phase == "reseat sweep"
    assert tick.goal.recoveries == 1
    half = 0.5 * run.scenario.tool.blade_width * truth.R_WT[:, 0]
    corner = min((truth.p_WT + half, truth.p_WT - half), key=lambda p: float(p[2])) - truth.p_WS
    # steel gives way by a hundredth of a millimetre
    assert abs(corner[2] - run.scenario.screw.slot_depth) < 2e-4
    # 2.7 mm from the slot's centre, and what the camera leaves of doubt
    assert np.hypot(corner[0], corner[1]) < 5e-3
    assert np.linalg.norm(tick.estimate.p_WT - truth.p_WT) < 3e-3
    # nobody believes that the thread's torque is felt
    assert tick.estimate.tip_slip == 0.0
