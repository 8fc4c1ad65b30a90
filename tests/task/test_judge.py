"""What the judge measures: sliding over the handle, and errors of the forces that count."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from turnscrew.geometry.rotations import exp_so3
from turnscrew.plant.truth import Truth
from turnscrew.task.judge import Judge, force_errors, slipped
from turnscrew.task.loop import Tick

DT = 0.01
R_WT = exp_so3(np.array([0.2, -0.1, 0.7]))
P_WT = np.array([0.4, 0.1, 0.2])
RADIUS, HEIGHT = 0.018, 0.125
AROUND = np.linspace(0.0, 4.0, 5)
NORMALS = np.stack([np.cos(AROUND), np.sin(AROUND), np.zeros(5)], axis=1) @ R_WT.T
C_W = P_WT + RADIUS * NORMALS + HEIGHT * R_WT[:, 2]
P_WF = C_W + 0.007 * NORMALS
V_WT = np.array([0.01, -0.02, 0.03, 0.4, -0.3, 0.8])
ALL = np.ones(5, dtype=bool)


def rolling() -> np.ndarray:
    """Fingertips (5, 6) that move with the tool at their contacts, each with a rotation of its own."""
    omega = np.random.default_rng(0).normal(size=(5, 3))
    carried = V_WT[:3] + np.cross(V_WT[3:], C_W - P_WT)
    return np.concatenate([carried - np.cross(omega, C_W - P_WF), omega], axis=1)


def judged(V_WF: np.ndarray, touching: np.ndarray = ALL, before: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    slip = np.zeros((5, 3)) if before is None else before
    return slipped(slip, touching, C_W, P_WT, R_WT, V_WT, P_WF, V_WF, DT)


def test_fingers_that_roll_do_not_slip() -> None:
    after, farthest = judged(rolling())
    # speeds of some .1 m/s cancel to rounding
    np.testing.assert_allclose(after, 0.0, atol=1e-16)
    assert farthest < 1e-16


def test_a_dent_is_no_slip_and_a_slide_is_as_long_as_it_is_fast() -> None:
    V_WF = rolling()
    V_WF[:, :3] += 0.05 * NORMALS
    assert judged(V_WF)[1] < 1e-16
    V_WF[2, :3] += 0.03 * R_WT[:, 2]
    after, farthest = judged(V_WF)
    assert farthest == pytest.approx(0.03 * DT)
    assert np.delete(np.linalg.norm(after, axis=1), 2).max() < 1e-16
    assert judged(V_WF, before=after)[1] == pytest.approx(0.06 * DT)


def test_what_has_let_go_begins_anew() -> None:
    before = np.full((5, 3), 0.001)
    touching = np.array([True, False, True, True, True])
    after, _ = judged(rolling(), touching, before)
    np.testing.assert_array_equal(after[1], 0.0)
    np.testing.assert_allclose(after[touching], before[touching], atol=1e-16)


def test_forces_err_by_size_and_by_angle_where_they_count() -> None:
    true = np.array([[4.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 0.3], [2.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    read = np.array([[0.0, 5.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [9.0, 0.0, 0.0], [0.0, 5.0, 5.0]])
    size, angle = force_errors(read, true, np.array([True, True, True, False, True]))
    np.testing.assert_allclose(size, [1.0, -1.0, 1.7, np.nan, np.sqrt(50.0) - 5.0], rtol=1e-12)
    # a third of a newton has no direction worth judging
    np.testing.assert_allclose(angle, [np.pi / 2, 0.0, np.nan, np.nan, np.pi / 4], rtol=1e-12, atol=1e-12)


class CountsRounds(Judge):
    """One that measures nothing else."""

    def _watch_fingers(self, truth: Truth) -> None:
        pass

    def _watch_errors(self, truth: Truth, tick: Tick) -> None:
        pass


def seen(judge: Judge, theta: float, made: int, *, held: bool = True, inside: bool = True, free: bool = False) -> None:
    """A tick in which the handle is turned."""
    truth = SimpleNamespace(
        R_WT=np.eye(3), p_WT=np.zeros(3), p_WS=np.zeros(3), theta=theta, tip_in_drive=inside,
        touching=np.array([held, True, False, False, False]),
    )  # fmt: skip
    judge.watch(truth, SimpleNamespace(goal=SimpleNamespace(turn_rate=-1.0, round=made, tip_free=free)))


def test_a_round_counts_if_the_screw_has_turned_with_the_tip_in_its_drive_and_two_fingers_on_the_handle() -> None:
    for held, inside, turned, counts in ((1, 1, 0.5, 1), (0, 1, 0.5, 0), (1, 0, 0.5, 0), (1, 1, 0.3, 0)):
        judge = CountsRounds(DT)
        seen(judge, 0.0, 0, held=bool(held), inside=bool(inside))
        seen(judge, turned, 1)
        assert judge.rounds == counts


def test_what_knocked_the_tip_out_spoils_one_round_only() -> None:
    judge = CountsRounds(DT)
    seen(judge, 0.3, 0, held=False, inside=False)
    seen(judge, 0.3, 0, free=True)
    # back in, and a round from there
    seen(judge, 0.0, 0)
    seen(judge, 0.5, 1)
    assert judge.rounds == 1
    assert judge.support_fraction == 0.75
