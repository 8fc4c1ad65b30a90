from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.estimation import P_WS, ROBOT, contact, gait

from turnscrew.estimate.filter_state import OFFSET_COLUMNS
from turnscrew.estimate.odometry import Rolled, RollingOdometry
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.model import Fingertips

R_HANDLE, R_TIP, HEIGHT = 0.018, 0.007, 0.13
Z = np.array([0.0, 0.0, 1.0])


def tips(phi: list[float], psi: list[float], tilt: np.ndarray | None = None) -> Fingertips:
    """Round fingertips about an upright handle, centres at angles phi, turned by psi about the vertical."""
    tilt = np.eye(3) if tilt is None else tilt
    p = np.zeros((5, 3))
    R = np.tile(np.eye(3), (5, 1, 1))
    for i, (a, b) in enumerate(zip(phi, psi, strict=True)):
        p[i] = tilt @ np.array([(R_HANDLE + R_TIP) * np.cos(a), (R_HANDLE + R_TIP) * np.sin(a), HEIGHT])
        R[i] = tilt @ exp_so3(b * Z)
    return Fingertips(p, R, np.zeros((5, 6, 28)), np.full(5, R_TIP), np.zeros(5))


def contacts(phi: list[float]) -> np.ndarray:
    c = np.zeros((5, 3))
    for i, a in enumerate(phi):
        c[i] = [R_HANDLE * np.cos(a), R_HANDLE * np.sin(a), HEIGHT]
    return c


def increment(dphi: float, dpsi: float, phi: list[float], weight: list[float]) -> np.ndarray:
    pad = [0.0] * (5 - len(phi))
    before, after = tips(phi + pad, [0.0] * 5), tips([a + dphi for a in phi] + pad, [dpsi] * 5)
    w = np.array(weight + pad)
    return RollingOdometry().increment(before, after, contacts(phi + pad), w, np.zeros(3), np.eye(3)).dtheta


@pytest.mark.parametrize(("dphi", "dpsi"), [(-0.002, 0.0), (0.0, 0.005), (-0.003, 0.006), (0.002, 0.002)])
@pytest.mark.parametrize("weight", [[5.0, 5.0], [2.0, 8.0]])
def test_yaw_is_the_closed_form_of_rolling_cylinders(dphi: float, dpsi: float, weight: list[float]) -> None:
    expected = ((R_HANDLE + R_TIP) * dphi - R_TIP * dpsi) / R_HANDLE
    dtheta = increment(dphi, dpsi, [0.3, 0.3 + np.pi], weight)
    # the finite step of 6 mrad bends the contact's path by 6e-3 of it; the prior takes 2e-4
    np.testing.assert_allclose(dtheta[2], expected, rtol=8e-3)
    # tilt would be the chord's sagitta over the height: (.025 x .006^2 / 2) / .13
    assert np.abs(dtheta[:2]).max() < 1e-5


def test_one_finger_alone_is_read_as_yaw() -> None:
    dtheta = increment(0.0, 0.004, [0.3], [5.0])
    # the prior splits the motion in the ratio of (rate x lever)^2: 3 x .018 against .1 x .13, so 5 % go to tilt
    np.testing.assert_allclose(dtheta[2], -R_TIP * 0.004 / R_HANDLE, rtol=0.08)


def test_tilt_of_the_whole_grasp_is_seen() -> None:
    turn = np.array([0.001, -0.0005, -0.002])
    phi = [0.3, 0.3 + np.pi, 0.0, 0.0, 0.0]
    before, after = tips(phi, [0.0] * 5), tips(phi, [0.0] * 5, exp_so3(turn))
    weight = np.array([5.0, 3.0, 0.0, 0.0, 0.0])
    dtheta = RollingOdometry().increment(before, after, contacts(phi), weight, np.zeros(3), np.eye(3)).dtheta
    # the prior takes 1/340 of the tilt
    np.testing.assert_allclose(dtheta, turn, rtol=5e-3)


