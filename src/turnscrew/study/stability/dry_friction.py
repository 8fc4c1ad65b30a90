"""What dry friction takes from a swing.

A linear loop's swing grows at the same rate however large it is.  Dry friction takes amplitude at a rate that does not
depend on how much there is: small swings it holds, large ones it hardly slows.  So the edge of a loop with dry friction
is one for swings of a certain size.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from turnscrew.geometry.arrays import Array, Rows
from turnscrew.study.stability.poles import SLOWEST, SampledLoop

FASTEST_DECAY = 20.0
"""Swings that decay faster are left out [1/s]: they are gone in a tenth of the time for which a swing is watched."""

TINY = 1e-12
"""Stands for a speed of nothing [rad/s], whose friction has no direction."""


@dataclass(frozen=True, slots=True)
class Swing:
    """One oscillating mode of a loop, as large as something has made it.

    Attributes:
        pole: In continuous time, without dry friction [1/s].
        amplitude: Of the speed that is largest in it [rad/s].
        held: By how much dry friction slows its growth at this amplitude [1/s].
    """

    pole: complex
    amplitude: float
    held: float

    @property
    def growth(self) -> float:
        """Rate at which it grows at this amplitude [1/s]."""
        return self.pole.real - self.held


@dataclass(frozen=True, slots=True)
class DryFriction:
    """Friction that opposes a speed with the same force at any speed, at each input of a loop.

    In a swing a speed is `V cos(w t)`, and friction a square wave, whose fundamental is `-(4 F / pi) cos(w t)`
    (describing function).  To first order an input u moves the eigenvalue z of a map, whose eigenvectors are r and l
    with `l r = 1`, by `l B u` for a swing of unit size; it is added up over the steps of a turn of the loop.  Where the
    loop's phase would make friction feed a swing, to first order, it counts as nothing: the swings for which that would
    matter are so small that friction holds their joints.

    Attributes:
        force: (m,) F at each input [N.m].
        speeds: (m,) where among the plant's coordinates the speed is that an input works on.
    """

    force: Array
    speeds: Rows

    def swings(self, loop: SampledLoop, delay: int, start: Array) -> list[Swing]:
        """The loop's swings after it has been disturbed, the fastest growing first.

        Args:
            loop: Without dry friction.
            delay: Of its inputs [periods].
            start: (n,) where the disturbance puts the plant; nothing else is disturbed.
        """
        steps = [loop.step(index, delay) for index in range(len(loop.controls))]
        whole, time = loop.closed(delay), loop.period * len(steps)
        z, left, right = eig(whole, left=True, right=True)
        found = []
        for i in ((np.angle(z) > SLOWEST * time) & (np.abs(z) > np.exp(-FASTEST_DECAY * time))).nonzero()[0]:
            r = right[:, i]
            l_H = left[:, i].conj() / (left[:, i].conj() @ r)
            # a real motion has the mode and its conjugate: twice the real part
            size = 2.0 * abs(l_H[: len(start)] @ start)
            pole = complex(np.log(z[i]) / time)
            loss = self._loss(steps, loop.B, l_H, r, complex(z[i])) / time
            amplitude = float(size * np.abs(r[self.speeds]).max())
            found.append(Swing(pole, amplitude, loss / max(size, TINY)))
        return sorted(found, key=lambda swing: -swing.growth)

    def growth(self, loop: SampledLoop, delay: int, start: Array) -> float:
        """Rate at which the fastest swing grows [1/s], at least -`FASTEST_DECAY`."""
        return max([-FASTEST_DECAY, *(swing.growth for swing in self.swings(loop, delay, start))])

    def _loss(self, steps: list[Array], B: Array, l_H: np.ndarray, r: np.ndarray, z: complex) -> float:
        """What friction takes from the logarithm of a swing of amplitude 1 in a turn of the loop."""
        states = [r]
        for step in steps:
            states.append(step @ states[-1])
        taken, costate = 0.0j, l_H
        for step, state in zip(steps[::-1], states[:0:-1], strict=True):
            speed = state[self.speeds]
            against = 4.0 / np.pi * self.force * speed / np.maximum(np.abs(speed), TINY)
            taken += complex(costate[: len(B)] @ (B @ against))
            costate = costate @ step
        return max((taken / z).real, 0.0)
