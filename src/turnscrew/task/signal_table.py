"""Signals of the loop as a table: one row a tick, one column a number or word, columns named by path."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.errors import RecordError
from turnscrew.plant.log import segments
from turnscrew.robot.joints import FINGERS, JOINTS

SIGNALS = "signals.parquet"

_AXES = ("x", "y", "z")
_WRENCH = ("f_x", "f_y", "f_z", "tau_x", "tau_y", "tau_z")
_TWIST = ("v_x", "v_y", "v_z", "w_x", "w_y", "w_z")
_MATRIX = tuple(row + column for row in _AXES for column in _AXES)


class SignalTable:
    """Gathers ticks until they are taken away; a value that is missing at a tick is not-a-number there."""

    def __init__(self, capacity: int) -> None:
        self.rows = 0
        self._capacity = capacity
        self._values = np.full((capacity, 512), np.nan)
        self._slots: dict[str, slice] = {}
        self._names: list[str] = []
        self._words: dict[str, list[str]] = {}

    def append(self, signals: Mapping[str, object]) -> None:
        """Adds a row.

        Raises:
            RecordError: A signal changed its size since an earlier tick, or there are more ticks than rows.
        """
        if self.rows == self._capacity:
            raise RecordError("more ticks than plant steps: log each step as well as each tick")
        row = self._values[self.rows]
        leaves: list[tuple[str, Any]] = []
        _gather("", signals, leaves)
        for path, value in leaves:
            if isinstance(value, str):
                self._word(path, value)
                continue
            slot = self._slots.get(path)
            if slot is None:
                slot = self._widen(path, value)
                row = self._values[self.rows]
            if isinstance(value, np.ndarray):
                if value.size != slot.stop - slot.start:
                    raise RecordError(f"{path}: changed its size from {slot.stop - slot.start} to {value.size}")
                row[slot] = value if value.ndim == 1 else value.ravel()
            else:
                row[slot.start] = value
        self.rows += 1

    def take(self) -> dict[str, np.ndarray]:
        """All rows as arrays that `numpy.savez` takes, and an empty table after that."""
        taken: dict[str, np.ndarray] = {
            "signals.names": np.array(self._names, dtype=np.str_),
            "signals.values": self._values[: self.rows, : len(self._names)].copy(),
            "signals.rows": np.array(self.rows),
        }
        for path, words in self._words.items():
            taken[f"words.{path}"] = np.array(words + [""] * (self.rows - len(words)), dtype=np.str_)
            words.clear()
        self._values[: self.rows] = np.nan
        self.rows = 0
        return taken

    def _word(self, path: str, value: str) -> None:
        words = self._words.setdefault(path, [])
        words.extend([""] * (self.rows - len(words)))
        words.append(value)

    def _widen(self, path: str, value: Any) -> slice:
        names = _labels(path, np.shape(value))
        start = len(self._names)
        self._names.extend(names)
        missing = len(self._names) - self._values.shape[1]
        if missing > 0:
            more = np.full((self._capacity, max(missing, self._values.shape[1])), np.nan)
            self._values = np.hstack([self._values, more])
        self._slots[path] = slice(start, len(self._names))
        return self._slots[path]


def read_signals(folder: Path) -> dict[str, np.ndarray]:
    """Every column of a run's signals: from `signals.parquet` or, where the run was killed, from its segments.

    Raises:
        RecordError: `signals.parquet` cannot be read.
    """
    whole = folder / SIGNALS
    if whole.is_file():
        return _read_parquet(whole)
    columns: dict[str, list[np.ndarray]] = {}
    rows = 0
    for piece in segments(folder):
        with np.load(piece) as arrays:
            count = int(arrays["signals.rows"])
            new = dict(zip(arrays["signals.names"].tolist(), arrays["signals.values"].T, strict=True))
            new |= {name[len("words.") :]: arrays[name] for name in arrays.files if name.startswith("words.")}
        for name, column in new.items():
            columns.setdefault(name, [_missing(column, rows)]).append(column)
        rows += count
        for name in columns.keys() - new.keys():
            columns[name].append(_missing(columns[name][-1], count))
    return {name: np.concatenate(pieces) for name, pieces in columns.items()}


def column(columns: Mapping[str, np.ndarray], path: str, *shape: int) -> np.ndarray:
    """A signal over all ticks, put together from its columns.

    Args:
        columns: As `read_signals` gives them.
        path: Of the signal, such as `estimate.R_WT`.
        *shape: Of its value at one tick.

    Returns:
        (n, *shape) values.

    Raises:
        RecordError: The record does not hold the signal.
    """
    try:
        parts = [columns[name] for name in _labels(path, shape)]
    except KeyError as error:
        raise RecordError(f"the record has no signal {error.args[0]}; was it made by another version?") from None
    return np.stack(parts, axis=-1).reshape(-1, *shape)


def write_parquet(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Writes columns of numbers and words as Parquet."""
    # a fifth of a second to import, wanted at the end of a run only
    import duckdb

    table = {name: column.astype(object) if column.dtype.kind == "U" else column for name, column in columns.items()}
    with duckdb.connect() as connection:
        connection.register("signals", table)
        connection.execute(f"COPY (SELECT * FROM signals) TO '{_quoted(path)}' (FORMAT parquet, COMPRESSION zstd)")


