from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.cells import PLAN
from rigs.plants import Still

from turnscrew.actuate.position import DRIVEN_INDEX
from turnscrew.estimate.finger_force import ForceFromTorque, contact_jacobians, normals
from turnscrew.robot.joints import COUPLED, DRIVEN, FINGERS, INDEX, finger_joints
from turnscrew.robot.model import RobotModel
from turnscrew.sense.strain_gauges import StrainGauges

ROBOT = RobotModel()
Q = PLAN.rolling(0.0)
# the plan leaves the little finger straight, next to its stops, against which a push would lean
Q[[INDEX[name] for name in ("LFJ5", "LFJ4", "LFJ3", "LFJ2", "LFJ1")]] = 0.3, 0.0, 0.5, 0.5, 0.5
TIPS = ROBOT.fingertips(Q)
DT = 0.01


def pads(q: np.ndarray) -> np.ndarray:
    """Points (5, 3) on the fingertips' pads, 40 deg from their axes towards the palm."""
    tips = ROBOT.fingertips(q)
    out = np.cos(0.7) * tips.R_WF[:, :, 2] - np.sin(0.7) * tips.R_WF[:, :, 1]
    return np.asarray(tips.p_WF + tips.rho[:, None] * out)


def torques(q: np.ndarray, tip_W: np.ndarray, f_F: np.ndarray) -> np.ndarray:
    """Drive torques (24,) that press with f_F at rest, from the Jacobians of moved points, not the block's own."""
    still = np.zeros(28)
    torque = ROBOT.inverse_dynamics(q, still, still)
    tips = ROBOT.fingertips(q)
    local = np.array([R.T @ (c - p) for R, c, p in zip(tips.R_WF, tip_W, tips.p_WF, strict=True)])
    f_W = np.array([R @ f for R, f in zip(tips.R_WF, f_F, strict=True)])
    for joint in range(28):
        step = np.zeros(28)
        step[joint] = 1e-6
        there, here = (ROBOT.fingertips(q + sign * step) for sign in (1, -1))
        moved = [
            (a.T @ c + p) - (b.T @ c + r)
            for a, c, p, b, r in zip(
                there.R_WF.transpose(0, 2, 1), local, there.p_WF, here.R_WF.transpose(0, 2, 1), here.p_WF, strict=True
            )
        ]
        torque[joint] += (f_W * np.array(moved)).sum() / 2e-6
    for follower, leader in COUPLED.items():
        torque[INDEX[leader]] += torque[INDEX[follower]]
    return torque[DRIVEN_INDEX]


def presses(tips_W: np.ndarray) -> np.ndarray:
    """Forces (5, 3) in F of 4 N along the normal and 1 N across."""
    n = np.array([R.T @ v for R, v in zip(TIPS.R_WF, normals(TIPS, tips_W), strict=True)])
    return 4.0 * n + [1.0, 0.0, 0.0]


TIP_W = pads(Q)
F_F = presses(TIP_W)
TAU = torques(Q, TIP_W, F_F)
SHARP = ForceFromTorque(ROBOT, gauge_floor=0.0, gauge_share=0.0, model_floor=1e-5)


def estimate(block: ForceFromTorque, tau: np.ndarray, q: np.ndarray = Q, tip_W: np.ndarray = TIP_W) -> np.ndarray:
    return block.update(block.init(), tau, q, np.zeros(28), ROBOT.fingertips(q), tip_W, DT)[1]


def test_certain_torques_give_the_forces_back() -> None:
    # central differences of 1e-6 rad leave 1e-9 N.m of some .3; the prior 1e-5 N.m
    np.testing.assert_allclose(estimate(SHARP, TAU), F_F, atol=2e-3)


def test_jacobians_hold_the_work_of_coupled_joints() -> None:
    J = contact_jacobians(TIPS, TIP_W)
    step = np.zeros(28)
    step[[INDEX["FFJ2"], INDEX["FFJ1"]]] = 1e-6
    moved = ROBOT.fingertips(Q + step)
    i = FINGERS.index("FF")
    there = moved.R_WF[i] @ TIPS.R_WF[i].T @ (TIP_W[i] - TIPS.p_WF[i]) + moved.p_WF[i]
    # one-sided difference: a curvature of .1 m times 1e-6
    np.testing.assert_allclose(J[i, :, 2], (there - TIP_W[i]) / 1e-6, atol=1e-6)
    assert (J[i, :, 3:] == 0.0).all()


def test_normals_point_out_of_ball_and_cylinder() -> None:
    on_ball = TIPS.p_WF + TIPS.rho[:, None] * TIPS.R_WF[:, :, 2]
    np.testing.assert_allclose(normals(TIPS, on_ball), TIPS.R_WF[:, :, 2], atol=1e-12)  # rounding
    on_side = TIPS.p_WF - 0.005 * TIPS.R_WF[:, :, 2] + TIPS.rho[:, None] * TIPS.R_WF[:, :, 1]
    np.testing.assert_allclose(normals(TIPS, on_side), TIPS.R_WF[:, :, 1], atol=1e-12)


