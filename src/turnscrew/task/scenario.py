"""Reading a scenario: TOML plus overrides, validated, with one clear line for whatever is wrong."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from turnscrew.errors import ScenarioError
from turnscrew.task.scenario_keys import Goal, Scenario

__all__ = ["Scenario", "fields", "limits", "load"]


def load(path: Path | None = None, overrides: Sequence[str] = (), seed: int | None = None) -> Scenario:
    """The scenario of a file, with overrides on top, checked.

    Args:
        path: A TOML file, or None for the defaults.
        overrides: `key=value` each, the key dotted (`tool.handle.radius=0.015`), the value as TOML
            writes it; a bare word is taken as text.
        seed: Replaces the scenario's seed when given.

    Raises:
        ScenarioError: The file is missing or unreadable, or a key or value is wrong.
    """
    given = {} if path is None else _read(path)
    for override in overrides:
        _apply(given, override)
    if seed is not None:
        given["seed"] = seed
    try:
        scenario = Scenario.model_validate(given)
    except ValidationError as error:
        details = error.errors(include_url=False)
        more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
        raise ScenarioError(_line(details[0]) + more) from None
    _check_together(scenario)
    return scenario


def fields(model: type[BaseModel] = Scenario, prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Every key of the scenario, dotted, with its definition, in the order of the file."""
    tables = []
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            tables.append((kind, f"{prefix}{name}."))
        else:
            yield f"{prefix}{name}", field
    for kind, path in tables:
        yield from fields(kind, path)


def limits(field: FieldInfo) -> dict[str, float]:
    """The bounds (ge, gt, le, lt) that a key has."""
    return {
        name: getattr(rule, name) for rule in field.metadata for name in ("ge", "gt", "le", "lt") if hasattr(rule, name)
    }


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ScenarioError(f"{path}: there is no such file; `turnscrew scenario > {path}` writes one") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: cannot be read as text: {_one_line(error)}") from None
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path}: not valid TOML: {_one_line(error)}") from None


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _apply(given: dict[str, Any], override: str) -> None:
    name, equals, text = override.partition("=")
    parts = name.strip().split(".")
    if not equals or not all(parts):
        raise ScenarioError(f"{override!r}: an override is key=value, as in tool.handle.radius=0.015")
    table = given
    for part in parts[:-1]:
        inner = table.setdefault(part, {})
        if not isinstance(inner, dict):
            raise ScenarioError(f"{name.strip()}: {part} is not a table{_nearest(name.strip())}")
        table = inner
    table[parts[-1]] = _value(text.strip())


def _value(text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    return parsed["value"] if parsed.keys() == {"value"} else text


def _line(detail: ErrorDetails) -> str:
    """One line of pydantic's verdict: the key, what is wrong with it, and what would be right."""
    path = ".".join(str(part) for part in detail["loc"] if not isinstance(part, int))
    known = dict(fields())
    if path not in known:
        tables = [name for name in known if name.startswith(f"{path}.")]
        if tables:
            return f"{path} = {detail['input']!r}: is a table of keys such as {tables[0]}"
        return f"{path}: unknown key{_nearest(path)}"
    return f"{path} = {_shown(detail['input'])}: {_wish(known[path])}"


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else repr(value)


def _nearest(path: str) -> str:
    """The known key or table most like a wrong one, compared from the end: people leave tables out."""
    names = [name for name, _ in fields()]
    names += sorted({name.rpartition(".")[0] for name in names if "." in name})
    count = path.count(".") + 1

    def likeness(name: str) -> tuple[float, float]:
        tail = ".".join(name.split(".")[-count:])
        return (
            difflib.SequenceMatcher(None, path, tail).ratio(),
            difflib.SequenceMatcher(None, path, name).ratio(),
        )

    return f"; the nearest is {max(names, key=likeness)}"


def _wish(field: FieldInfo) -> str:
    """What a right value of a key looks like."""
    kind = str(field.annotation)
    unit = _extra(field)["unit"]
    suffix = "" if unit == "-" else f" {unit}"
    if "Literal" in kind:
        return f"must be one of {kind[kind.index('[') + 1 : kind.rindex(']')]}"
    if field.annotation is bool:
        return "must be true or false"
    if "tuple" in kind:
        return f"must be three numbers from 0 to 0.02 in a list, in{suffix}"
    noun = "a whole number" if "int" in kind else "a number"
    bounds = limits(field)
    words = {"ge": "at least", "gt": "above", "le": "at most", "lt": "below"}
    allowed = " and ".join(f"{words[name]} {value:g}{suffix}" for name, value in bounds.items())
    return f"must be {noun}, {allowed}" if allowed else f"must be {noun}{suffix}"


def _extra(field: FieldInfo) -> Mapping[str, Any]:
    extra = field.json_schema_extra
    return extra if isinstance(extra, dict) else {}


def _check_goal(goal: Goal) -> None:
    if goal.course == "stroke" and goal.rounds not in (None, 1):
        raise ScenarioError(f'goal.rounds = {goal.rounds}: must be 1 with goal.course = "stroke"')


def _check_together(scenario: Scenario) -> None:
    """What no single key can get wrong alone."""
    _check_goal(scenario.goal)
    tool, screw = scenario.tool, scenario.screw
    rules = [
        (
            tool.blade_thickness < screw.slot_width,
            f"tool.blade_thickness = {tool.blade_thickness:g}: must be below screw.slot_width ({screw.slot_width:g} m)",
        ),
        (
            tool.blade_width < screw.slot_length,
            f"tool.blade_width = {tool.blade_width:g}: must be below screw.slot_length ({screw.slot_length:g} m)",
        ),
        (
            screw.slot_length < 2 * screw.head_radius,
            f"screw.slot_length = {screw.slot_length:g}: must be below twice screw.head_radius "
            f"({2 * screw.head_radius:g} m)",
        ),
        (
            tool.shaft_radius < tool.handle.radius,
            f"tool.shaft_radius = {tool.shaft_radius:g}: must be below tool.handle.radius ({tool.handle.radius:g} m)",
        ),
        (
            tool.handle.length / 2 < tool.contact_height,
            f"tool.handle.length = {tool.handle.length:g}: must be below twice tool.contact_height "
            f"({2 * tool.contact_height:g} m), so that shaft is left below the handle",
        ),
    ]
    for holds, message in [*rules, *_loop_rules(scenario)]:
        if not holds:
            raise ScenarioError(message)


def _loop_rules(scenario: Scenario) -> list[tuple[bool, str]]:
    """Whether each holds, and what to say where it does not."""
    rate, control = scenario.rate, scenario.control
    return [
        (
            rate.plant % rate.control == 0,
            f"rate.control = {rate.control:g}: must divide rate.plant ({rate.plant:g} Hz)",
        ),
        (
            control.squeeze is None or control.forces == "null-space" or scenario.robot.actuation == "position",
            f"control.squeeze = {control.squeeze}: needs control.forces = 'null-space'; the optimum finds its own",
        ),
        (
            scenario.vision.rate <= rate.control,
            f"vision.rate = {scenario.vision.rate:g}: must be at most rate.control ({rate.control:g} Hz)",
        ),
    ]
