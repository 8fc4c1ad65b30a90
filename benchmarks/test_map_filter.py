"""How long the maximum-a-posteriori estimator takes: `python -m pytest benchmarks/test_map_filter.py`.

What is asked for is .3 ms a correction (camera, tip and contacts) in the median, from beliefs as they are within a run.
"""

from __future__ import annotations

from time import process_time

import numpy as np
import pytest
from rigs.estimation import DT, ROBOT, blur, gait, instances

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.estimate.correction import Corrector
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.filter_state import Prior
from turnscrew.estimate.handle_contacts import capsules_of
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.estimate.tool_filter import ToolFilter

TOOL = ToolInertia(0.08, np.array([0.0, 0.0, 0.13]), np.diag([1e-4, 1e-4, 1.3e-5]))


def recorded(fingers):
    """Corrections of a gait, with as many fingers in contact: block and arguments."""
    truths = gait(2)
    blurred = blur(truths, 0)
    block = ToolEstimator(ROBOT.fingertips, blurred.handle, blurred.p_WS, TipWrench(TOOL, 0.0005))
    state = block.init(blurred.measurements[0], blurred.p_WS, truths[0].R_WT)
    corrector, calls = Corrector(block.handle, block.filter, block.prior), []
    for measurement, motion in zip(blurred.measurements[1:], blurred.sent[1:], strict=True):
        state, _ = block.update(state, measurement, motion, DT)
        touch = state.touch
        if measurement.vision is not None and touch.pressing.sum() == fingers:
            seen = state.trail.to_now(measurement.vision)
            f = (state.filter, seen, blurred.p_WS, state.tips, state.capsules, touch.pressing, touch.level, 0)
            calls.append((corrector, f))
    return calls


def drawn(fingers):
    """Corrections from 3 deg and 5 mm of doubt."""
    phase = {2: "roll", 4: "four"}[fingers]
    truth = next(t for t in gait(1) if t.phase == phase and (np.linalg.norm(t.f_F, axis=1) > 4.9).sum() == fingers)
    f, prior, calls = ToolFilter(), Prior(coupling=None), []
    for one in instances(truth, np.random.default_rng(0), f, prior, 200):
        of = (one.state, one.seen, one.p_WS, one.tips, capsules_of(one.tips), one.touching, one.force, 0)
        calls.append((Corrector(one.handle, f, prior), of))
    return calls


@pytest.mark.benchmark(group="one correction", timer=process_time)
@pytest.mark.parametrize("fingers", [2, 4])
@pytest.mark.parametrize("cases", [recorded, drawn])
def test_one_correction(benchmark, cases, fingers):
    calls, turn = cases(fingers), [0]

    def one():
        corrector, arguments = calls[turn[0] % len(calls)]
        turn[0] += 1
        corrector.apply(*arguments)

    benchmark.pedantic(one, rounds=100, iterations=10, warmup_rounds=2)
    benchmark.extra_info["median_ms"] = benchmark.stats.stats.median * 1e3
    # the aim, which leaves a shared machine a factor of two to three
    assert benchmark.stats.stats.median < 0.3e-3


@pytest.mark.benchmark(group="one tick", timer=process_time)
def test_a_tick_without_a_frame(benchmark):
    truths = gait(1)
    blurred = blur(truths, 0)
    block = ToolEstimator(ROBOT.fingertips, blurred.handle, blurred.p_WS, TipWrench(TOOL, 0.0005))
    state = block.init(blurred.measurements[0], blurred.p_WS, truths[0].R_WT)
    calls = list(zip(blurred.measurements, blurred.sent, strict=True))
    now = next(call for call in calls if call[0].time > 1.0 and call[0].vision is None)
    for earlier in calls[1:150]:
        state, _ = block.update(state, *earlier, DT)
    benchmark.pedantic(lambda: block.update(state, *now, DT), rounds=100, iterations=10, warmup_rounds=2)
    # .22 ms on a shared machine, and as much again for one that is busier
    assert benchmark.stats.stats.median < 0.45e-3