def _read_parquet(path: Path) -> dict[str, np.ndarray]:
    import duckdb

    try:
        with duckdb.connect() as connection:
            columns = connection.execute(f"SELECT * FROM '{_quoted(path)}'").fetchnumpy()
    except duckdb.Error as error:
        raise RecordError(f"{path}: cannot be read: {' '.join(str(error).split())}") from None
    return {name: _filled(column) for name, column in columns.items()}


def _filled(column: np.ndarray) -> np.ndarray:
    """A column as it was written: Parquet keeps not-a-number as a missing value."""
    return np.ma.filled(column, "" if column.dtype.kind == "O" else np.nan)


def _quoted(path: Path) -> str:
    return str(path).replace("'", "''")


def _missing(like: np.ndarray, rows: int) -> np.ndarray:
    return np.full(rows, "", dtype=like.dtype) if like.dtype.kind == "U" else np.full(rows, np.nan)


def _gather(path: str, value: object, leaves: list[tuple[str, Any]]) -> None:
    """Appends numbers, arrays and words of a nested value, each with its path."""
    kind = type(value)
    if kind is np.ndarray or kind is float:
        leaves.append((path, value))
    elif isinstance(value, str):
        leaves.append((path, str(value.value) if isinstance(value, Enum) else value))
    elif isinstance(value, Mapping):
        for inner, entry in zip(_paths(path, tuple(value)), value.values(), strict=True):
            _gather(inner, entry, leaves)
    elif dataclasses.is_dataclass(kind):
        names = _field_names(kind)
        for inner, name in zip(_paths(path, names), names, strict=True):
            _gather(inner, getattr(value, name), leaves)
    elif isinstance(value, np.generic | float | int):
        leaves.append((path, value))
    elif isinstance(value, Sequence):
        leaves.append(_sequence(path, value))
    elif value is not None:
        raise RecordError(f"{path}: a {kind.__name__} cannot be recorded")


@cache
def _paths(path: str, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{path}.{name}" if path else str(name) for name in names)


def _sequence(path: str, value: Sequence[object]) -> tuple[str, Any]:
    """Numbers in a row are an array; anything else is told in words."""
    if value and all(isinstance(entry, float | int) for entry in value):
        return path, np.array(value, dtype=float)
    return path, "; ".join(str(entry) for entry in value)


@cache
def _field_names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind))


def _labels(path: str, shape: tuple[int, ...]) -> list[str]:
    """Names of a signal's columns; a one-letter signal keeps its letter (`tool.p` gives `tool.p_x`)."""
    if not shape:
        return [path]
    joint = "_" if len(path.rpartition(".")[2]) == 1 and shape in ((3,), (4,)) else "."
    return [f"{path}{joint}{label}" for label in _components(path.rpartition(".")[2], shape)]


def _components(name: str, shape: tuple[int, ...]) -> Sequence[str]:
    known: dict[tuple[int, ...], Sequence[str]] = {
        (3,): _AXES,
        (len(FINGERS),): FINGERS,
        (len(JOINTS),): JOINTS,
        (len(FINGERS), 3): [f"{finger}.{axis}" for finger in FINGERS for axis in _AXES],
        (3, 3): _MATRIX,
    }
    if shape == (6,):
        return _WRENCH if name.startswith("F") else _TWIST if name.startswith(("nu", "V")) else _indices(shape)
    if shape == (4,) and name.startswith("q"):
        return ("w", *_AXES)
    return known.get(shape) or _indices(shape)


def _indices(shape: tuple[int, ...]) -> list[str]:
    return [".".join(map(str, index)) for index in np.ndindex(*shape)]
