from __future__ import annotations

import numpy as np

from turnscrew.estimate.contacts import TouchDetector

R = np.tile(np.eye(3), (5, 1, 1))
DT = 0.005


def after(newtons: list[float], detector: TouchDetector | None = None) -> list[bool]:
    """Flag of the thumb after each stretch of half a second (twenty time constants) at a constant force."""
    detector = detector or TouchDetector()
    state = detector.init()
    flags = []
    for f in newtons:
        for _ in range(100):
            state = detector.update(state, np.array([[f, 0, 0]] + [[0.0, 0, 0]] * 4), R, DT)
        flags.append(bool(state.touching[0]))
        assert not state.touching[1:].any()
    return flags


def test_flag_has_hysteresis() -> None:
    assert after([0.0, 0.50, 0.60, 0.50, 0.35, 0.25, 0.50]) == [False, False, True, True, True, False, False]


def test_a_knock_of_one_tick_is_no_touch() -> None:
    detector = TouchDetector()
    # 2.5 N for 5 ms raise a 22 ms low-pass to 2.5 x 5/27 = .46 N, below .55
    state = detector.update(detector.init(), np.array([[2.5, 0, 0]] * 5), R, DT)
    assert not state.touching.any()


def test_forces_are_low_passed_in_the_world() -> None:
    turn = np.tile(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), (5, 1, 1))
    detector = TouchDetector()
    state = detector.init()
    for _ in range(200):
        state = detector.update(state, np.tile([3.0, 0, 0], (5, 1)), turn, DT)
    # a second is 45 time constants
    np.testing.assert_allclose(state.f_W, np.tile([0.0, 3.0, 0.0], (5, 1)), atol=1e-9)
