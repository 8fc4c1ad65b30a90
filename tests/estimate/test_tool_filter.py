from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.estimation import HANDLE, P_WS, ROBOT, contact, gait

from turnscrew.estimate.filter_state import OFFSET_COLUMNS, OFFSET_JOINTS, OFFSETS, RADIUS, SIZE, FilterState, Prior
from turnscrew.estimate.tool_filter import Rows, ToolFilter, stacked
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.robot.joints import INDEX

FOUR = next(t for t in gait(1) if t.phase == "four" and np.all(np.linalg.norm(t.f_F[:4], axis=1) > 4.9))


def exact(q: np.ndarray) -> FilterState:
    """The state that knows all, about true joint angles q."""
    return FilterState(P_WS, FOUR.R_WT, np.zeros(3), 0.0, np.zeros(17), np.eye(SIZE) * 1e-6)


def rows_at(state: FilterState, reading: np.ndarray) -> Rows:
    tips = ROBOT.fingertips(reading - state.joint_offset())
    points = [contact(tips, i, state.p_WT, state.R_WT) for i in range(4)]
    return ToolFilter().contact_rows(state, points, list(tips.p_WF[:4]), list(tips.J[:4]))


def test_joints_with_offset_states_are_those_of_the_four_gripping_fingers() -> None:
    assert len(OFFSET_JOINTS) == 17
    assert {name[:2] for name in OFFSET_JOINTS} == {"TH", "FF", "MF", "RF"}


@pytest.mark.parametrize("index", range(SIZE))
def test_rows_are_the_derivatives_of_the_innovations(index: int) -> None:
    f, state, step = ToolFilter(), exact(FOUR.q), 1e-5
    seen_p, seen_R = P_WS + 0.002, exp_so3(np.array([0.01, -0.02, 0.03])) @ FOUR.R_WT

    def z(signed: float) -> np.ndarray:
        error = np.zeros(SIZE)
        error[index] = signed
        moved = state.corrected(error, state.P)
        rows = stacked(f.vision_rows(moved, seen_p, seen_R), f.tip_rows(moved, P_WS), rows_at(moved, FOUR.q))
        return rows.z

    H = stacked(f.vision_rows(state, seen_p, seen_R), f.tip_rows(state, P_WS), rows_at(state, FOUR.q)).H
    numeric = -(z(step) - z(-step)) / (2 * step)
    # rotation rows are the derivative at a small innovation: log's Jacobian differs from one by half of .037 rad;
    # elsewhere central differences leave curvature (1/.025 m) x step^2, far below
    tolerance = 0.02 if index < 3 else 1e-5
    np.testing.assert_allclose(H[:, index], numeric, atol=tolerance * max(1.0, np.abs(numeric).max()))
    if index < 3:
        np.testing.assert_allclose(H[6:, index], numeric[6:], atol=1e-5)


