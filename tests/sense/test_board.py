"""Board pose from corners that are known exactly, or off by noise that is known."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.views import COLLAR, pose_in_round, view

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import log_so3
from turnscrew.sense.board import BoardPose, _coarseness
from turnscrew.sense.fiducials import Sighting
from turnscrew.sense.lens import Calibration

pytest.importorskip("cv2")

NOISE = 0.06
SOLVER = BoardPose(COLLAR, Calibration(view()), NOISE)


def facing(p_WT: Array, R_WT: Array) -> list[int]:
    """Markers that are seen at less than 65 deg."""
    corners = COLLAR.corners @ R_WT.T + p_WT
    out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 0] - corners[:, 3])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    towards = view().p_WK - corners.mean(axis=1)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    return [int(row) for row in np.flatnonzero(np.sum(out * towards, axis=1) > np.cos(np.radians(65.0)))]


def sighting(p_WT: Array, R_WT: Array, rows: list[int], rng: np.random.Generator, noise: float) -> Sighting:
    corners = SOLVER.calibration.project((COLLAR.corners[rows] @ R_WT.T + p_WT).reshape(-1, 3)).reshape(-1, 4, 2)
    sigma = noise * _coarseness(corners)[:, None, None]
    return Sighting(np.array(rows), corners + sigma * rng.normal(size=corners.shape))


def errors(count: int, noise: float, seed: int = 0) -> tuple[Array, Array]:
    """Errors (n, 6) of position and orientation in W, and their covariances."""
    rng = np.random.default_rng(seed)
    off, P = [], []
    for _ in range(count):
        _, p_WT, R_WT = pose_in_round(rng)
        best = SOLVER.solve(sighting(p_WT, R_WT, facing(p_WT, R_WT), rng, noise))[0]
        off.append(np.concatenate([p_WT - best.p_WT, log_so3(R_WT @ best.R_WT.T)]))
        P.append(best.P)
    return np.array(off), np.array(P)


def test_exact_corners_give_the_exact_pose() -> None:
    off, _ = errors(20, 0.0)
    # straightening stops at a thousandth of a pixel, which moves the tip by some micrometres
    assert np.abs(off[:, :3]).max() < 3e-5
    assert np.abs(off[:, 3:]).max() < 3e-5


def test_errors_are_what_the_covariance_says() -> None:
    off, P = errors(300, NOISE)
    square = np.array([e @ np.linalg.solve(M, e) for e, M in zip(off, P, strict=True)])
    # chi squared of 6: the mean of 300 is 6 +- .2; P is never made smaller by a good fit, but larger by a bad one,
    # which lowers the mean by about a tenth
    assert 4.7 < square.mean() < 6.4


def test_a_marker_that_lies_is_left_out() -> None:
    rng = np.random.default_rng(3)
    _, p_WT, R_WT = pose_in_round(rng)
    rows = facing(p_WT, R_WT)
    seen = sighting(p_WT, R_WT, rows, rng, NOISE)
    seen.corners[1] += 5.0
    best = SOLVER.solve(seen)[0]
    assert best.markers == len(rows) - 1
    # four deviations of what is left
    assert np.all(np.abs(p_WT - best.p_WT) < 4 * np.sqrt(np.diag(best.P)[:3]))


def test_one_marker_alone_is_ambiguous_and_a_second_face_is_not() -> None:
    rng = np.random.default_rng(4)
    p_WT, R_WT = np.array([1.0, 0.0, 0.19]), np.eye(3)
    rows = facing(p_WT, R_WT)
    gaps = {}
    for name, some in (("one", rows[:1]), ("all", rows)):
        found = SOLVER.solve(sighting(p_WT, R_WT, some, rng, NOISE))
        gaps[name] = found[1].cost - found[0].cost if len(found) > 1 else np.inf
    # 25 is five deviations
    assert gaps["one"] < 25.0 < gaps["all"]


def test_markers_of_no_board_and_twins_are_passed_over() -> None:
    square = np.zeros((4, 4, 2))
    known = SOLVER.known(Sighting(np.array([3, 40, 5, 5]), square))
    assert known.ids.tolist() == [3]
