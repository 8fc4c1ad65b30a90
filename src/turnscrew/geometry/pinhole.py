"""The pinhole camera, in OpenCV's conventions: K looks along z, x right, y down; pixel centres are whole numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from turnscrew.errors import CameraError
from turnscrew.geometry.arrays import Array


class Window(NamedTuple):
    """A rectangle of an image: pixels `left ... left + width - 1` and `top ... top + height - 1`."""

    left: int
    top: int
    width: int
    height: int

    def within(self, width: int, height: int) -> Window:
        """The part of it that lies in an image of this size; its sides may be 0."""
        left, top = min(max(self.left, 0), width), min(max(self.top, 0), height)
        right = min(max(self.left + self.width, left), width)
        bottom = min(max(self.top + self.height, top), height)
        return Window(left, top, right - left, bottom - top)

    def grown(self, margin: int) -> Window:
        """The window with a margin on all sides [px]."""
        return Window(self.left - margin, self.top - margin, self.width + 2 * margin, self.height + 2 * margin)


def window_around(pixels: Array, margin: float) -> Window:
    """Smallest window that holds all pixels (n, 2) and a margin around them [px]."""
    low = np.floor(np.min(pixels, axis=0) - margin).astype(int).tolist()
    high = np.ceil(np.max(pixels, axis=0) + margin).astype(int).tolist()
    return Window(low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1)


@dataclass(frozen=True, slots=True)
class Pinhole:
    """Intrinsics of a camera without distortion: `u = c + f (x / z, y / z)`.

    Attributes:
        f: Focal lengths along x and y [px].
        c: Principal point [px].
        size: Width and height of the image [px].
    """

    f: tuple[float, float]
    c: tuple[float, float]
    size: tuple[int, int]

    @property
    def matrix(self) -> Array:
        """Camera matrix (3, 3) [px]."""
        return np.array([[self.f[0], 0.0, self.c[0]], [0.0, self.f[1], self.c[1]], [0.0, 0.0, 1.0]])

    @property
    def image(self) -> Window:
        """The whole image."""
        return Window(0, 0, *self.size)

    def project(self, p_K: Array) -> Array:
        """Pixels (n, 2) of points p_K (n, 3) in front of the camera [m]."""
        return np.asarray(p_K[:, :2] / p_K[:, 2:] * self.f + self.c)

    def normalised(self, pixels: Array) -> Array:
        """Directions (n, 2), x / z and y / z, of pixels (n, 2)."""
        return np.asarray((pixels - self.c) / self.f)


@dataclass(frozen=True, slots=True)
class CameraPose:
    """Where a camera stands.

    Attributes:
        p_WK: (3,) its centre in W [m].
        R_WK: (3, 3) its orientation.
    """

    p_WK: Array
    R_WK: Array

    def seen(self, p_W: Array) -> Array:
        """Points (n, 3) of W in the camera's frame K [m]."""
        return np.asarray((p_W - self.p_WK) @ self.R_WK)


KINECT = Pinhole((1920.0, 1920.0), (1919.5, 1079.5), (3840, 2160))
"""The colour camera of the Azure Kinect: 90 x 59 deg in 3840 x 2160 px (Microsoft's hardware specification)."""


def looking_at(p_W: Array, distance: float, azimuth: float, elevation: float) -> CameraPose:
    """A camera that looks at a point, its image upright.

    Args:
        p_W: (3,) the point in the image's middle, in W [m].
        distance: To that point [m].
        azimuth: Direction of view about z of W, from x [rad].
        elevation: Direction of view above the horizon; negative looks down, at most a right angle away [rad].

    Raises:
        CameraError: It would look straight up or down, where no side of the image is up.
    """
    level = np.cos(elevation)
    if level < 1e-6:
        raise CameraError(f"a camera cannot look straight up or down: elevation {elevation:g} rad")
    z = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    x = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    y = np.array([z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]])
    return CameraPose(p_W - distance * z, np.column_stack([x, y, z]))
