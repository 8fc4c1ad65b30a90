"""Compiled steps of the estimation against the same formulas in plain NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from turnscrew.contact.grasp import grasp_matrix
from turnscrew.estimate.biased_load import BiasedLoad, LoadState
from turnscrew.estimate.handle_contacts import HandleContacts
from turnscrew.estimate.measured_rows import contacts
from turnscrew.estimate.odometry import RollingOdometry
from turnscrew.estimate.slip_steps import held_force, net_force, pressed
from turnscrew.geometry.closest import CONTACT, NORMAL, ON_PATCH, TIP
from turnscrew.geometry.rotations import exp_so3, skew
from turnscrew.robot.model import Fingertips

ROUNDING = 1e-11
"""Some hundred products of order 1, through matrices of condition below 1e4."""


def covariance(rng: np.random.Generator, n: int) -> np.ndarray:
    A = rng.normal(size=(n, n))
    return A @ A.T


def drawn_tips(rng: np.random.Generator) -> Fingertips:
    R = np.array([exp_so3(rng.normal(size=3)) for _ in range(5)])
    return Fingertips(rng.normal(size=(5, 3)), R, rng.normal(size=(5, 6, 28)), np.full(5, 0.007), np.zeros(5))


def test_odometry_is_a_weighted_least_squares() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        before, c_W, p_WT, R_WT = drawn_tips(rng), rng.normal(size=(5, 3)), rng.normal(size=3), exp_so3(np.ones(3))
        turn = np.array([exp_so3(1e-3 * rng.normal(size=3)) for _ in range(5)])
        after = replace(before, p_WF=before.p_WF + 1e-3 * rng.normal(size=(5, 3)), R_WF=turn @ before.R_WF)
        weight, odometry = np.array([2.0, 0.0, 5.0, 0.0, 0.0]), RollingOdometry(stray=np.inf)
        found = odometry.increment(before, after, c_W, weight, p_WT, R_WT).dtheta
        moved = [after.p_WF[i] + turn[i] @ (c_W[i] - before.p_WF[i]) - c_W[i] for i in range(5)]
        root = np.sqrt(weight / 3.5) / odometry.slip_speed
        # dtheta x lever = -[lever]x dtheta; the prior is on the rates in T
        rows = [-root[i] * skew(c_W[i] - p_WT) for i in (0, 2)]
        prior = np.diag([1 / odometry.tilt_rate, 1 / odometry.tilt_rate, 1 / odometry.yaw_rate]) @ R_WT.T
        told = np.concatenate([*[root[i] * moved[i] for i in (0, 2)], np.zeros(3)])
        best = np.linalg.lstsq(np.vstack([*rows, prior]), told, rcond=None)[0]
        np.testing.assert_allclose(found, best, atol=ROUNDING)


@pytest.mark.parametrize(("loaded", "learns"), [(True, True), (True, False), (False, False)])
@pytest.mark.parametrize("surprise", [4.0, np.inf])
def test_load_is_a_kalman_filters(loaded: bool, learns: bool, surprise: float) -> None:
    rng, block = np.random.default_rng(1), BiasedLoad(0.5, 0.3, 0.2, 0.1, surprise=surprise)
    for _ in range(20):
        x, P, h, y = rng.normal(size=7), covariance(rng, 7), rng.normal(size=5), float(10.0 * rng.normal())
        found = block.update(LoadState(x, P), y, h, 0.7, 0.01, loaded=loaded, learns=learns)
        keep = np.exp(-0.01 / block.memory)
        F = np.diag([1.0, 1.0, *[keep] * 5])
        Q = np.diag([block.drift**2 * 0.01 * loaded, 0.0, *[block.bias_sigma**2 * (1.0 - keep**2)] * 5])
        x, P, H = F @ x, F @ P @ F + Q, np.array([loaded, 0.7 * loaded, *h])
        z, S = y - H @ x, H @ P @ H + block.noise**2
        if loaded and z**2 > surprise * S:
            P[0, 0] += z**2 / surprise - S
        gain = P @ H / (H @ P @ H + block.noise**2)
        gain[1] *= learns
        A = np.eye(7) - np.outer(gain, H)
        np.testing.assert_allclose(found.x, x + gain * z, atol=ROUNDING)
        np.testing.assert_allclose(found.P, A @ P @ A.T + block.noise**2 * np.outer(gain, gain), atol=ROUNDING)


def test_net_force_is_five_kalman_filters() -> None:
    rng, height, share, sigma, noise, keep = np.random.default_rng(2), 0.125, 0.01, 0.1, 0.03, 0.99
    x, P = rng.normal(size=(5, 6)), np.array([covariance(rng, 6) for _ in range(5)])
    f_W, arm, n_W, level = rng.normal(size=(4, 5, 3))
    f_W[3] = 0.0
    after, spread, total = net_force(x, P, f_W, arm, n_W, level, height, share, sigma, noise, keep, 0.2, 0.01)
    squeeze = np.maximum(-(f_W * n_W).sum(axis=1), 0.0)
    y = np.concatenate([f_W.sum(axis=0), np.cross(arm, f_W).sum(axis=0)[:2]])
    jumped = share * ((squeeze + (level * n_W).sum(axis=1)) ** 2).sum()
    F, squares = np.diag([1.0, *[keep] * 5]), 0.0
    for c, (scale, walk) in enumerate([(1.0, 0.2)] * 3 + [(height, 0.01)] * 2):
        H = np.array([1.0, *(scale * squeeze)])
        M = F @ P[c] @ F + np.diag([walk**2, *[sigma**2 * (1.0 - keep**2)] * 5])
        S = H @ M @ H + scale**2 * (np.count_nonzero(squeeze) * noise**2 + jumped) + 1e-9
        z = y[c] - H @ F @ x[c]
        squares += z * z / S
        np.testing.assert_allclose(after[c], F @ x[c] + M @ H / S * z, atol=ROUNDING)
        np.testing.assert_allclose(spread[c], M - np.outer(M @ H, M @ H) / S, atol=ROUNDING)
    assert total == pytest.approx(squares, rel=1e-9)


def test_held_forces_are_level_and_slope_filters() -> None:
    level, slope, f_W = np.random.default_rng(3).normal(size=(3, 5, 3))
    firm = np.array([True, False, True, True, False])
    now, rate, total = held_force(level, slope, f_W, firm, 0.1, 0.6, 0.2)
    z = f_W - level - slope
    np.testing.assert_allclose(now, level + slope + 0.6 * z, atol=ROUNDING)
    np.testing.assert_allclose(rate, slope + 0.2 * z, atol=ROUNDING)
    assert total == pytest.approx((z[firm] ** 2).sum() / 0.1**2, rel=1e-9)


def test_fingers_that_press_little_or_let_go_are_loose() -> None:
    force, none = np.outer([3.0, 0.1, 3.0, 0.5, 0.0], [0.0, 0.6, 0.8]), np.zeros(5)
    slow = np.array([3.0, 0.1, 3.0, 0.5, 0.0])
    landed = pressed(force, slow, none, force, 0.25, 1.5, 0.87, 0.06, 0.01)
    np.testing.assert_allclose(landed.since, [0.01, 0.0, 0.01, 0.01, 0.0])
    assert not landed.same
    assert not landed.firm.any()
    found = pressed(force, slow, 10.0 * landed.since, force, 0.25, 1.5, 0.87, 0.06, 0.01)
    assert found.firm.tolist() == [True, False, True, False, False]
    assert found.same
    assert (landed.loose, found.loose) == pytest.approx((6.6, 0.6))
    np.testing.assert_allclose(found.size, slow, atol=ROUNDING)
    np.testing.assert_array_equal(found.f_W[1], np.zeros(3))
    # all press less than they did
    assert not pressed(0.8 * force, slow, found.since, force, 0.25, 1.5, 0.87, 0.06, 0.01).firm.any()


def test_load_on_the_tool_is_the_grasp_matrixs() -> None:
    rng = np.random.default_rng(4)
    c_W, n_W, f_W = rng.normal(size=(3, 5, 3))
    p_WT, R_WT = rng.normal(size=3), exp_so3(rng.normal(size=3))
    F_h, squeeze = HandleContacts(np.zeros((5, 17)), c_W, c_W, n_W, np.zeros(5)).load(f_W, p_WT, R_WT)
    F_W = (grasp_matrix(c_W, p_WT) @ f_W.ravel()).reshape(2, 3)
    np.testing.assert_allclose(F_h, (F_W @ R_WT).ravel(), atol=ROUNDING)
    np.testing.assert_allclose(squeeze, np.maximum(-(f_W * n_W).sum(axis=1), 0.0), atol=ROUNDING)


def test_bend_and_noise_of_contacts_are_as_stated() -> None:
    rng, k = np.random.default_rng(5), 3
    points, p_WF, J = rng.normal(size=(k, 17)), rng.normal(size=(k, 3)), rng.normal(size=(k, 6, 17))
    p_WT, R_WT, P, force = rng.normal(size=3), exp_so3(rng.normal(size=3)), covariance(rng, 37), rng.random(k)
    sizes = {"encoder": 0.1, "indentation": 0.2, "indentation_error": 0.3, "contact": 0.4, "alike": 5.0}
    H, z, R = contacts(points, p_WF, J, force, p_WT, R_WT, P, np.zeros(3), 0.0, *sizes.values())
    straight = contacts(points, p_WF, J, force, p_WT, R_WT, 0.0 * P, np.zeros(3), 0.0, *sizes.values())
    for i in range(k):
        n, axis = points[i, NORMAL:ON_PATCH], R_WT[:, 2]
        r, s, around = points[i, CONTACT:TIP] - p_WT, points[i, TIP:NORMAL] - p_WF[i], np.cross(axis, n)
        way = np.concatenate([np.cross(r, around), around])
        offsets = around @ J[i, :3] + np.cross(s, around) @ J[i, 3:]
        row = np.concatenate([way, np.zeros(4), offsets, around, np.zeros(7)])
        curvature = 1.0 / (np.linalg.norm(np.cross(axis, r)) + np.linalg.norm(s))
        bend = 0.5 * curvature * (row @ P @ row)
        assert straight[1][i] - z[i] == pytest.approx(bend, rel=1e-9)
        noise = 0.1**2 * (H[i, 10:27] @ H[i, 10:27]) + (0.3 * 0.2 * force[i]) ** 2 + 0.4**2 + 2 * 5.0 * bend**2
        assert R[i, i] == pytest.approx(noise, rel=1e-9)
    np.testing.assert_array_equal(R, np.diag(np.diag(R)))
