"""What a varied value is drawn from, and what twice as much variation means for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

from numpy.random import Generator

DIGITS = 6
"""Significant digits of a drawn number: so many stand in the command that makes the trial again."""


class Distribution(Protocol):
    """What a value is drawn from."""

    def draw(self, rng: Generator) -> Any:
        """A value."""
        ...

    def scaled(self, by: float) -> Distribution:
        """The same with so many times the variation."""
        ...


@dataclass(frozen=True)
class Around:
    """Evenly from a range around a middle; scaled, the range widens about its middle, as far as values make sense.

    Attributes:
        low: Least value.
        high: Largest value.
        least: No range begins below.
        most: No range ends above.
    """

    low: float
    high: float
    least: float
    most: float

    def draw(self, rng: Generator) -> float:
        """A value."""
        return _short(rng.uniform(self.low, self.high))

    def scaled(self, by: float) -> Around:
        """The wider range, cut at what makes sense."""
        middle, half = (self.low + self.high) / 2, by * (self.high - self.low) / 2
        return replace(self, low=max(middle - half, self.least), high=min(middle + half, self.most))

    def __str__(self) -> str:
        return f"even, {self.low:.4g} to {self.high:.4g}"


@dataclass(frozen=True)
class Error:
    """Size of an error, evenly from a range; scaled, all of it grows.

    Attributes:
        low: Least size.
        high: Largest size.
    """

    low: float
    high: float

    def draw(self, rng: Generator) -> float:
        """A value."""
        return _short(rng.uniform(self.low, self.high))

    def scaled(self, by: float) -> Error:
        """Errors so many times as large."""
        return Error(by * self.low, by * self.high)

    def __str__(self) -> str:
        return f"{self.high:.4g}" if self.low == self.high else f"even, {self.low:.4g} to {self.high:.4g}"


@dataclass(frozen=True)
class Errors:
    """Sizes of an error along axes, the same in each trial; scaled, all of them grow.

    Attributes:
        sizes: One for each axis.
    """

    sizes: tuple[float, ...]

    def draw(self, rng: Generator) -> list[float]:
        """A value."""
        return [_short(size) for size in self.sizes]

    def scaled(self, by: float) -> Errors:
        """Errors so many times as large."""
        return Errors(tuple(by * size for size in self.sizes))

    def __str__(self) -> str:
        return ", ".join(f"{size:.4g}" for size in self.sizes)


@dataclass(frozen=True)
class OneOf:
    """One of some words, each as likely; cannot be scaled.

    Attributes:
        words: To choose from.
    """

    words: tuple[str, ...]

    def draw(self, rng: Generator) -> str:
        """A value."""
        return self.words[int(rng.integers(len(self.words)))]

    def scaled(self, by: float) -> OneOf:
        """The same."""
        return self

    def __str__(self) -> str:
        return " or ".join(self.words)


@dataclass(frozen=True)
class Told:
    """A value that the robot is told in each trial, whatever is true; cannot be scaled.

    Attributes:
        value: That it is told.
    """

    value: float

    def draw(self, rng: Generator) -> float:
        """A value."""
        return _short(self.value)

    def scaled(self, by: float) -> Told:
        """The same."""
        return self

    def __str__(self) -> str:
        return f"{self.value:.4g}"


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
