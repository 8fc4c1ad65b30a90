"""Gaps between convex bodies: closed forms, and a search without any cleverness."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.decide.plan_geometry import Body, box, capsule, cylinder, nearest_point, rim_lines, separations

# golden section to 30 nm along the axis; gaps near the minimum are flatter than that
EXACT = 1e-9


def gap(one: Body, other: Body) -> float:
    return float(separations([one], [other])[0][0])


def rod(start: list[float], end: list[float], radius: float = 0.01) -> Body:
    return capsule("rod", np.array(start), np.array(end), radius)


def brick(half: list[float]) -> Body:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    return box("brick", corners)


def post(radius: float, half: float) -> Body:
    return cylinder("post", np.array([0.0, 0.0, -half]), np.array([0.0, 0.0, half]), radius)


def test_crossing_capsules() -> None:
    assert gap(rod([-1, 0, 0], [1, 0, 0]), rod([0, -1, 0.05], [0, 1, 0.05])) == pytest.approx(0.03, abs=EXACT)


def test_parallel_capsules() -> None:
    assert gap(rod([0, 0, 0], [1, 0, 0]), rod([0, 0.04, 0], [1, 0.04, 0])) == pytest.approx(0.02, abs=EXACT)


def test_capsules_end_to_end() -> None:
    assert gap(rod([0, 0, 0], [1, 0, 0]), rod([1.1, 0, 0], [2, 0, 0])) == pytest.approx(0.08, abs=1e-7)


def test_capsule_over_a_box_edge() -> None:
    one = rod([0.3, 0.2, -1], [0.3, 0.2, 1])
    # nearest to the box's edge at (0.2, 0.1)
    assert gap(one, brick([0.2, 0.1, 0.5])) == pytest.approx(np.hypot(0.1, 0.1) - 0.01, abs=EXACT)


def test_capsule_beside_and_above_a_cylinder() -> None:
    assert gap(rod([0.1, -1, 0], [0.1, 1, 0]), post(0.03, 0.05)) == pytest.approx(0.06, abs=EXACT)
    assert gap(rod([0, -1, 0.08], [0, 1, 0.08]), post(0.03, 0.05)) == pytest.approx(0.02, abs=EXACT)


def test_capsule_off_a_cylinders_rim() -> None:
    one = rod([0.06, 0, 0.09], [0.06, 0, 0.2])
    assert gap(one, post(0.03, 0.05)) == pytest.approx(0.05 - 0.01, abs=1e-7)


def test_overlap_is_negative() -> None:
    assert gap(rod([0.02, -1, 0], [0.02, 1, 0]), post(0.03, 0.05)) == pytest.approx(-0.02, abs=EXACT)


@pytest.mark.parametrize("seed", range(20))
def test_no_pair_of_sampled_points_is_nearer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one = capsule("one", rng.normal(size=3), rng.normal(size=3), 0.0)
    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.3, 0.2, 0.1]
    for other in (
        capsule("other", rng.normal(size=3), rng.normal(size=3), 0.0),
        box("other", corners @ turned.T + rng.normal(size=3)),
        cylinder("other", rng.normal(size=3), rng.normal(size=3), 0.2),
    ):
        found, points, nearest = (value[0] for value in separations([one], [other]))
        along = one.half[2] * one.axes[2]
        line = one.centre + np.linspace(-1, 1, 400)[:, None] * along
        distances = np.array([np.linalg.norm(point - nearest_point(point, other)) for point in line])
        # the found gap is the least, to the sampling of the line
        assert found <= distances.min() + 1e-9
        if found > 0.0:
            assert found == pytest.approx(distances.min(), abs=1e-2)
            assert found == pytest.approx(np.linalg.norm(points - nearest), abs=1e-9)


def test_rim_lines_lie_on_the_cylinder() -> None:
    body = post(0.03, 0.05)
    for line in rim_lines(body):
        assert np.hypot(*line.centre[:2]) == pytest.approx(0.03, abs=1e-15)
        assert line.half[2] == pytest.approx(0.05, abs=1e-15)