def test_covariance_is_honest_over_many_robots() -> None:
    """Normalised error squared of all 27 states, over robots drawn from the prior and a second of four contacts."""
    f, prior, rng = ToolFilter(), Prior(coupling=None), np.random.default_rng(5)
    f = replace(f, tip_drift=0.0, tilt_drift=0.0, yaw_drift=0.0, constants_drift=0.0, offset_drift=0.0)
    nees = []
    for _ in range(40):
        offset = np.zeros(28)
        offset[OFFSET_COLUMNS] = rng.normal(0.0, prior.offset, 17)
        b, dr = rng.normal(size=3) * prior.screw, rng.normal() * prior.radius
        reading, said, handle = FOUR.q + offset, P_WS - b, replace(HANDLE, radius=HANDLE.radius - dr)
        start = exp_so3(rng.normal(0.0, prior.rotation, 3)) @ FOUR.R_WT
        state = prior.state(P_WS + rng.normal(0.0, prior.tip, 3), start, reading)
        for _ in range(30):
            state = f.predict(state, np.zeros(3), np.zeros(3), np.zeros(3), True, 1 / 30)
            p = P_WS + rng.normal(0.0, f.vision_position, 3)
            R = exp_so3(rng.normal(0.0, f.vision_rotation, 3)) @ FOUR.R_WT
            tip = f.tip_rows(state, said)
            tip = replace(tip, z=tip.z + rng.normal(0.0, f.tip, 3))
            state, _ = f.update(state, stacked(f.vision_rows(state, p, R), tip))
            tips = ROBOT.fingertips(reading - state.joint_offset())
            points = [contact(tips, i, state.p_WT, state.R_WT, handle) for i in range(4)]
            rows = f.contact_rows(state, points, list(tips.p_WF[:4]), list(tips.J[:4]))
            # the rig's fingertips sink in by .08 mm, which is not what is tested here
            state, _ = f.update(state, replace(rows, z=rows.z - 8e-5 + rng.normal(0.0, f.contact, 4)))
        x = np.zeros(SIZE)
        x[:3], x[3:6], x[6:9] = log_so3(FOUR.R_WT @ state.R_WT.T), P_WS - state.p_WT, b - state.b_W
        x[RADIUS], x[OFFSETS] = dr - state.radius_error, offset[OFFSET_COLUMNS] - state.offset
        nees.append(x @ np.linalg.solve(state.P, x))
    # chi-squared of 27: the mean of 40 has deviation sqrt(2 x 27 / 40) = 1.2; four of these, and on the upper side
    # two more for what linearising at offsets of three sigmas costs
    assert 27 - 4.7 < np.mean(nees) < 27 + 7


def test_outlier_is_left_out_and_told() -> None:
    f, state = ToolFilter(), exact(FOUR.q)
    rows = f.vision_rows(state, P_WS + np.array([0.1, 0.0, 0.0]), FOUR.R_WT)
    after, verdict = f.update(state, rows)
    assert verdict.accepted == (False, True)
    assert verdict.nis[0] > 31.8
    np.testing.assert_allclose(after.p_WT, P_WS, atol=1e-12)
    none, verdict = f.update(state, f.tip_rows(state, P_WS + 0.1))
    assert verdict.accepted == (False,)
    assert none is state


def test_coupled_joints_show_the_difference_of_their_offsets() -> None:
    reading = FOUR.q.copy()
    reading[INDEX["MFJ1"]] += 0.01
    reading[INDEX["MFJ2"]] -= 0.01
    state = Prior().state(P_WS, FOUR.R_WT, reading)
    offset = state.joint_offset()
    # prior .01 rad each: the difference is .02 with 4 % left to the prior (.0035^2 / (2 x .01^2 + .0035^2) = 6 %)
    np.testing.assert_allclose(offset[INDEX["MFJ1"]] - offset[INDEX["MFJ2"]], 0.02, rtol=0.07)
    # the sum stays unknown
    np.testing.assert_allclose(offset[INDEX["MFJ1"]] + offset[INDEX["MFJ2"]], 0.0, atol=1e-12)
    assert np.all(Prior(coupling=None).state(P_WS, FOUR.R_WT, reading).offset == 0.0)


def test_prediction_turns_errors_along_and_spreads_them() -> None:
    f, state = ToolFilter(), exact(FOUR.q)
    P = state.P.copy()
    P[0, 0] = 1e-4
    state = replace(state, P=P)
    quarter = np.array([0.0, 0.0, np.pi / 2])
    after = f.predict(state, quarter, np.array([0, 0, -1e-4]), np.zeros(3), True, 0.005)
    # the large error about x is about y after a quarter turn; drift adds (.1 deg)^2 x 5 ms = 1.5e-8
    np.testing.assert_allclose((after.P[0, 0], after.P[1, 1]), (1e-6, 1e-4), atol=5e-8)
    np.testing.assert_allclose(after.p_WT, P_WS + np.array([0, 0, -1e-4]), atol=1e-15)
    np.testing.assert_allclose(after.R_WT, exp_so3(quarter) @ FOUR.R_WT, atol=1e-15)
    free = f.predict(state, np.zeros(3), np.zeros(3), np.zeros(3), False, 0.005)
    held = f.predict(state, np.zeros(3), np.zeros(3), np.zeros(3), True, 0.005)
    assert np.all(np.diag(free.P)[:3] > np.diag(held.P)[:3])
