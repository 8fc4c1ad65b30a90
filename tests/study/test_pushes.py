"""Pushes: level, on the handle, as long and as strong as they say, and the same for every robot."""

from __future__ import annotations

import numpy as np
import pytest
from rigs.cells import cell

from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.disturbances.pushes import FORCE, LENGTH, Push, Pushes


def pushed(seed: int, until: float = 9.0, **changes: object) -> tuple[Pushes, np.ndarray, np.ndarray]:
    """What acts on the tool at each millisecond (n, 6), and its centre of mass (n, 3); the plant stands still."""
    plant = cell()
    pushes = Pushes(plant, np.random.default_rng(seed), **changes)
    tool, forces = plant.model.body("tool").id, []
    for time in np.arange(0.0, until, 0.001):
        plant.data.time = time
        pushes.step()
        forces.append(plant.data.xfrc_applied[tool].copy())
    return pushes, np.array(forces), plant.data.xipos[tool] - plant.data.xpos[tool]


def test_push_is_level_and_lasts() -> None:
    push = Push(2.0, 0.7, 0.1)
    assert np.linalg.norm(push.force(2.05)) == pytest.approx(FORCE)
    assert push.force(2.05)[2] == 0.0
    assert not push.force(1.999).any()
    assert not push.force(2.0 + LENGTH).any()


def test_handle_is_pushed_where_and_when_it_is_told() -> None:
    pushes, applied, centre = pushed(3)
    # a first push within 3 s, then one every 2 to 4 s
    assert 2 <= len(pushes.made) <= 4
    # within a millisecond's rounding at either end
    assert (np.linalg.norm(applied[:, :3], axis=1) > 0.0).sum() == pytest.approx(100 * len(pushes.made), abs=8)
    for push in pushes.made:
        assert 0.075 <= push.height <= 0.175
        row = applied[round(1000 * (push.start + 0.05))]
        arm = np.array([0.0, 0.0, push.height]) - centre
        np.testing.assert_allclose(row[3:], np.cross(arm, row[:3]), atol=1e-12)
    starts = np.array([push.start for push in pushes.made])
    assert starts[0] >= 1.0
    assert ((np.diff(starts) >= 2.0) & (np.diff(starts) <= 4.0)).all()


def test_pushes_depend_on_the_generator_alone() -> None:
    one, other = (pushed(5, until, span=Span(0.0, np.inf))[0].made for until in (4.0, 9.0))
    assert one == other[: len(one)]
    assert pushed(6)[0].made != pushed(5)[0].made


def test_no_push_begins_outside_its_span() -> None:
    pushes, applied, _ = pushed(5, span=Span(0.0, 0.0))
    assert not pushes.made
    assert not applied.any()
