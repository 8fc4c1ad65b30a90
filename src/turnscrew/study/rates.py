"""How sure a share or a rate is that was counted."""

from __future__ import annotations

from math import sqrt

from scipy.stats import chi2

Z_95 = 1.959964
"""97.5 % quantile of the normal distribution."""


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share, after Wilson (1927): right for few trials and for shares near 0 and 1.

    Args:
        successes: Counted.
        trials: Of so many; of none nothing is known, and the interval is 0 to 1.
    """
    if trials == 0:
        return 0.0, 1.0
    share, spread = successes / trials, Z_95**2 / trials
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = sqrt(spread * (share * (1.0 - share) + 0.25 * spread)) / (1.0 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def poisson_upper(count: int) -> float:
    """95 % upper bound of how many events to expect where so many were counted; 3.0 where none was."""
    return float(0.5 * chi2.ppf(0.95, 2 * (count + 1)))


def poisson(count: int) -> tuple[float, float]:
    """95 % interval of how many events to expect where so many were counted, exact after Garwood (1936)."""
    low = 0.5 * chi2.ppf(0.025, 2 * count) if count else 0.0
    return float(low), float(0.5 * chi2.ppf(0.975, 2 * (count + 1)))
