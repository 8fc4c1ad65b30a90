from __future__ import annotations

import numpy as np
import pytest

from turnscrew.geometry.arrays import Array
from turnscrew.sense.edges import refined
from turnscrew.sense.photograph import Photograph

pytest.importorskip("cv2")

CORNERS = np.array([[20.3, 22.1], [55.7, 18.4], [58.2, 54.9], [23.6, 57.8]])
FINE = 8


def black_square(corners: Array) -> np.ndarray:
    """A black quadrilateral on white, each pixel the mean of FINE x FINE samples."""
    size = 80
    samples = (np.arange(size * FINE) + 0.5) / FINE - 0.5
    x, y = np.meshgrid(samples, samples)
    inside = np.ones_like(x, dtype=bool)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= (end[0] - start[0]) * (y - start[1]) - (end[1] - start[1]) * (x - start[0]) > 0
    light = np.where(inside, 20.0, 200.0)
    return np.rint(light.reshape(size, FINE, size, FINE).mean(axis=(1, 3))).astype(np.uint8)


@pytest.mark.parametrize("defocus", [0.5, 0.7, 1.2])
def test_blur_moves_no_corner(defocus: float) -> None:
    picture = Photograph(defocus=defocus, noise=0.0, well=1e9).taken(
        black_square(CORNERS), np.zeros(2), np.random.default_rng(0)
    )
    shrunk = CORNERS + 0.4 * (CORNERS.mean(axis=0) - CORNERS) / 20
    # bilinear sampling leaves a few hundredths, more on the sharpest edges
    np.testing.assert_allclose(refined(picture, shrunk[None])[0], CORNERS, atol=0.08)


def test_noise_moves_corners_by_little() -> None:
    rng = np.random.default_rng(1)
    off = []
    for _ in range(40):
        corners = CORNERS + rng.uniform(-0.5, 0.5, 2)
        picture = Photograph().taken(black_square(corners), np.zeros(2), rng)
        off.append(refined(picture, corners[None] + rng.normal(0.0, 0.3, (1, 4, 2)))[0] - corners)
    # what is promised of a corner, on a marker of this size, is .13 px with all that a scene adds
    assert np.sqrt(np.mean(np.square(off))) < 0.08
    # 160 corners know their mean to less than .01
    assert np.abs(np.mean(off, axis=(0, 1))).max() < 0.03


def test_no_corners_stay_none() -> None:
    assert refined(np.zeros((9, 9), np.uint8), np.zeros((0, 4, 2))).shape == (0, 4, 2)
