"""Derivatives of maps between manifolds by central differences, and states of blocks as vectors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array

S = TypeVar("S")


def jacobian(f: Callable[[Array], Array], steps: Array) -> Array:
    """Derivative of f at 0 by central differences: column i is `(f(h_i e_i) - f(-h_i e_i)) / 2 h_i`.

    For a map F between manifolds f is `F(x0 (+) dx) (-) F(x0)`, in tangent coordinates at x0 and at F(x0).

    Args:
        f: Takes (n,), gives (m,).
        steps: (n,) h, > 0.

    Returns:
        (m, n).
    """
    columns = []
    for i, step in enumerate(steps.tolist()):
        dx = np.zeros(len(steps))
        dx[i] = step
        columns.append((f(dx) - f(-dx)) / (2.0 * step))
    return np.array(columns).T


def smoothed_jacobian(f: Callable[[Array], Array], steps: Array, points: int, rng: Generator) -> Array:
    """The same for a map with kinks: of each element's differences about some points near 0, the median.

    A blade's corners come to and off their walls, and contacts stick and slide, within a micrometre.  Whether a
    difference straddles such a kink depends on all coordinates: about some points near 0 it does, rarely about most.

    Args:
        f: Takes (n,), gives (m,).
        steps: (n,) h, > 0; the points scatter by as much.
        points: How many, odd.
        rng: Draws them.

    Returns:
        (m, n).
    """
    found = []
    for _ in range(points):
        near = steps * rng.normal(size=len(steps))
        found.append(jacobian(lambda dx, near=near: f(near + dx), steps))  # type: ignore[misc]
    return np.asarray(np.median(np.array(found), axis=0))


def pack(state: Any) -> Array:
    """All floating numbers of a state of nested dataclasses, in the order of its fields.

    Whole numbers, flags and words are no coordinates: they stay what they are when a state is moved.
    """
    parts = [np.atleast_1d(np.asarray(leaf, dtype=np.float64)).ravel() for leaf in _leaves(state)]
    return np.concatenate(parts) if parts else np.zeros(0)


def unpack(like: S, values: Array) -> S:
    """A state like another, its floating numbers replaced by those of a vector that `pack` made."""
    return cast(S, _filled(like, iter(values.tolist())))


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype == np.float64


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, float) or _is_array(value):
        yield value
    elif is_dataclass(value):
        for field in fields(value):
            yield from _leaves(getattr(value, field.name))
    elif isinstance(value, tuple):
        for item in value:
            yield from _leaves(item)


def _filled(value: Any, rest: Iterator[float]) -> Any:
    if isinstance(value, float):
        return next(rest)
    if _is_array(value):
        return np.array([next(rest) for _ in range(value.size)]).reshape(value.shape)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{field.name: _filled(getattr(value, field.name), rest) for field in fields(value)})
    if isinstance(value, tuple):
        return tuple(_filled(item, rest) for item in value)
    return value
