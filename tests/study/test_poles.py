"""Poles of loops whose answer is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from turnscrew.study.stability.linearise import jacobian
from turnscrew.study.stability.poles import ControlStep, SampledLoop

PERIOD, FREQUENCY, DAMPING = 0.002, 40.0, 0.3


def spring(period: float = PERIOD) -> tuple[np.ndarray, np.ndarray]:
    """A mass on a spring with a damper, sampled exactly, its input a held force."""
    A = np.array([[0.0, 1.0], [-(FREQUENCY**2), -2 * DAMPING * FREQUENCY]])
    whole = expm(np.block([[A, np.array([[0.0], [1.0]])], [np.zeros((1, 3))]]) * period)
    return whole[:2, :2], whole[:2, 2:]


def feedback(H: np.ndarray) -> ControlStep:
    """A controller that remembers nothing."""
    return ControlStep(np.zeros((0, 0)), np.zeros((0, H.shape[1])), np.zeros((len(H), 0)), H)


def test_a_spring_has_its_natural_frequency_and_damping():
    A, B = spring()
    differenced = jacobian(lambda x: A @ x, np.full(2, 1e-3))
    ((frequency, damping),) = SampledLoop(differenced, B, (feedback(np.zeros((1, 2))),), PERIOD).poles(0).continuous()
    # sampled exactly: rounding only
    assert frequency == pytest.approx(FREQUENCY, rel=1e-9)
    assert damping == pytest.approx(DAMPING, rel=1e-9)


@pytest.mark.parametrize("delay", [0, 1, 2, 5, 9])
def test_an_integrator_with_delay_has_the_roots_of_its_polynomial(delay):
    gain = 0.07
    # x' = x - g x(n periods ago): z^(n+1) - z^n + g = 0
    loop = SampledLoop(np.eye(1), np.eye(1), (feedback(-gain * np.eye(1)),), PERIOD)
    roots = np.roots([1.0, -1.0, *[0.0] * (delay - 1), gain] if delay else [1.0, -1.0 + gain])
    found = loop.poles(delay).values
    # eigenvalues and roots are different algorithms on simple roots
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(roots), atol=1e-9)


@pytest.mark.parametrize("delay", [1, 4, 12])
def test_an_integrator_swings_from_the_gain_of_the_closed_form_on(delay):
    # on the unit circle z^(n+1) - z^n = -g holds at the angle pi / (2 n + 1), where g = 2 sin(angle / 2)
    edge = 2.0 * np.sin(np.pi / (2 * delay + 1) / 2)
    for factor, grows in ((0.98, False), (1.02, True)):
        loop = SampledLoop(np.eye(1), np.eye(1), (feedback(-factor * edge * np.eye(1)),), PERIOD)
        assert (loop.poles(delay).growth > 0.0) == grows


def simulate(loop: SampledLoop, delay: int, x: np.ndarray, steps: int) -> np.ndarray:
    """The loop as it runs, with a queue, without its matrix."""
    z, way, seen = np.zeros(len(loop.controls[0].E)), [np.zeros(loop.B.shape[1])] * delay, []
    for index in range(steps):
        control = loop.controls[index % len(loop.controls)]
        way.append(control.G @ z + control.H @ x)
        z, x = control.E @ z + control.F @ x, loop.A @ x + loop.B @ way.pop(0)
        seen.append(x)
    return np.array(seen)


@pytest.mark.parametrize("delay", [0, 1, 3, 8])
def test_steps_in_turn_do_what_the_loop_does(delay):
    rng = np.random.default_rng(2)
    A, B = spring()
    controls = tuple(
        ControlStep(0.5 * np.eye(2), rng.normal(size=(2, 2)), rng.normal(size=(1, 2)), rng.normal(size=(1, 2)))
        for _ in range(3)
    )
    loop, x = SampledLoop(A, B, controls, PERIOD), np.array([1.0, -2.0])
    whole = loop.closed(delay)
    state = np.concatenate([x, np.zeros(len(whole) - 2)])
    for _ in range(4):
        state = whole @ state
    # the same sums in another order
    np.testing.assert_allclose(state[:2], simulate(loop, delay, x, 12)[-1], rtol=1e-9, atol=1e-12)


def test_growth_is_the_rate_of_what_is_simulated():
    A, B = spring()
    loop = SampledLoop(A, B, (feedback(np.array([[-300.0, 0.0]])),), PERIOD)
    delay = 20
    seen = np.abs(simulate(loop, delay, np.array([1.0, 0.0]), 3000)[:, 0])
    first, last = seen[1000:1500].max(), seen[2500:3000].max()
    # where in its window a peak falls, half a swing of .1 s at most, times the rate of 7 / s, over 3 s
    assert loop.poles(delay).growth == pytest.approx(np.log(last / first) / (1500 * PERIOD), abs=0.25)


def test_real_poles_do_not_swing():
    loop = SampledLoop(np.diag([1.0, 1.02]), np.zeros((2, 1)), (feedback(np.zeros((1, 2))),), PERIOD)
    assert len(loop.poles(0).swings) == 0
    assert loop.poles(0).growth == -np.inf
