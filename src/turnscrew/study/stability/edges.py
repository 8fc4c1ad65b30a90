"""At which delay, or gain, a held grasp begins to swing: as its poles predict it, and as the simulator does it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.study.stability.dry_friction import Swing
from turnscrew.study.stability.held_grasp import HeldGrasp
from turnscrew.study.stability.poles import Poles, SampledLoop

WATCHED = 1.6
"""How long a disturbance is watched [s]: five swings of 20 rad/s."""

IGNORED = 0.4
"""What is left out of its beginning [s]: what dies at once says nothing of what stays."""

WINDOW = 0.2
"""Of which the size is taken [s]."""

RATIO = 1.1
"""Step in gain between two trials."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where growth changes sign.

    Attributes:
        at: Interpolated between trials; not a number if there was no change of sign among them.
        trials: What was tried, and its rate of growth [1/s], in ascending order.
    """

    at: float
    trials: tuple[tuple[float, float], ...]


def search(growth: Callable[[float], float], start: float, up: Callable[[float, int], float], most: int) -> Crossing:
    """Steps from a first trial towards the edge until growth changes sign.

    Args:
        growth: Rate at a value, > 0 beyond the edge.
        start: First value.
        up: Next value from one, in direction +1 or -1; itself where there is none.
        most: Steps at most.
    """
    trials = {start: growth(start)}
    direction = -1 if trials[start] > 0.0 else 1
    last = start
    for _ in range(most):
        value = up(last, direction)
        if value == last:
            break
        trials[value] = growth(value)
        if (trials[value] > 0.0) != (trials[last] > 0.0):
            low, high = sorted((last, value))
            a, b = trials[low], trials[high]
            # a rate far beyond the edge says nothing of where it is crossed: the edge lies on this side of it then
            at = low + (high - low) * min(max(a / (a - b), 0.0), 1.0)
            return Crossing(float(at), tuple(sorted(trials.items())))
        last = value
    return Crossing(float("nan"), tuple(sorted(trials.items())))


def one_period(value: float, direction: int) -> float:
    """The next delay [periods]."""
    return max(value + direction, 0.0)


def one_ratio(value: float, direction: int) -> float:
    """The next gain."""
    return float(value * RATIO**direction)


@dataclass(frozen=True)
class Prediction:
    """A held grasp's linear loop, at any delay and gain, and what its joints' dry friction makes of it.

    Attributes:
        grasp: The grasp.
        linear: Its loop, without dry friction.
    """

    grasp: HeldGrasp
    linear: SampledLoop

    @classmethod
    def of(cls, grasp: HeldGrasp) -> Prediction:
        """Linearises the loop of a grasp."""
        loop, state = grasp.loop()
        return cls(grasp, loop.linearised(state, grasp.snapshot))

    def under(self, gain: float) -> SampledLoop:
        """The loop with the servo's gains multiplied."""
        if gain == 1.0:
            return self.linear
        loop, state = self.grasp.loop(gain)
        return replace(self.linear, controls=loop.controls(state, self.grasp.snapshot))

    def placed(self, faster: float) -> SampledLoop:
        """The loop with the servo's natural frequency multiplied, its damping ratio as it is."""
        loop, state = self.grasp.placed(faster)
        return replace(self.linear, controls=loop.controls(state, self.grasp.snapshot))

    def poles(self, delay: int, gain: float = 1.0) -> Poles:
        """Poles at a delay [periods] and a gain, without dry friction."""
        return self.under(gain).poles(delay)

    def swings(self, kick: Array, delay: int, gain: float = 1.0) -> list[Swing]:
        """Swings after a kick (24,) of the driven joints [rad/s], the fastest growing first."""
        return self.grasp.friction.swings(self.under(gain), delay, self.grasp.kicked(kick))

    def growth(self, kick: Array | None, delay: int, gain: float = 1.0) -> float:
        """Rate at which the fastest swing grows after a kick; after none, without dry friction, swings of any size."""
        if kick is None:
            return self.poles(delay, gain).growth
        return self.grasp.friction.growth(self.under(gain), delay, self.grasp.kicked(kick))

    def delay_edge(self, kick: Array | None, start: float = 8.0) -> Crossing:
        """The delay beyond which a swing grows after a kick [periods]."""
        return search(lambda n: self.growth(kick, round(n)), start, one_period, 40)

    def gain_edge(self, kick: Array | None, delay: int, start: float = 4.0) -> Crossing:
        """The factor on the servo's gains beyond which a swing grows after a kick."""
        return search(lambda g: self.growth(kick, delay, g), start, one_ratio, 40)


def measured_growth(grasp: HeldGrasp, delay: int, gain: float, kick: Array) -> float:
    """Rate at which a small disturbance grows in the whole loop [1/s].

    The loop runs twice, under the same noise, once disturbed and once not: the difference is the disturbance's own.

    Args:
        grasp: Held.
        delay: Of commands [control periods].
        gain: Factor on the servo's gains.
        kick: (24,) speeds of the driven joints [rad/s].
    """
    one = grasp.react(delay, kick, WATCHED, gain).speeds
    other = grasp.react(delay, 0.0 * kick, WATCHED, gain).speeds
    count = min(len(one), len(other))
    return growth_rate(one[:count] - other[:count], grasp.period)


def growth_rate(difference: Array, period: float) -> float:
    """Slope of the logarithm of a signal's size [1/s].

    Args:
        difference: (periods, n) of what grows or decays.
        period: [s].
    """
    width, begin = round(WINDOW / period), round(IGNORED / period)
    starts = range(begin, len(difference) - width + 1, width)
    size = [float(np.sqrt(np.square(difference[i : i + width]).sum() / width)) for i in starts]
    if len(size) < 3 or not np.isfinite(size).all():
        # the simulation has gone to pieces before it was watched long enough
        return 1.0 / WINDOW
    slope = np.polyfit(WINDOW * np.arange(len(size)), np.log(np.maximum(size, 1e-12)), 1)[0]
    return float(slope)


def measured_delay_edge(grasp: HeldGrasp, start: int, kick: Array) -> Crossing:
    """The delay beyond which the simulator's swings grow after a kick [periods]."""
    return search(lambda n: measured_growth(grasp, round(n), 1.0, kick), float(start), one_period, 12)


def measured_gain_edge(grasp: HeldGrasp, delay: int, start: float, kick: Array) -> Crossing:
    """The factor on the servo's gains beyond which the simulator's swings grow after a kick."""
    return search(lambda g: measured_growth(grasp, delay, g, kick), start, one_ratio, 12)
