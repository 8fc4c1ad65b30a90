"""A run with somebody's hand in it: the loop as it is, and a hook before each step of the plant."""

from __future__ import annotations

from collections.abc import Callable

from turnscrew.plant.truth import Truth
from turnscrew.signals import FaultKind
from turnscrew.study.disturbances.disturbance import Hook
from turnscrew.task.fasten import Run
from turnscrew.task.loop import Tick

GOAL = "goal"
ONLY_BELIEVED = "goal only believed"
"""The robot takes its goal for reached, the screw has not been turned by as many rounds."""

CUT_SHORT = "cut short"
"""Nothing that the study asks for can happen in this run any more."""

See = Callable[[Tick, Truth], None]


def turn(run: Run, hook: Hook, see: See, *, at_least: float = 0.0, enough: Callable[[], bool] = lambda: False) -> str:
    """Turns the loop until it is over.

    Args:
        run: That has not begun.
        hook: What happens to the plant before each of its steps.
        see: Told of each tick, with the truth when the measurement was taken.
        at_least: Time to which the run goes on even when its goal has been reached [s].
        enough: Asked at each tick whether the study has seen enough of this run.

    Returns:
        `GOAL`, `ONLY_BELIEVED`, `CUT_SHORT`, or the name of the fault that ended the run.
    """
    reached = False
    while True:
        tick, truth = run.tick()
        see(tick, truth)
        if tick.over is not None:
            return str(tick.over.kind)
        reached = reached or run.reached_goal(tick)
        if reached and run.cell.time >= at_least:
            wanted = run.scenario.goal.rounds
            return GOAL if wanted is None or run.judge.rounds >= wanted else ONLY_BELIEVED
        if enough():
            return CUT_SHORT
        if not run.advance(hook):
            return str(FaultKind.DIVERGED)