def test_better_gauges_err_less() -> None:
    fine = StrainGauges()
    errors = []
    for scale in (1.0, 0.5, 0.25, 0.0):
        gauges = replace(
            fine, gain_error=0.2 * scale, offset=0.05 * scale, hysteresis=fine.hysteresis * scale,
            drift=fine.drift * scale, noise=fine.noise * scale, load_accuracy=fine.load_accuracy * scale,
        )  # fmt: skip
        floor, share = gauges.doubt()
        block = ForceFromTorque(ROBOT, gauge_floor=floor, gauge_share=share)
        found = []
        for seed in range(100):
            _, _, tau = gauges.update(gauges.init(np.random.default_rng(seed)), Still(tau=TAU))
            found.append(estimate(block, tau) - F_F)
        errors.append(np.sqrt(np.mean(np.square(found))))
    # errors in proportion to the gauges', less what the prior takes off the largest: factors a little below two; 100
    # draws of 15 components know a ratio to 4 %
    assert errors[0] > 1.5 * errors[1]
    assert errors[1] > 1.5 * errors[2]
    # the prior's share of a doubt of 5 mN.m over some 30 mm: (.2 N / 5 N)^2 of 1 N
    assert errors[3] < 0.005


def test_a_singular_posture_gives_a_finite_short_force() -> None:
    q = Q.copy()
    for finger in FINGERS:
        q[list(finger_joints(finger))] = 0.0
    for follower, leader in COUPLED.items():
        q[INDEX[follower]] = q[INDEX[leader]]
    tips = ROBOT.fingertips(q)
    ahead = tips.p_WF + tips.rho[:, None] * tips.R_WF[:, :, 2]
    levers = [np.linalg.svd(J, compute_uv=False)[2] for J in contact_jacobians(tips, ahead)]
    # straight fingers have no lever for a force along them, but for the offsets of their axes
    assert min(levers) < 1e-3
    block = ForceFromTorque(ROBOT)
    rng = np.random.default_rng(0)
    free = torques(q, ahead, np.zeros((5, 3)))
    for _ in range(20):
        f = estimate(block, free + 0.01 * rng.normal(size=24), q, ahead)
        assert np.isfinite(f).all()
        # 10 mN.m over a lever of 1 mm would be 10 N; the prior's size is 10 N, and levers at hand make up the rest
        assert np.linalg.norm(f, axis=1).max() < 10.0


def test_a_blind_gauge_is_held_for_a_moment_and_then_left_out() -> None:
    block = ForceFromTorque(ROBOT)
    state, whole = block.update(block.init(), TAU, Q, np.zeros(28), TIPS, TIP_W, DT)
    blind = TAU.copy()
    blind[[DRIVEN.index("THJ5"), DRIVEN.index("FFJ3")]] = np.nan
    found = []
    for _ in range(10):
        state, f = block.update(state, blind, Q, np.zeros(28), TIPS, TIP_W, DT)
        found.append(f)
    # as long as the last reading stands in, nothing changes
    np.testing.assert_allclose(found[3], whole, atol=1e-12)
    assert np.isfinite(found[-1]).all()
    thumb, first, others = FINGERS.index("TH"), FINGERS.index("FF"), [2, 3, 4]
    np.testing.assert_allclose(found[-1][others], whole[others], atol=1e-12)
    # four gauges of the thumb still tell its three components, the prior's part aside
    np.testing.assert_allclose(found[-1][thumb], F_F[thumb], atol=0.6)
    # two of the first finger do not, and what the prior adds is short
    assert np.linalg.norm(found[-1][first]) < np.linalg.norm(F_F[first]) + 1.0
    # a reading that returns counts at once
    state, f = block.update(state, TAU, Q, np.zeros(28), TIPS, TIP_W, DT)
    np.testing.assert_allclose(f, whole, atol=1e-12)


def test_no_gauge_at_all_reads_as_no_force() -> None:
    assert (estimate(ForceFromTorque(ROBOT), np.full(24, np.nan)) == 0.0).all()


def test_the_force_follows_within_its_low_pass() -> None:
    block = SHARP
    state, _ = block.update(block.init(), torques(Q, TIP_W, np.zeros((5, 3))), Q, np.zeros(28), TIPS, TIP_W, DT)
    shares = []
    for _ in range(6):
        state, f = block.update(state, TAU, Q, np.zeros(28), TIPS, TIP_W, DT)
        shares.append(float(np.linalg.norm(f) / np.linalg.norm(F_F)))
    # a first-order low-pass of 20 ms at 10 ms: 1 - (2/3)^k; the prior's cone bends it by some per cent
    assert shares == pytest.approx([1.0 - (2.0 / 3.0) ** k for k in range(1, 7)], abs=0.02)
