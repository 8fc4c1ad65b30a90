"""A changed value is what `dataclasses.replace` gives."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest
from rigs.grips import PINCHED

from turnscrew.values import changed


@dataclass(frozen=True, slots=True)
class Sized:
    """A value with something worked out of the rest."""

    width: float
    height: float = 2.0
    area: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "area", self.width * self.height)


def test_fields_change_and_what_follows_from_them_does_too():
    assert changed(Sized(3.0), height=4.0) == replace(Sized(3.0), height=4.0)
    assert changed(Sized(3.0), height=4.0).area == 12.0


def test_what_does_not_change_is_the_very_same():
    moved = changed(PINCHED, theta=1.0)
    assert moved.theta == 1.0
    assert moved.q is PINCHED.q
    assert PINCHED.theta != 1.0


def test_a_field_that_is_not_there_is_an_error():
    with pytest.raises(KeyError):
        changed(PINCHED, colour="red")
