from __future__ import annotations

import numpy as np

from turnscrew.estimate.arm_smoothing import ArmSmoother, N

DT = 0.005


def test_no_lag_at_constant_speed_and_fingers_pass_through() -> None:
    smoother = ArmSmoother()
    state = smoother.init(np.zeros(28))
    for tick in range(1, 1001):
        reading = np.full(28, 0.1 * DT * tick)
        state, q, v = smoother.update(state, reading, np.full(28, 9.0), DT)
    # 5 s are twenty time constants: (1 + 20) exp(-20) of the start is left
    np.testing.assert_allclose(q[:N], reading[:N], atol=1e-9)
    np.testing.assert_allclose(v[:N], 0.1, atol=1e-7)
    assert np.array_equal(q[N:], reading[N:])
    assert np.array_equal(v[N:], np.full(28 - N, 9.0))


def test_a_sixth_of_white_noise_is_left() -> None:
    smoother, rng = ArmSmoother(), np.random.default_rng(0)
    state = smoother.init(np.zeros(28))
    out = []
    for _ in range(20000):
        state, q, _ = smoother.update(state, rng.normal(size=28), np.zeros(28), DT)
        out.append(q[:N])
    # critically damped g-h filter at dt/time = 1/50: sqrt(5/4 x 1/50) = .158; correlated samples know it to 3 %
    np.testing.assert_allclose(np.std(out), 0.158, rtol=0.06)
