"""Messages and states are values: none is ever altered, a changed one is a new one."""

from __future__ import annotations

from dataclasses import fields
from functools import cache
from operator import attrgetter
from typing import Any, TypeVar

Value = TypeVar("Value")


def changed(value: Value, **changes: object) -> Value:
    """The same value but for some of its fields: `dataclasses.replace` in a third of its time.

    Args:
        value: Of a dataclass with two fields or more, which its constructor takes by place.
        changes: New values of fields by their names.

    Raises:
        KeyError: there is no such field.
    """
    kind: Any = type(value)
    read, places = _layout(kind)
    content = list(read(value))
    for name, new in changes.items():
        content[places[name]] = new
    result: Value = kind(*content)
    return result


@cache
def _layout(kind: type[Any]) -> tuple[attrgetter[tuple[Any, ...]], dict[str, int]]:
    """What reads all arguments of a dataclass at once, and the place of each among them."""
    names = [field.name for field in fields(kind) if field.init]
    return attrgetter(*names), {name: place for place, name in enumerate(names)}
