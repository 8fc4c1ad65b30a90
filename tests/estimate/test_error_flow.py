"""The compiled prediction against `F P F^T + Q` with F and Q written out."""

from __future__ import annotations

import numpy as np

from turnscrew.estimate.error_flow import flow
from turnscrew.estimate.filter_state import HAND, OFFSETS, SIZE, SLIDE, THETA, TIP
from turnscrew.geometry.rotations import exp_so3, skew


def test_covariance_is_that_of_the_matrix_written_out() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        A, R_WT, keep = rng.normal(size=(SIZE, SIZE)), exp_so3(rng.normal(size=3)), float(rng.uniform(0.5, 1.0))
        P, G, D = A @ A.T, rng.normal(size=(3, 3)), rng.normal(size=(3, 17))
        dtheta, hand_W, reach = 0.1 * rng.normal(size=3), rng.normal(size=3), rng.normal(size=(3, 6))
        sway, walk, spin_walk = rng.random(6), rng.random(SIZE), float(rng.random())
        turn, after = flow(P, dtheta, G, D, R_WT, hand_W, keep, reach, sway, walk, spin_walk)
        z, swept = R_WT[:, 2], G @ skew(dtheta)
        by_hand = (1.0 - keep) * G + swept
        F = np.eye(SIZE)
        F[THETA, THETA] = exp_so3(dtheta + by_hand @ hand_W)
        F[THETA, TIP], F[THETA, OFFSETS], F[THETA, HAND] = swept, -D, by_hand
        F[THETA, SLIDE], F[HAND, HAND] = -(z @ dtheta) * z, keep * np.eye(3)
        kick = np.zeros((SIZE, 6))
        kick[THETA], kick[HAND] = -G @ reach, reach
        Q = np.diag(walk) + kick @ np.diag(sway) @ kick.T
        Q[THETA, THETA] += spin_walk * np.outer(z, z)
        # sums of some hundred products of order 10: rounding
        np.testing.assert_allclose(turn, F[THETA, THETA], atol=1e-13)
        np.testing.assert_allclose(after, F @ P @ F.T + Q, atol=1e-10)
