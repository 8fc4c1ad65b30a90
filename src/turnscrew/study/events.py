"""What happened in a study's runs, one row an event."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.task.signal_table import write_parquet


def write_events(kind: type[Any], events: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Writes events as Parquet.

    Args:
        kind: Dataclass of an event: its fields are the columns.
        events: As a part's file has them.
        path: Where to.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_parquet(path, columns_of(kind, events))
    return path


def columns_of(kind: type[Any], events: Sequence[Mapping[str, Any]]) -> dict[str, np.ndarray]:
    """Events as columns by name: text, flags and numbers, a missing one not-a-number.

    Args:
        kind: Dataclass of an event.
        events: As a part's file has them.
    """
    columns: dict[str, np.ndarray] = {}
    for field in fields(kind):
        values = [event[field.name] for event in events]
        dtype = {"str": np.str_, "bool": np.bool_, "int": np.int64}.get(str(field.type), np.float64)
        columns[field.name] = np.array(values, dtype=dtype)
    return columns
