"""Writing a scenario: every key with its value, and beside it unit, range, meaning and source."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from typing import Any

from pydantic.fields import FieldInfo

from turnscrew.task.scenario import fields, limits
from turnscrew.task.scenario_keys import Scenario

_HEAD = """\
# A turnscrew scenario.  Everything is SI: m, rad, kg, N, N.m, s, Hz.
# Above each key: what it means, its unit, its range or choices, where its default comes from.
"""


def to_toml(scenario: Scenario) -> str:
    """The scenario as commented TOML; reading it again gives an equal scenario."""
    lines = [_HEAD]
    table = ""
    for name, field in fields():
        here, _, last = name.rpartition(".")
        if here != table:
            lines.append(f"[{here}]\n")
            table = here
        value: Any = scenario
        for part in name.split("."):
            value = getattr(value, part)
        lines.append("".join(f"# {line}\n" for line in _comment(field)) + _assignment(last, value, field))
    return "\n".join(lines)


def to_markdown() -> str:
    """The reference of all keys as a Markdown table."""
    rows = ["| key | default | unit | range | meaning | source of the default |", "|---|---|---|---|---|---|"]
    for name, field in fields():
        extra: Any = field.json_schema_extra
        default = "not set" if field.default is None else f"`{_toml(field.default)}`"
        cells = [f"`{name}`", default, extra["unit"], _range(field), field.description or "", extra["source"]]
        rows.append("| " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def _comment(field: FieldInfo) -> Iterator[str]:
    extra: Any = field.json_schema_extra
    unit = "" if extra["unit"] == "-" else f"  Unit: {extra['unit']}."
    text = f"{field.description}{unit}  {_range(field)}.  Source: {extra['source']}."
    yield from textwrap.wrap(text, 108)


def _range(field: FieldInfo) -> str:
    kind = str(field.annotation)
    if field.annotation is bool:
        return "true or false"
    if "Literal" in kind:
        return " or ".join(kind[kind.index("[") + 1 : kind.rindex("]")].replace("'", '"').split(", "))
    bounds = limits(field)
    if not bounds:
        return "three of 0 to 0.02"
    low = f"{bounds['ge']:g}" if "ge" in bounds else f"above {bounds['gt']:g}"
    return f"{low} to {bounds['le']:g}"


def _assignment(name: str, value: Any, field: FieldInfo) -> str:
    if value is None:
        return f"# {name} =\n"
    extra: Any = field.json_schema_extra
    degrees = f"  # {math.degrees(value):.4g} deg" if extra["unit"] == "rad" and value else ""
    return f"{name} = {_toml(value)}{degrees}\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return "[" + ", ".join(repr(entry) for entry in value) + "]"
    return repr(value)
