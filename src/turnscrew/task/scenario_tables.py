"""What tables of a scenario are made of: keys that carry their unit, range, meaning and source."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

PAPER = "Tang, Jia, Xue, ICRA 2024"


def key(default: Any, unit: str, meaning: str, source: str, **rules: Any) -> Any:
    """A documented scenario key.

    Args:
        default: Its value when a scenario does not name it.
        unit: Its SI unit, or "-" for a pure number or a word.
        meaning: One sentence.
        source: Where the default comes from.
        **rules: `ge`, `le`, `gt`, `lt` as pydantic takes them.
    """
    return Field(default, description=meaning, json_schema_extra={"unit": unit, "source": source}, **rules)


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Sigma: TypeAlias = Annotated[float, Field(ge=0.0, le=0.02)]
Triple: TypeAlias = Annotated[tuple[Sigma, Sigma, Sigma], BeforeValidator(_tuple)]


class Table(BaseModel):
    """A table of keys: frozen, strict about types, and closed to unknown names."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
