"""How fast the loop runs: `python -m pytest benchmarks`.

Absolute times depend on the machine; what is quoted are the real-time factor of the loop on one core and the ratio of
the loop's time to that of the plant's bare steps, taken in turn so that both see the same machine.
"""

from __future__ import annotations

from time import process_time

import mujoco
import numpy as np
import pytest

from turnscrew.robot.joints import FINGERS
from turnscrew.signals import GRIP
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load

SECONDS = 4.4
"""About one round, so that every phase is in it."""

TORQUE = ["robot.actuation=torque"]
"""1 kHz plant, 500 Hz control, 100 Hz estimation."""


def begin(overrides=()):
    """A run whose functions are all translated: what a machine does once is not part of its pace."""
    warm = Run.begin(load(None, list(overrides), seed=777001))
    turn(warm, SECONDS)
    return Run.begin(load(None, list(overrides), seed=777002))


def turn(run: Run, until: float) -> None:
    """Turns the loop, without a record."""
    while run.cell.time < until:
        run.tick()
        run.advance(lambda: None)


def bare(run: Run) -> float:
    """Time of the plant's step in the state that the run is in [s], the state itself untouched."""
    data = run.cell.data.__copy__()
    began = process_time()
    for _ in range(20):
        mujoco.mj_step(run.cell.model, data)
    return (process_time() - began) / 20


def pace(run: Run) -> tuple[float, float]:
    """Time of a whole round of the loop, and of the plant's bare steps in it [s]."""
    loop = steps = 0.0
    while run.cell.time < SECONDS:
        until = run.cell.time + 0.1
        began = process_time()
        turn(run, until - 1e-9)
        loop += process_time() - began
        steps += bare(run) * 0.1 / run.cell.model.opt.timestep
    return loop, steps


# A machine of two cores measures 2.7 to 3.4 and 2.1 to 2.8 times real time, 2.3 to 2.9 and 3.0 to 3.7 times the bare
# steps: below these bounds something has become slower, not the machine.
@pytest.mark.parametrize(
    ("overrides", "factor", "ratio"), [((), 1.9, 4.5), (TORQUE, 1.6, 4.5)], ids=["positions", "torques"]
)
def test_the_loop_keeps_pace_on_one_core(benchmark, overrides, factor, ratio):
    runs = [begin(overrides) for _ in range(3)]
    paces = []
    benchmark.pedantic(lambda: paces.append(pace(runs.pop())), rounds=3)
    loop, steps = np.median(paces, axis=0)
    benchmark.extra_info.update(real_time_factor=SECONDS / loop, times_the_bare_steps=loop / steps)
    assert SECONDS / loop >= factor
    assert loop / steps <= ratio


@pytest.mark.benchmark(timer=process_time)
def test_control_of_four_fingers_takes_less_than_a_fifth_of_a_millisecond(benchmark):
    run = begin(TORQUE)
    while not holds(run):
        run.tick()
        run.advance(lambda: None)
    blocks, state, dt = run.loop.blocks, run.state, run.loop.dt / run.loop.beats
    estimate, goal = state.last

    def control() -> None:
        # new arrays: what is kept of the robot's dynamics is kept for these
        known = blocks.between.refresh(state.joints, estimate, 0.0)
        _, effort = blocks.controller.update(state.controller, goal, known, dt)
        blocks.adapter.update(state.adapter, goal, effort, known, dt)

    benchmark.pedantic(control, rounds=2000, warmup_rounds=50)
    assert benchmark.stats.stats.median < 0.2e-3


def holds(run: Run) -> bool:
    """Whether four fingers carry the tool, each with its whole share."""
    if run.state.last is None:
        return False
    goal = run.state.last[1]
    return int(((goal.roles == GRIP) & (goal.share >= 1.0)).sum()) == len(FINGERS) - 1
