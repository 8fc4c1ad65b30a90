"""From light on a sensor to an 8-bit picture: exposure, motion blur, defocus, photon and read-out noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.sense.opencv import opencv
from turnscrew.sense.sensed import Image

STEPS = 9
"""Moments of the exposure that motion blur is put together of: under a pixel apart for up to so many pixels."""


@dataclass(frozen=True, slots=True)
class Photograph:
    """What a sensor makes of a picture.

    Attributes:
        exposure: Gain on the light; 1 leaves it as it is, 2 burns out whatever is brighter than grey 127.
        shutter: Exposure time [s]; the picture is that of its middle.
        defocus: Standard deviation of the lens' blur [px].
        noise: Standard deviation of the read-out, in grey levels.
        well: Electrons at grey level 255; photons are counted with the deviation sqrt(n).
    """

    exposure: float = 1.0
    shutter: float = 0.008
    defocus: float = 0.7
    noise: float = 1.0
    well: float = 6000.0

    def taken(self, picture: Image, motion: Array, rng: Generator) -> Image:
        """The picture as it leaves the camera.

        Args:
            picture: Grey, of perfect light.
            motion: (2,) how far what matters moves in the picture during the exposure [px].
            rng: Source of noise.
        """
        light = picture.astype(np.float32)
        if self.exposure != 1.0:
            light *= np.float32(self.exposure)
        light = opencv().filter2D(light, -1, _blur(self.defocus, motion))
        np.maximum(light, 0.0, out=light)
        variance = light * np.float32(255.0 / self.well) + np.float32(self.noise**2)
        light += np.sqrt(variance) * rng.standard_normal(light.shape, np.float32)
        return np.asarray(np.rint(light).clip(0, 255), np.uint8)


def _blur(sigma: float, motion: Array) -> Array:
    """Kernel (2k+1, 2k+1) of a Gaussian that is drawn along a line."""
    reach = int(np.ceil(3.0 * sigma + np.abs(motion).max() / 2))
    grid = np.arange(-reach, reach + 1)
    # below a third of a pixel a Gaussian on whole pixels is a single one
    width = max(sigma, 0.3)
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1))
    for part in (np.arange(STEPS) + 0.5) / STEPS - 0.5:
        x, y = np.exp(-0.5 * ((grid[:, None] - part * motion) / width) ** 2).T
        kernel += np.outer(y, x)
    return np.asarray(kernel / kernel.sum())
