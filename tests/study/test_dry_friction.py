"""What dry friction takes from a swing, against the closed form, a damper's pole and a simulation with the jump."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from turnscrew.study.stability.dry_friction import FASTEST_DECAY, DryFriction, Swing
from turnscrew.study.stability.poles import ControlStep, SampledLoop

PERIOD, FREQUENCY, MASS, FORCE = 0.002, 50.0, 0.002, 0.001
"""About a free finger's: 50 rad/s, .002 kg.m2, .001 N.m."""

RUBBING = DryFriction(np.array([FORCE]), np.array([1]))


def sampled(A: np.ndarray, B: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """x' = A x + B u, u held for some time."""
    n, m = B.shape
    whole = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * time)
    return whole[:n, :n], whole[:n, n:]


def spring(growth: float) -> tuple[np.ndarray, np.ndarray]:
    """A mass on a spring whose swings grow [1/s], and a force on it."""
    return np.array([[0.0, 1.0], [-(FREQUENCY**2), 2.0 * growth]]), np.array([[0.0], [1.0 / MASS]])


def alone(A: np.ndarray, B: np.ndarray) -> SampledLoop:
    """Without a controller."""
    nothing = ControlStep(np.zeros((0, 0)), np.zeros((0, len(A))), np.zeros((B.shape[1], 0)), np.zeros(B.T.shape))
    return SampledLoop(A, B, (nothing,), PERIOD)


def only(swings: list[Swing]) -> Swing:
    (swing,) = swings
    return swing


@pytest.mark.parametrize("speed", [0.05, 0.3, 2.0])
def test_friction_takes_amplitude_at_a_constant_rate(speed):
    swing = only(RUBBING.swings(alone(*sampled(*spring(1.0), PERIOD)), 0, np.array([0.0, speed])))
    assert swing.pole.real == pytest.approx(1.0, rel=1e-9)
    # speed at the start is the amplitude but for the damping's phase, 1 in 50
    assert swing.amplitude == pytest.approx(speed, rel=1e-3)
    # power F V 2 / pi out of an energy of m V^2 / 2; friction that is held for a period is half of one late: .05 rad
    assert swing.held == pytest.approx(2.0 * FORCE / (np.pi * MASS * speed), rel=0.01)


def simulated(growth: float, speed: float, seconds: float) -> float:
    """Amplitude of the speed after some time, friction a force that jumps with the sign of the speed."""
    step = 2e-5
    A, B = sampled(*spring(growth), step)
    x, seen = np.array([0.0, speed]), []
    for _ in range(round(seconds / step)):
        x = A @ x - B[:, 0] * FORCE * np.sign(x[1])
        seen.append(abs(x[1]))
    return float(max(seen[-round(2 * np.pi / FREQUENCY / step) :]))


@pytest.mark.parametrize(("factor", "grows"), [(0.9, False), (1.1, True)])
def test_the_edge_is_one_of_amplitude(factor, grows):
    loop, growth = alone(*sampled(*spring(1.5), PERIOD)), 1.5
    edge = 2.0 * FORCE / (np.pi * MASS * growth)
    assert (RUBBING.growth(loop, 0, np.array([0.0, factor * edge])) > 0.0) == grows
    # a tenth off the edge becomes e^1.5 tenths within a second: it is gone beyond doubt
    assert (simulated(growth, factor * edge, 1.0) > factor * edge) == grows


def test_growth_at_an_amplitude_is_the_simulated_one():
    growth, speed, seconds = 1.5, 0.5, 0.5
    swing = only(RUBBING.swings(alone(*sampled(*spring(growth), PERIOD)), 0, np.array([0.0, speed])))
    # a' = growth a - c: from here on in closed form
    rest = swing.held * speed / growth
    expected = rest + (speed - rest) * np.exp(growth * seconds)
    # the last peak is up to half a swing, .06 s, before the end: 1.5 / s times that at most
    assert simulated(growth, speed, seconds) == pytest.approx(expected, rel=0.1)


# with one step in a turn they are the same to first order; with two different ones, a speed is another after each,
# while the damper that stands for its friction is made for one of them
@pytest.mark.parametrize(("steps", "tolerance"), [(1, 1e-4), (2, 0.15)])
@pytest.mark.parametrize("delay", [0, 1, 4])
def test_it_holds_a_controlled_swing_as_the_equivalent_damper_does(delay, steps, tolerance):
    A, B = sampled(
        np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-2500.0, 300, -2, 0], [300, -3600.0, 0, -1]]),
        np.array([[0, 0], [0, 0], [500.0, 100], [100, 400.0]]), PERIOD,
    )  # fmt: skip
    rng = np.random.default_rng(6)
    controls = tuple(
        ControlStep(0.5 * np.eye(2), rng.normal(size=(2, 4)), -0.1 * rng.random((2, 2)), -0.05 * rng.random((2, 4)))
        for _ in range(steps)
    )
    loop, at, start = SampledLoop(A, B, controls, PERIOD), np.array([2, 3]), np.array([0.0, 0.0, 0.4, -0.3])
    time = steps * PERIOD
    # so weak that the first order is all there is
    force = np.array([1e-6, 2e-6])
    for swing in DryFriction(force, at).swings(loop, delay, start):
        whole = loop.closed(delay)
        z, right = np.linalg.eig(whole)
        i = int(np.argmin(np.abs(np.log(z) / time - swing.pole)))
        mode = np.linalg.solve(right, np.pad(start, (0, len(whole) - 4)))[i] * right[:, i]
        speeds = 2.0 * np.abs(mode[at])
        assert swing.amplitude == pytest.approx(speeds.max(), rel=1e-6)
        # -d v, d = 4 F / (pi V), v and V after the step: A and B turn into (1 + B d S)^-1 times themselves
        turned = np.eye(4)
        turned[:, at] += B * (4.0 * force / (np.pi * speeds * abs(z[i])))
        damped = replace(loop, A=np.linalg.solve(turned, A), B=np.linalg.solve(turned, B))
        moved = np.log(np.linalg.eigvals(damped.closed(delay))) / time
        shift = moved[np.argmin(np.abs(moved - swing.pole))].real - swing.pole.real
        assert swing.held == pytest.approx(max(-shift, 0.0), rel=tolerance, abs=1e-9)


def test_a_swing_that_nothing_excites_is_held():
    loop = alone(*sampled(*spring(1.5), PERIOD))
    assert RUBBING.growth(loop, 0, np.zeros(2)) == -FASTEST_DECAY
