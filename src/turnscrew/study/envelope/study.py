"""The study of the envelope: many grasps, the torque predicted for each, and that at which it really gives way.

A part is one grasp; killed, the study goes on from what is finished.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from turnscrew.contact.envelope import Verdict
from turnscrew.errors import ScenarioError
from turnscrew.robot.model import RobotModel
from turnscrew.study.envelope.bench import Case, Forces
from turnscrew.study.envelope.give_way import Traces, give_way
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.task.envelope import Grip, at, conditions
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import write_parquet
from turnscrew.task.start import plan_of

E = TypeVar("E", bound=StrEnum)

RESULTS = "give_way.parquet"

COMBINATIONS = (
    (0.010, 0.70, 10.0), (0.010, 0.90, 7.0), (0.012, 0.60, 10.0), (0.012, 0.90, 8.0), (0.0135, 0.75, 9.0),
    (0.0135, 1.00, 14.0), (0.015, 0.60, 14.0), (0.015, 0.85, 10.0), (0.0165, 0.65, 12.0), (0.0165, 0.90, 6.0),
    (0.018, 0.60, 9.0), (0.018, 0.70, 15.0), (0.018, 0.90, 10.0), (0.018, 1.00, 18.0),
)  # fmt: skip
"""Handle radius [m], friction and largest squeeze [N], chosen before any of them was simulated: radii from the thinnest
plan to the fattest, two of them between those that ship, each with a low and a high friction.  What the bench was built
with (18 mm at .8, 8 and 12 N, and at 1.0, 12 N; 12 mm at .8, 12 N; 15 mm at .7, 8 N) is not among them."""

FRACTIONS = (0.1, 0.9, 0.3, 0.7, 0.5)
"""Of the stroke, taken in turn."""


@dataclass(frozen=True)
class Part:
    """One grasp.

    Attributes:
        radius: Of the handle [m].
        friction: Of fingertips on it.
        most: Largest squeeze [N].
        grip: Which fingers hold.
        fraction: Of the stroke.
        forces: Who chooses the contact forces.
        file: Where its figures go; its traces lie beside them.
    """

    radius: float
    friction: float
    most: float
    grip: Grip
    fraction: float
    forces: Forces
    file: Path


def parts(
    combinations: Sequence[tuple[float, float, float]], grips: Sequence[Grip], forces: Sequence[Forces], out: Path
) -> list[Part]:
    """All grasps of all combinations, each under each choice of forces."""
    found = []
    for index, (radius, friction, most) in enumerate(combinations):
        for grip in grips:
            fraction = FRACTIONS[index % len(FRACTIONS)]
            for who in forces:
                key = (radius, friction, most, str(grip), fraction, str(who))
                name = f"r{radius * 1e3:g}-{grip}-{who}".replace(" ", "-")
                found.append(Part(radius, friction, most, grip, fraction, who, part_file(out, name, *key)))
    return found


def chosen_grips(names: Sequence[str] | None) -> tuple[Grip, ...]:
    """Grasps by name, all without.

    Raises:
        ScenarioError: there is none of that name.
    """
    return tuple(_one_of("--grasp", name, Grip) for name in names or Grip)


def chosen_forces(names: Sequence[str] | None) -> tuple[Forces, ...]:
    """Choices of contact forces by name, all without.

    Raises:
        ScenarioError: there is none of that name.
    """
    return tuple(_one_of("--forces", name, Forces) for name in names or Forces)


def work(part: Part) -> Done:
    """Predicts one grasp's torque, simulates it, writes its traces and returns its figures.

    Raises:
        PlanError: no gait fits the handle.
        ScenarioError: radius or friction is out of range.
    """
    overrides = [f"tool.handle.radius={part.radius}", f"contact.finger_friction={part.friction}"]
    scenario = load(None, [*overrides, "robot.actuation=torque"])
    plan = plan_of(scenario)
    moment = at(plan, RobotModel(), conditions(scenario, part.most), part.grip, part.fraction)
    done: Done = {
        "radius_mm": part.radius * 1e3, "friction": part.friction, "most_n": part.most, "grasp": str(part.grip),
        "angle_deg": float(np.degrees(moment.angle)), "forces": str(part.forces), "verdict": str(moment.steady.verdict),
        "limit": moment.limits[0].name if moment.limits else "", "predicted_nm": moment.steady.torque,
    }  # fmt: skip
    if moment.steady.verdict is not Verdict.SOLVED:
        return {
            **done,
            "gave_way_nm": np.nan,
            "ratio": np.nan,
            "end": "",
            "finger": "",
            "slip_mm": np.nan,
            "there_nm": np.nan,
        }
    found = give_way(Case(scenario, plan, part.grip, part.fraction, part.most, part.forces), moment.steady.torque)
    write_whole(part.file.with_suffix(".npz"), lambda path: _save(path, found.traces))
    return {
        **done, "gave_way_nm": found.torque, "ratio": found.torque / moment.steady.torque, "end": str(found.end),
        "finger": found.finger, "slip_mm": found.slip * 1e3, "there_nm": found.there,
    }  # fmt: skip


def write_results(done: Sequence[Done], out: Path) -> Path:
    """One row a grasp."""
    words = ("grasp", "forces", "verdict", "limit", "end", "finger")
    columns = {
        name: np.array([entry[name] for entry in done], dtype=np.str_ if name in words else float) for name in done[0]
    }
    path = out / RESULTS
    write_parquet(path, columns)
    return path


def load_traces(part: Part) -> dict[str, np.ndarray]:
    """What was seen of a part: time, asked, got, turned, slip, pressing, as in `Traces`."""
    with np.load(part.file.with_suffix(".npz")) as arrays:
        return {name: arrays[name] for name in arrays.files}


def _one_of(option: str, name: str, kinds: type[E]) -> E:
    try:
        return kinds(name)
    except ValueError:
        raise ScenarioError(f"{option} {name}: unknown; there are {', '.join(kinds)}") from None


def _save(path: Path, traces: Traces) -> None:
    with path.open("wb") as file:
        arrays: dict[str, Any] = {name: np.array(values) for name, values in vars(traces).items()}
        np.savez(file, **arrays)
