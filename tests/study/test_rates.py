"""Intervals of counted shares and rates."""

from __future__ import annotations

import pytest

from turnscrew.study.rates import poisson, poisson_upper, wilson


def test_wilson_against_published_values() -> None:
    # Newcombe (1998), table I: 81 of 263, and 0 of 20; four digits are given
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)


def test_share_lies_in_its_interval() -> None:
    for successes in range(11):
        low, high = wilson(successes, 10)
        # the ends of 0 and 10 of 10 are the share itself, to rounding
        assert 0.0 <= low <= successes / 10 + 1e-12
        assert successes / 10 - 1e-12 <= high <= 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_poisson_bound_of_none_and_of_one() -> None:
    # -log(.05), and the solution of exp(-m) (1 + m) = .05; three digits
    assert poisson_upper(0) == pytest.approx(2.996, abs=5e-4)
    assert poisson_upper(1) == pytest.approx(4.744, abs=5e-4)


def test_poisson_interval_against_published_values() -> None:
    # Garwood (1936): of none, one and ten
    assert poisson(0) == pytest.approx((0.0, 3.689), abs=5e-4)
    assert poisson(1) == pytest.approx((0.0253, 5.572), abs=5e-4)
    assert poisson(10) == pytest.approx((4.795, 18.39), abs=5e-3)
