"""One run with one sensor fault at a random moment."""

from __future__ import annotations

from zlib import crc32

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.table import SENSOR_FAULTS
from turnscrew.study.disturbed import turn
from turnscrew.study.faults.events import AFTER, FaultEvent, FaultWatch, fault_event
from turnscrew.task.fasten import Run
from turnscrew.task.scenario_keys import Scenario

MOMENT = (1.0, 4.6)
"""When a fault begins, from and to [s]: the start is over by the former, and a round takes 3.6 s."""

CRASH = "crash"


def disturb(scenario: Scenario, kind: str) -> tuple[FaultEvent, Array, Array]:
    """Runs a scenario with one sensor fault.

    The moment depends on the seed alone, so that all kinds meet the same runs at the same moments.

    Args:
        scenario: What is run.
        kind: Name of a sensor fault.

    Returns:
        What came of it; (m,) time of each tick from the fault's begin [s]; (m, 3) errors there [mm, deg, deg].

    Raises:
        PlanError: no plan fits the handle.
        CameraError: the camera's calibration or its markers cannot be used.
        RenderError: pictures are wanted, and this machine cannot draw.
    """
    disturbance = SENSOR_FAULTS[kind]
    start = float(np.random.default_rng(scenario.seed).uniform(*MOMENT))
    span = Span(start, start + disturbance.length(scenario))
    run = Run.begin(scenario)
    watch = FaultWatch(span)
    with run.cell:
        hook = disturbance.put(run, span, np.random.default_rng([scenario.seed, crc32(kind.encode())]))
        try:
            outcome = turn(run, hook, lambda tick, truth: watch.see(run, tick, truth), at_least=span.end + AFTER)
        except Exception as error:  # whatever a fault leads to is a finding, and the other runs go on
            outcome = f"{CRASH}: {type(error).__name__}: {error}"
    event = fault_event(kind, scenario.seed, watch, outcome, run.judge.rounds)
    return event, np.array(watch.time) - start, np.array(watch.error)
