from __future__ import annotations

import numpy as np
import pytest

from turnscrew.sense.photograph import Photograph

pytest.importorskip("cv2")

STILL = np.zeros(2)


def test_flat_light_keeps_its_mean_and_gets_the_noise_of_photons_and_read_out() -> None:
    taken = Photograph(noise=2.0, well=6000.0).taken(
        np.full((400, 400), 100, np.uint8), STILL, np.random.default_rng(0)
    )
    # 160,000 pixels know the mean to .01, the deviation to .2 %; rounding to whole levels adds 1/12
    assert taken.mean() == pytest.approx(100.0, abs=0.05)
    assert taken.std() == pytest.approx(np.sqrt(2.0**2 + 100 * 255 / 6000 + 1 / 12), rel=0.01)


def test_exposure_scales_light_and_burns_out() -> None:
    picture = np.tile(np.array([50, 200], np.uint8), (50, 25)).repeat(20, axis=1)
    taken = Photograph(exposure=2.0, noise=0.0, well=1e9).taken(picture, STILL, np.random.default_rng(0))
    assert taken[:, 10].mean() == pytest.approx(100.0, abs=0.6)
    assert (taken[:, 30] == 255).all()


@pytest.mark.parametrize("motion", [(0.0, 0.0), (4.0, 0.0), (3.0, -4.0)])
def test_a_point_is_spread_by_defocus_and_motion_and_stays_in_place(motion: tuple[float, float]) -> None:
    picture = np.zeros((61, 61), np.uint8)
    picture[30, 30] = 255
    blur = Photograph(exposure=200.0, defocus=1.0, noise=0.0, well=1e9)
    # the gain makes the spread point's tails count; a plain camera would round them away
    taken = blur.taken((picture // 40).astype(np.uint8), np.array(motion), np.random.default_rng(0)).astype(float)
    y, x = np.mgrid[:61, :61] - 30
    weight = taken / taken.sum()
    # centred to a twentieth of a pixel; a line of length L has the variance L^2 / 12, in nine steps (1 - 1/81) of it
    assert abs((weight * x).sum()) < 0.05
    assert abs((weight * y).sum()) < 0.05
    for grid, length in ((x, motion[0]), (y, motion[1])):
        assert (weight * grid**2).sum() == pytest.approx(1.0 + length**2 / 12 * (80 / 81), rel=0.05)