def test_without_touch_nothing_moves() -> None:
    assert np.array_equal(increment(0.01, 0.01, [0.3, 3.4], [0.0, 0.0]), np.zeros(3))


def test_encoder_noise_does_not_accumulate() -> None:
    rng = np.random.default_rng(0)
    phi0 = [0.3, 0.3 + np.pi, 0.0, 0.0, 0.0]
    weight, odometry = np.array([5.0, 5.0, 0, 0, 0]), RollingOdometry()
    before, yaw = tips(phi0, [0.0] * 5), 0.0
    for _ in range(500):
        after = tips([a + e for a, e in zip(phi0, rng.normal(0, 0.002, 5), strict=True)], [0.0] * 5)
        yaw += odometry.increment(before, after, contacts(phi0), weight, np.zeros(3), np.eye(3)).dtheta[2]
        before = after
    # a random walk of 500 steps of 2 mrad x 1.39 would be at 60 mrad; the sum of differences stays at one reading's
    assert abs(yaw) < 0.012


def test_sensitivities_are_the_derivatives_of_the_rotation() -> None:
    """To a hand that is read displaced from one tick to the next, and to wrong joint offsets at both."""
    stroke = [t for t in gait(1) if t.phase == "roll"]
    first, second = stroke[80], stroke[84]
    weight, odometry, step = np.array([5.0, 0.0, 5.0, 0.0, 0.0]), RollingOdometry(), 1e-5

    def rolled(offset: np.ndarray, shift: np.ndarray) -> Rolled:
        before, after = ROBOT.fingertips(first.q + offset), ROBOT.fingertips(second.q + offset)
        after = replace(after, p_WF=after.p_WF + shift)
        # the contact is the same piece of skin
        skin = (before.R_WF @ piece[:, :, None])[:, :, 0] + before.p_WF
        return odometry.increment(before, after, skin, weight, first.p_WT, first.R_WT)

    tips = ROBOT.fingertips(first.q)
    points = np.array([contact(tips, i, first.p_WT, first.R_WT).tip_W for i in range(5)])
    piece = (tips.R_WF.transpose(0, 2, 1) @ (points - tips.p_WF)[:, :, None])[:, :, 0]
    exact = rolled(np.zeros(28), np.zeros(3))
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        numeric = (rolled(np.zeros(28), shift).dtheta - rolled(np.zeros(28), -shift).dtheta) / (2 * step)
        # linear, to rounding
        np.testing.assert_allclose(exact.per_shift[:, axis], numeric, atol=1e-6)
    for k, column in enumerate(OFFSET_COLUMNS):
        offset = step * np.eye(28)[column]
        numeric = (rolled(offset, np.zeros(3)).dtheta - rolled(-offset, np.zeros(3)).dtheta) / (2 * step)
        # fitted to two contacts that slip by 1e-4, whose misfit the derivative leaves out
        np.testing.assert_allclose(exact.per_offset[:, k], numeric, atol=0.05 * np.abs(numeric).max() + 1e-3)


def test_finger_that_goes_another_way_than_two_others_is_left_out() -> None:
    rng = np.random.default_rng(5)
    turn = np.array([0.002, -0.001, -0.01])
    tips = ROBOT.fingertips(gait(1)[0].q)
    c_W = tips.p_WF + rng.normal(0.0, 0.003, (5, 3))
    R = exp_so3(turn)
    # all fingers carry the tool with them, but for the thumb, which goes back by 2 mm and is said to touch
    moved = replace(tips, p_WF=P_WS + (tips.p_WF - P_WS) @ R.T, R_WF=R @ tips.R_WF)
    moved.p_WF[0] += np.array([0.0, 0.002, 0.0])
    weight = np.array([1.3, 5.9, 0.0, 5.5, 0.0])
    found = RollingOdometry().increment(tips, moved, c_W, weight, P_WS, np.eye(3)).dtheta
    # two fingers against a prior that they outweigh by 300 in tilt and 6000 in yaw
    np.testing.assert_allclose(found, turn, rtol=0.02, atol=2e-5)
