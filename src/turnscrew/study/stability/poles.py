"""Poles of a sampled loop whose controller's output reaches the plant a number of periods late."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array

SLOWEST = 10.0
"""Frequency from which an eigenvalue counts as a swing [rad/s].  Slower ones are near 1 and belong to integrators,
creep and odometry, which dry friction and the camera's frames hold in the real loop and which a linear map knows badly;
what a delay takes from a grasp is at 20 rad/s and more."""


@dataclass(frozen=True, slots=True)
class ControlStep:
    """A controller, linear, in one period: `z' = E z + F x, y = G z + H x`.

    Attributes:
        E: (k, k) from its state to its state.
        F: (k, n) what it takes from the plant.
        G: (m, k) its output from its state.
        H: (m, n) its output from the plant, with nothing remembered.
    """

    E: Array
    F: Array
    G: Array
    H: Array


@dataclass(frozen=True, slots=True)
class SampledLoop:
    """A plant `x' = A x + B u` and a controller whose steps take turns; u is the output y of some periods ago.

    Attributes:
        A: (n, n) the plant's step.
        B: (n, m) what an input does in it.
        controls: The controller's steps, in order.
        period: Of a step [s].
    """

    A: Array
    B: Array
    controls: tuple[ControlStep, ...]
    period: float

    def step(self, index: int, delay: int) -> Array:
        """The closed loop's step: its state is x, z and `delay` outputs under way, the newest first."""
        control = self.controls[index]
        E, F, G, H = control.E, control.F, control.G, control.H
        n, m, k = len(self.A), self.B.shape[1], len(E)
        if delay == 0:
            return np.block([[self.A + self.B @ H, self.B @ G], [F, E]])
        way = m * delay
        step = np.zeros((n + k + way, n + k + way))
        step[:n, :n], step[:n, n + k + way - m :] = self.A, self.B
        step[n : n + k, :n], step[n : n + k, n : n + k] = F, E
        step[n + k : n + k + m, :n], step[n + k : n + k + m, n : n + k] = H, G
        step[n + k + m :, n + k : n + k + way - m] = np.eye(way - m)
        return step

    def closed(self, delay: int) -> Array:
        """The closed loop over one turn of the controller's steps."""
        whole = self.step(0, delay)
        for index in range(1, len(self.controls)):
            whole = self.step(index, delay) @ whole
        return whole

    def poles(self, delay: int) -> Poles:
        """Eigenvalues of the closed loop."""
        return Poles(np.linalg.eigvals(self.closed(delay)), self.period * len(self.controls))


@dataclass(frozen=True, slots=True)
class Poles:
    """Eigenvalues of a map, read as poles in continuous time.

    Attributes:
        values: (n,) eigenvalues.
        time: That passes in the map [s].
    """

    values: np.ndarray
    time: float

    @property
    def swings(self) -> np.ndarray:
        """Those that oscillate, one of each pair, largest first."""
        swings = self.values[np.angle(self.values) > SLOWEST * self.time]
        return np.asarray(swings[np.argsort(-np.abs(swings))])

    @property
    def growth(self) -> float:
        """Rate at which the largest swing grows [1/s]; minus infinity where nothing oscillates."""
        swings = self.swings
        return float(np.log(np.abs(swings[0])) / self.time) if len(swings) else -np.inf

    def continuous(self) -> list[tuple[float, float]]:
        """Natural frequency [rad/s] and damping ratio of each swing, the least decaying first: `s = ln(z) / time`."""
        s = np.log(self.swings) / self.time
        return [(float(abs(pole)), float(-pole.real / abs(pole))) for pole in s]
