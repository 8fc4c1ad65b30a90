"""The solver's quadratic program against its optimality conditions and against daqp, on the models of real solves."""

from __future__ import annotations

from typing import Any

import daqp
import numpy as np
import pytest
from oracles.test_pose_refinement import grasp, shifted
from oracles.test_pose_solvers import CYLINDER, solved

from turnscrew.estimate import pose_walk
from turnscrew.estimate.pose_model import CLOSE, ENDLESS, LIMIT, OVERFLOWN, PAID, SOLVED, step_model
from turnscrew.estimate.pose_sqp import SqpSolver


class Model:
    """A model as the solver asked it: arguments, and what it began with."""

    def __init__(self, H: Any, slope: Any, J: Any, low: Any, high: Any, before: Any) -> None:
        self.H, self.slope, self.J = H.copy(), slope.copy(), J.copy()
        self.low, self.high, self.before = low, high, before.copy()

    def solved(self, prices: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Step, prices and end, from any prices."""
        d, prices = np.empty(len(self.H)), prices.copy()
        return d, prices, step_model(self.H, self.slope, self.J, self.low, self.high, 200, d, prices)


def asked(monkeypatch: pytest.MonkeyPatch, k: int, *, apart: float = 0.0) -> list[Model]:
    """The models of a few solves."""
    models: list[Model] = []

    def heard(H: Any, slope: Any, J: Any, low: Any, high: Any, changes: int, d: Any, prices: Any) -> int:
        models.append(Model(H, slope, J, low, high, prices))
        return step_model(H, slope, J, low, high, changes, d, prices)

    monkeypatch.setattr(pose_walk, "step_model", heard)
    for seed in range(4):
        case = grasp(CYLINDER, k, 40 + seed, noise=np.deg2rad(3.0))
        solved(SqpSolver(), shifted(case, apart), CYLINDER, seed)
    return models


@pytest.mark.parametrize("k", [1, 2, 4])
@pytest.mark.parametrize("apart", [0.0, 0.02])
def test_optimality_conditions_hold_from_any_prices(k: int, apart: float, monkeypatch: pytest.MonkeyPatch) -> None:
    ends = set()
    for model in asked(monkeypatch, k, apart=apart):
        n = len(model.H)
        for before in (np.zeros(len(model.low)), model.before):
            d, prices, end = model.solved(before)
            ends.add(end)
            slope = np.zeros(n)
            slope[3:6] = model.slope
            gradient = model.H @ d + slope + prices[:n] + model.J.T @ prices[n:]
            # rounding of levers of 14 units times the largest price
            assert np.abs(gradient).max() < 1e-10 * max(1.0, np.abs(prices).max())
            values = np.concatenate([d, model.J @ d])
            above, below = values - model.high, model.low - values
            held = np.abs(prices) > 0.0
            paid = np.abs(prices) >= LIMIT
            paid[:n] = False
            # ten times what is let be, for the rounding of normals whose length is 1 / sqrt(3e-5)
            assert max(above[~paid].max(), below[~paid].max()) < 10.0 * CLOSE
            assert np.abs(np.where(prices > 0.0, above, below)[held & ~paid]).max(initial=0.0) < 10.0 * CLOSE
            assert np.where(prices > 0.0, above, below)[paid].min(initial=0.0) > -10.0 * CLOSE
            assert (end == PAID) == paid.any()
    assert (PAID if apart else SOLVED) in ends


@pytest.mark.parametrize("k", [2, 3])
def test_steps_are_daqps(k: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for model in asked(monkeypatch, k):
        n = len(model.H)
        slope = np.zeros(n)
        slope[3:6] = model.slope
        low, high = np.maximum(model.low, -1e30), np.minimum(model.high, 1e30)
        theirs, _, flag, _ = daqp.solve(model.H, slope, model.J, high, low, np.zeros(len(low), np.int32))
        d, _, end = model.solved(model.before)
        # without soft rows daqp has no answer where ours pays
        assert (flag == 1) == (end == SOLVED)
        if flag == 1:
            # daqp's own tolerance of rows, 1e-6, over the least curvature's share in them
            np.testing.assert_allclose(d, theirs, atol=1e-5)


def test_a_model_that_cannot_be_solved_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    model = asked(monkeypatch, 2)[0]
    nothing = np.zeros(len(model.low))
    d, prices = np.empty(len(model.H)), nothing.copy()
    assert step_model(model.H, model.slope, model.J, model.low, model.high, 1, d, prices) == ENDLESS
    model.J[0, 3] = np.inf
    assert model.solved(nothing)[2] == OVERFLOWN
