"""The study of stability: many held grasps, their predicted edges beside the simulator's, and a map of stable gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import nan, radians
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.study.parts import Done, part_file
from turnscrew.study.stability.dry_friction import Swing
from turnscrew.study.stability.edges import (
    WATCHED,
    Crossing,
    Prediction,
    measured_delay_edge,
    measured_gain_edge,
)
from turnscrew.study.stability.held_grasp import KICK, HeldGrasp, random_kick
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import write_parquet

RESULTS = "stability.parquet"

QUIET = (
    "robot.actuation=torque",
    "sense.encoder_noise=0",
    "sense.arm_encoder_noise=0",
    "force.noise=0",
    "force.direction_noise=0",
    "vision.position_noise=1e-5",
    "vision.rotation_noise=1e-5",
)
"""Noise excites and does not change poles; without it the grasp comes to rest.  Constant errors stay."""

MAP_FREQUENCIES = tuple(float(f) for f in np.geomspace(8.0, 128.0, 13))
MAP_DELAYS = tuple(range(0, 17, 2))
BEYOND = 1.5
"""How far beyond the edge it is seen what becomes of the grasp."""


@dataclass(frozen=True)
class Case:
    """One held grasp and what is moved until it swings.

    Attributes:
        label: As it stands in the table.
        overrides: Of the scenario, `key=value` each.
        phase: Of the gait in which the tool is held.
        angle: How far the roll has come [deg].
        moved: "delay" or "gain"; "map" for the map of stable gains.
        delay: That is there already when the gain is moved [control periods].
    """

    label: str
    overrides: tuple[str, ...] = ()
    phase: str = "roll"
    angle: float = 25.0
    moved: str = "delay"
    delay: int = 0


CASES = (
    Case("default, 10 deg", angle=10.0),
    Case("default, 25 deg"),
    Case("default, 45 deg", angle=45.0),
    Case("20 rad/s", ("control.frequency=20",)),
    Case("45 rad/s", ("control.frequency=45",)),
    Case("64 rad/s", ("control.frequency=64",)),
    Case("damping 0.7", ("control.damping=0.7",)),
    Case("damping 1.5", ("control.damping=1.5",)),
    Case("handle 10 mm", ("tool.handle.radius=0.010",)),
    Case("handle 12 mm", ("tool.handle.radius=0.012",)),
    Case("handle 15 mm", ("tool.handle.radius=0.015",)),
    Case("handle 15 mm, 45 rad/s", ("tool.handle.radius=0.015", "control.frequency=45")),
    Case("handle 12 mm, 64 rad/s", ("tool.handle.radius=0.012", "control.frequency=64")),
    Case("four fingers", phase="support"),
    Case("first and ring finger", phase="leave"),
    Case("control at 250 Hz", ("rate.torque=250",)),
    Case("control at 1000 Hz", ("rate.torque=1000",)),
    Case("gain at no delay", moved="gain"),
    Case("gain at 4 ms", moved="gain", delay=2),
    Case("gain at 8 ms", moved="gain", delay=4),
)
"""Angles, gains, handles, grasps and rates."""

MAP = Case("map of stable gains", moved="map")


@dataclass(frozen=True)
class Part:
    """One case: the unit of work.

    Attributes:
        case: The case.
        overrides: Of the scenario, for all cases alike.
        number: Of the case.
        seed: Of the run and, with the case's number, of the disturbance.
        file: Where its findings go.
    """

    case: Case
    number: int
    overrides: tuple[str, ...]
    seed: int
    file: Path

    @property
    def kick(self) -> Array:
        """(24,) disturbance of the driven joints [rad/s], another one for each case."""
        return random_kick(np.random.default_rng([self.seed, self.number]))


def parts(overrides: Sequence[str], seed: int, *, with_map: bool, out: Path) -> list[Part]:
    """All units of work, the map first: it takes longest."""
    wanted = ((MAP,) if with_map else ()) + CASES
    found = []
    for case in wanted:
        number, name = CASES.index(case) if case in CASES else 0, "".join(c if c.isalnum() else "-" for c in case.label)
        file = part_file(out, name, asdict(case), number, list(overrides), seed, WATCHED, KICK)
        found.append(Part(case, number, tuple(overrides), seed, file))
    return found


def work(part: Part) -> Done:
    """Holds one grasp, works out its poles and disturbs it.

    Raises:
        ScenarioError: an override is wrong, or the run ends before the grasp is held.
    """
    case = part.case
    scenario = load(None, [*QUIET, *part.overrides, *case.overrides], part.seed)
    grasp = HeldGrasp.of(scenario, case.phase, radians(case.angle))
    prediction = Prediction.of(grasp)
    known: Done = {
        "case": case.label,
        "moved": case.moved,
        "period": grasp.period,
        "frequency": scenario.control.frequency,
        "damping": scenario.control.damping,
        "radius": scenario.tool.handle.radius,
        "overrides": [*part.overrides, *case.overrides],
    }
    if case.moved == "map":
        return known | _map(prediction)
    return known | (_gain(part, prediction) if case.moved == "gain" else _delay(part, prediction))


def _delay(part: Part, prediction: Prediction) -> Done:
    grasp, kick = prediction.grasp, part.kick
    predicted = prediction.delay_edge(kick)
    start = 0 if np.isnan(predicted.at) else round(predicted.at)
    measured = measured_delay_edge(grasp, start, kick)
    far = round(BEYOND * (start if np.isnan(measured.at) else measured.at)) + 1
    return _found(predicted, measured, prediction.delay_edge(None)) | {
        "at_rest": prediction.linear.poles(0).continuous()[:6],
        "swing": _fastest(prediction.swings(kick, start)),
        "beyond": _beyond(grasp, far, 1.0, kick) | {"at": far},
    }


def _gain(part: Part, prediction: Prediction) -> Done:
    delay, kick = part.case.delay, part.kick
    predicted = prediction.gain_edge(kick, delay)
    start = 1.0 if np.isnan(predicted.at) else predicted.at
    measured = measured_gain_edge(prediction.grasp, delay, start, kick)
    far = BEYOND * (start if np.isnan(measured.at) else measured.at)
    return _found(predicted, measured, prediction.gain_edge(None, delay, start)) | {
        "delay": delay,
        "swing": _fastest(prediction.swings(kick, delay, start)),
        "beyond": _beyond(prediction.grasp, delay, far, kick) | {"at": far},
    }


def _fastest(swings: Sequence[Swing]) -> float:
    """Natural frequency of the swing that grows fastest [rad/s]."""
    return abs(swings[0].pole) if swings else nan


def _found(predicted: Crossing, measured: Crossing, frictionless: Crossing) -> Done:
    return {
        "predicted": predicted.at,
        "measured": measured.at,
        "frictionless": frictionless.at,
        "predicted_trials": predicted.trials,
        "measured_trials": measured.trials,
    }


def _beyond(grasp: HeldGrasp, delay: int, gain: float, kick: Array) -> Done:
    """What becomes of a grasp beyond its edge."""
    reaction = grasp.react(delay, kick, WATCHED, gain)
    return {"tilt_deg": float(np.degrees(reaction.tilt)), "holding": reaction.holding, "of": int(grasp.gripping.sum())}


def _map(prediction: Prediction) -> Done:
    """Growth of the largest swing over natural frequency and delay [1/s]."""
    usual = prediction.grasp.run.scenario.control.frequency
    growth = []
    for frequency in MAP_FREQUENCIES:
        linear = prediction.placed(frequency / usual)
        growth.append([linear.poles(delay).growth for delay in MAP_DELAYS])
    return {"frequencies": MAP_FREQUENCIES, "delays": MAP_DELAYS, "growth": growth}


def agrees(done: Done) -> bool:
    """Whether an edge was measured within a control period of the predicted delay, or within a quarter of the gain."""
    gap = abs(done["measured"] - done["predicted"])
    return bool(gap <= (1.0 if done["moved"] == "delay" else 0.25 * done["predicted"]))


def write_results(done: Sequence[Done], out: Path) -> Path:
    """One row a case: label, what is moved, predicted and measured edge, that without dry friction, their period."""
    rows = [entry for entry in done if entry["moved"] != "map"]
    columns: dict[str, Any] = {
        name: np.array([row[name] for row in rows], dtype=np.str_) for name in ("case", "moved")
    } | {
        name: np.array([row[name] for row in rows], dtype=float)
        for name in ("predicted", "frictionless", "measured", "period", "frequency", "damping", "radius", "swing")
    }
    path = out / RESULTS
    write_parquet(path, columns)
    return path
