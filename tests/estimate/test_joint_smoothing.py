"""Smoothed joints: a wanted motion comes through at once, noise shrinks as a first-order low-pass shrinks it."""

from __future__ import annotations

import numpy as np

from turnscrew.estimate.joint_smoothing import JointSmoother
from turnscrew.robot.joints import ARM, JOINTS, WRIST

DT = 0.01
N = len(JOINTS)
ARMS, WRISTS, FINGERS = slice(0, len(ARM)), slice(len(ARM), len(ARM) + len(WRIST)), slice(len(ARM) + len(WRIST), N)


def test_wanted_motion_comes_through_without_lag() -> None:
    smoother, rng = JointSmoother(), np.random.default_rng(3)
    truth = rng.normal(size=N)
    state = smoother.init(truth)
    for _ in range(50):
        motion = rng.normal(0.0, 0.05, N)
        truth = truth + motion
        state, q, v = smoother.update(state, truth, motion / DT, motion, DT)
        # sums of fifty numbers near 1 and fifty near 5 rad/s: rounding
        np.testing.assert_allclose(q, truth, atol=1e-13)
        np.testing.assert_allclose(v, motion / DT, atol=1e-11)
    _, _, v = smoother.update(state, truth, np.full(N, 7.0), np.zeros(N), DT)
    np.testing.assert_array_equal(v[FINGERS], 7.0)


def test_motion_that_was_not_wanted_is_found_within_the_time_constant() -> None:
    smoother = JointSmoother()
    state = smoother.init(np.zeros(N))
    for _ in range(25):
        state, q, _ = smoother.update(state, np.ones(N), np.zeros(N), np.zeros(N), DT)
    for part, time in ((ARMS, smoother.arm), (WRISTS, smoother.wrist), (FINGERS, smoother.finger)):
        np.testing.assert_allclose(q[part], 1 - np.exp(-0.25 / time), rtol=1e-12)


def test_noise_that_is_left() -> None:
    smoother, rng = JointSmoother(), np.random.default_rng(0)
    state = smoother.init(np.zeros(N))
    out = []
    for _ in range(20000):
        state, q, _ = smoother.update(state, rng.normal(size=N), np.zeros(N), np.zeros(N), DT)
        out.append(q)
    spread = np.std(out, axis=0)
    for part, time in ((ARMS, smoother.arm), (WRISTS, smoother.wrist), (FINGERS, smoother.finger)):
        a = np.exp(-DT / time)
        # 200 s hold some seventy independent samples of the arm's smoothed noise: known to 8 %, of two joints to 6 %
        np.testing.assert_allclose(np.sqrt(np.mean(spread[part] ** 2)), np.sqrt((1 - a) / (1 + a)), rtol=0.18)
