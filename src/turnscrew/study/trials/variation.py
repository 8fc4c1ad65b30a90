"""What differs from trial to trial: a table of scenario keys, each with what it is drawn from and why."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any
from zlib import crc32

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.study.trials.distributions import Around, Distribution, Error, Errors, OneOf, Told
from turnscrew.task.scenario_keys import Scenario

SIZES = {"none": 0.0, "standard": 1.0, "hard": 2.0}
"""Variations by name: how many times the standard one."""

VARIED = crc32(b"variation")
"""Sets the draws of a trial apart from what its run draws from the same seed."""


@dataclass(frozen=True)
class Row:
    """One scenario key that is varied.

    Attributes:
        key: Dotted name.
        drawn: What its value is drawn from.
        meaning: What the value does in a trial.
        source: Where the distribution comes from.
        when: Key and value under which the row applies, if not always.
        beside: Key that has to be varied too, if any: what the robot is told of it.
    """

    key: str
    drawn: Distribution
    meaning: str
    source: str
    when: tuple[str, str] | None = None
    beside: str | None = None


def table(base: Scenario, variation: str, held: Iterable[str] = ()) -> tuple[Row, ...]:
    """The rows of a variation.

    Args:
        base: The scenario that is varied: masses are drawn around its own.
        variation: Of `SIZES`.
        held: Keys, or tables of keys, that are not varied because somebody has set them.

    Raises:
        ScenarioError: There is no such variation.
    """
    if variation not in SIZES:
        raise ScenarioError(f"--variation {variation}: must be one of {', '.join(SIZES)}")
    if not SIZES[variation]:
        return ()
    fixed = tuple(held)
    free = [row for row in (*_robot_rows(), *_tool_rows(base), *_screw_rows(), *_sight_rows())
            if not any(row.key == name or row.key.startswith(f"{name}.") for name in fixed)]  # fmt: skip
    keys = {row.key for row in free}
    return tuple(
        Row(row.key, row.drawn.scaled(SIZES[variation]), row.meaning, row.source, row.when, row.beside)
        for row in free
        if row.beside is None or row.beside in keys
    )


def draw(rows: Sequence[Row], base: Scenario, seed: int) -> dict[str, Any]:
    """The values of one trial, by key.

    Each key draws from a stream of its own, told by seed and name alone: a trial is the same whatever else is varied,
    whoever runs it and when, and in the hard variation it is the standard one's further out.

    Args:
        rows: Of the variation.
        base: The scenario that is varied.
        seed: Of the trial.
    """
    found: dict[str, Any] = {}
    for row in rows:
        if row.when is not None and found.get(row.when[0], value_of(base, row.when[0])) != row.when[1]:
            continue
        stream = np.random.SeedSequence(seed, spawn_key=(VARIED, crc32(row.key.encode())))
        found[row.key] = row.drawn.draw(np.random.default_rng(stream))
    return found


def value_of(scenario: Scenario, key: str) -> Any:
    """The value of a dotted key."""
    value: Any = scenario
    for part in key.split("."):
        value = getattr(value, part)
    return value


def override(key: str, value: Any) -> str:
    """A value as `--set` takes it."""
    return f"{key}={value}" if isinstance(value, str) else f"{key}={value!r}"


def _robot_rows() -> tuple[Row, ...]:
    once = "drawn in the run"
    return (
        Row("sense.calibration_error", Errors((0.0015, 0.0015, 0.002)), f"sigma along x, y, z; {once}",
            "assumed: hand-eye calibration at 0.7 m"),
        Row("sense.joint_offset", Error(math.radians(0.57), math.radians(0.57)), f"sigma of each hand joint; {once}",
            "assumed: joints calibrated to 0.01 rad"),
        Row("sense.radius_error", Error(0.0005, 0.0005), f"sigma of the believed handle radius; {once}",
            "assumed: a handle measured with calipers"),
        Row("force.noise", Error(0.25, 0.25), "largest error of a fingertip force's size; drawn in the run",
            "Tang, Jia, Xue, ICRA 2024, footnote 7: within 25 %"),
        Row("force.direction_noise", Error(math.radians(30.0), math.radians(30.0)),
            "largest error of its direction; drawn in the run",
            "Tang, Jia, Xue, ICRA 2024, footnote 7: within 30 deg"),
        Row("model.mass_error", Around(-0.1, 0.1, -0.5, 0.5), "masses of arm and hand as the model has them",
            "assumed: what identifying an arm leaves"),
    )  # fmt: skip


def _tool_rows(base: Scenario) -> tuple[Row, ...]:
    mass = base.tool.mass
    return (
        Row("start.tool_tilt", Error(math.radians(1.5), math.radians(1.5)), "tilt at the start, in any direction",
            "assumed: a screwdriver put in by hand"),
        Row("tool.mass", Around(0.7 * mass, 1.3 * mass, 0.4 * mass, 1.6 * mass), "true mass of the tool",
            "assumed: screwdrivers of one size: +-30 %"),
        Row("model.tool_mass", Told(mass), "mass of the tool that the robot is told", "the scenario's",
            beside="tool.mass"),
        Row("contact.finger_friction", Around(0.6, 1.1, 0.3, 1.5), "true friction of the fingertips",
            "assumed: soft skin on plastic, from greasy to clean"),
        Row("model.finger_friction", Told(0.85), "friction that the robot is told", "the middle of what is drawn",
            beside="contact.finger_friction"),
    )  # fmt: skip


def _screw_rows() -> tuple[Row, ...]:
    law = "screw.thread.law"
    return (
        Row("contact.tip_friction", Around(0.3, 0.7, 0.05, 1.0), "friction of the tip in its slot",
            "assumed: steel on steel, dry or rough"),
        Row(law, OneOf(("elastic", "self-locking")), "what resists the screw",
            "Tang, Jia, Xue, ICRA 2024, section V-A; real threads"),
        Row("screw.thread.stiffness", Around(0.003, 0.02, 0.0, 2.0), "k_s", "what two fingers hold over five rounds",
            when=(law, "elastic")),
        Row("screw.thread.prevailing_torque", Around(0.01, 0.06, 0.0, 1.0), "torque of the run-down",
            "assumed: M4 in a tapped hole, oiled to dry", when=(law, "self-locking")),
        Row("screw.slot_yaw", Around(-math.pi, math.pi, -math.pi, math.pi), "yaw of the slot at the start",
            "any screw"),
    )  # fmt: skip


def _sight_rows() -> tuple[Row, ...]:
    synthetic = ("vision.source", "noisy-truth")
    return (
        Row("vision.position_noise", Error(0.003, 0.005), "sigma along each axis", "assumed: markers seen from 0.7 m",
            when=synthetic),
        Row("vision.rotation_noise", Error(math.radians(2.0), math.radians(3.0)), "sigma about each axis",
            "assumed: markers seen from 0.7 m", when=synthetic),
        Row("vision.latency", Error(0.02, 0.06), "from exposure to arrival", "assumed: one or two frames at 30 Hz"),
        Row("vision.dropout", Error(0.05, 0.05), "share of frames that are lost", "assumed: one frame in twenty"),
    )  # fmt: skip
