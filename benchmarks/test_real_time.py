"""How fast the loop runs: `python -m pytest benchmarks`.

Absolute times depend on the machine; what is quoted are the real-time factor of the loop on one core and the ratio of
the loop's time to that of the plant's bare steps.
"""

from __future__ import annotations

from time import process_time

import mujoco
import numpy as np
import pytest

from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load

SECONDS = 4.4
"""About one round, so that every phase is in it."""


def turn(run: Run) -> None:
    """Turns the loop for `SECONDS` of simulated time, without a record."""
    while run.cell.time < SECONDS:
        run.tick()
        for _ in range(run.scenario.steps_per_tick):
            run.cell.prepare()
            run.cell.step()


@pytest.mark.benchmark(group="loop", min_rounds=3, timer=process_time)
def test_the_loop_runs_at_least_one_and_a_half_times_real_time_on_one_core(benchmark):
    benchmark.pedantic(turn, setup=lambda: ((Run.begin(load(seed=777002)),), {}), rounds=3)
    factor = SECONDS / benchmark.stats.stats.median
    benchmark.extra_info["real_time_factor"] = factor
    assert factor >= 1.5


@pytest.mark.benchmark(group="loop", timer=process_time)
def test_the_plants_bare_steps_for_comparison(benchmark):
    run = Run.begin(load(seed=777002))
    cell = run.cell
    commands = np.array(cell.data.ctrl)

    def steps() -> None:
        cell.data.ctrl[:] = commands
        for _ in range(1000):
            mujoco.mj_step(cell.model, cell.data)

    for _ in range(200):
        run.tick()
        for _ in range(5):
            cell.prepare()
            cell.step()
    commands = np.array(cell.data.ctrl)
    benchmark.pedantic(steps, rounds=3)
