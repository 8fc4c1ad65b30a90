"""Scenarios: what is right is read back unchanged, what is wrong is told in one line."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from turnscrew.errors import ScenarioError
from turnscrew.task.scenario import fields, limits, load
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.scenario_text import to_markdown, to_toml

ROOT = Path(__file__).parents[2]


def told(*overrides: str) -> str:
    with pytest.raises(ScenarioError) as caught:
        load(None, overrides)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_defaults_are_those_of_the_paper_and_the_noise_model() -> None:
    scenario = load()
    assert scenario.tool.handle.radius == 0.018
    assert scenario.goal.rounds == 5
    assert scenario.force.noise == 0.25
    assert math.degrees(scenario.sense.joint_offset) == pytest.approx(0.57)
    assert scenario.steps_per_tick == 10


def test_scenario_cannot_be_changed() -> None:
    with pytest.raises(ValidationError):
        load().tool.mass = 1.0  # type: ignore[misc]


def test_overrides_win_over_the_file_and_the_seed_over_both(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("seed = 1\n[tool]\nmass = 0.05\n[tool.handle]\nradius = 0.012\n")
    scenario = load(file, ["tool.handle.radius = 0.015", "seed=2"], seed=3)
    assert (scenario.tool.mass, scenario.tool.handle.radius, scenario.seed) == (0.05, 0.015, 3)


@given(
    mass=st.floats(0.01, 1.0),
    sigma=st.lists(st.floats(0, 0.02), min_size=3, max_size=3),
    yaw=st.floats(-3.14, 3.14),
    seed=st.integers(0, 2**32 - 1),
    law=st.sampled_from(["elastic", "self-locking"]),
)
def test_written_scenario_reads_back_to_the_last_bit(mass, sigma, yaw, seed, law) -> None:  # type: ignore[no-untyped-def]
    wishes = [f"tool.mass={mass!r}", f"sense.calibration_error={sigma!r}", f"screw.slot_yaw={yaw!r}"]
    scenario = load(None, [*wishes, f"screw.thread.law={law}"], seed)
    assert Scenario.model_validate(tomllib.loads(to_toml(scenario))) == scenario


def test_written_goal_without_rounds_stays_without_rounds() -> None:
    scenario = load(None, ["goal.angle=6.28"])
    assert scenario.goal.rounds is None
    assert Scenario.model_validate(tomllib.loads(to_toml(scenario))) == scenario


@pytest.mark.parametrize("name", [name for name, _ in fields()])
def test_every_key_is_documented(name: str) -> None:
    field = dict(fields())[name]
    extra = field.json_schema_extra
    assert field.description
    assert isinstance(extra, dict)
    assert extra["unit"]
    assert extra["source"]
    kind = str(field.annotation)
    if "Literal" not in kind and "tuple" not in kind and field.annotation not in (str, bool):
        assert len(limits(field)) == 2, "a number has a lower and an upper bound"


@pytest.mark.parametrize("name", [name for name, field in fields() if len(limits(field)) == 2])
def test_value_beyond_its_range_is_refused_with_the_range(name: str) -> None:
    bounds = limits(dict(fields())[name])
    top = max(bounds.values())
    text = repr(int(top) + 1) if float(top).is_integer() else repr(top * 1.5)
    message = told(f"{name}={text}")
    assert message.startswith(f"{name} = ")
    assert f"{top:g}" in message


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("tool.handle.radios=0.01", "tool.handle.radios: unknown key; the nearest is tool.handle.radius"),
        ("radius=0.01", "radius: unknown key; the nearest is tool.handle.radius"),
        ("scew.pitch=0.001", "scew: unknown key; the nearest is screw"),
        ("tool.handle.radius=0.5", "tool.handle.radius = 0.5: must be a number, at least 0.005 m and at most 0.05 m"),
        ("tool.handle.radius=fat", "tool.handle.radius = 'fat': must be a number"),
        ("tool.mass=nan", "tool.mass = nan: must be a number"),
        ("tool=3", "tool = 3: is a table of keys such as tool.mass"),
        ("seed=true", "seed = True: must be a whole number"),
        ("goal.rounds=0", "goal.rounds = 0: must be a whole number, at least 1"),
        ("screw.thread.law=rusty", "screw.thread.law = 'rusty': must be one of 'elastic', 'self-locking'"),
        ("sense.calibration_error=[0.001]", "sense.calibration_error"),
        ("control.recentre=maybe", "control.recentre = 'maybe': must be true or false"),
        ("robot.actuation=hydraulic", "robot.actuation = 'hydraulic': must be one of 'position', 'torque'"),
        ("tool.mass", "'tool.mass': an override is key=value"),
        ("=3", "'=3': an override is key=value"),
        ("tool.blade_thickness=0.002", "tool.blade_thickness = 0.002: must be below screw.slot_width"),
        ("rate.control=300", "rate.control = 300: must divide rate.plant"),
        ("tool.handle.length=0.25", "tool.handle.length = 0.25: must be below twice tool.contact_height"),
    ],
)
def test_wrong_override_is_told_in_one_line(override: str, expected: str) -> None:
    assert told(override).startswith(expected)


def test_fixed_squeeze_needs_forces_that_have_one() -> None:
    wishes = ["control.squeeze=6.0", "robot.actuation=torque"]
    assert load(None, [*wishes, "control.forces=null-space"]).control.squeeze == 6.0
    assert load(None, wishes[:1]).control.squeeze == 6.0
    with pytest.raises(ScenarioError, match=r"needs control\.forces = 'null-space'"):
        load(None, wishes)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"seed = ", "not valid TOML"),
        (b"\xff\xfe", "cannot be read as text"),
        (b"seed = 1\nseed = 2", "not valid TOML"),
        (b"[tool]\ncolour = 'red'", "tool.colour: unknown key"),
    ],
)
def test_unreadable_file_is_told_in_one_line(tmp_path: Path, content: bytes, expected: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    with pytest.raises(ScenarioError, match=expected) as caught:
        load(file)
    assert "\n" not in str(caught.value)


def test_missing_file_is_told_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="there is no such file; `turnscrew scenario >"):
        load(tmp_path / "none.toml")
    with pytest.raises(ScenarioError, match="cannot be read"):
        load(tmp_path)


def test_reference_in_the_docs_is_the_code() -> None:
    page = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    assert page.endswith(to_markdown()), "run: turnscrew scenario --markdown, and put it at the end of docs/scenario.md"


def test_reading_a_scenario_loads_no_numerics() -> None:
    code = "import sys, turnscrew.task.scenario_text; print({'numpy', 'mujoco', 'casadi'} & sys.modules.keys())"
    shown = subprocess.run(
        [sys.executable, "-c", code], env={"PYTHONPATH": str(ROOT / "src")}, capture_output=True, text=True, check=True
    )
    assert shown.stdout.strip() == "set()"


def test_summary_has_exactly_the_documented_keys() -> None:
    from turnscrew.task.summary import Progress, Summary

    page = (ROOT / "docs" / "record.md").read_text(encoding="utf-8")
    for name in Summary.model_fields:
        assert f"| `{name}` |" in page
    assert [field.name for field in dataclasses.fields(Progress)] == [
        "time", "phase", "round", "screw_angle", "torque", "tip_force", "tilt", "real_time_factor",
    ]  # fmt: skip
