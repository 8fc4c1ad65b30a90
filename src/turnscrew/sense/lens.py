"""A real lens: how it bends pictures, in OpenCV's model of distortion, and how pixels are straightened again.

With `x = x_K / z_K`, `y = y_K / z_K`, `r^2 = x^2 + y^2`, a point appears at `u = c + f (x'', y'')`,

    x'' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),

y'' likewise; the coefficients come in OpenCV's order k1, k2, p1, p2, k3, k4, k5, k6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.pinhole import KINECT, CameraPose, Pinhole, Window, window_around
from turnscrew.sense.opencv import opencv
from turnscrew.sense.sensed import Image

COUNTS = (0, 4, 5, 8, 12, 14)
"""How many coefficients OpenCV's models have: none, Brown's, with k3, rational, with thin prism, tilted."""

KINECT_DISTORTION = (0.08, -0.05, 0.0003, -0.0002)
"""Of the lens as built: a wide lens with little distortion, some ten pixels halfway to the image's side (assumed)."""

NODE = 16
"""Pixels between the nodes at which bending is worked out, lines between: the curvature of k1 = .1 over so many pixels
is below a hundredth of a pixel."""

CLOSE, ROUNDS = 1e-3, 50
"""Straightening stops at an error of a thousandth of a pixel, or where no straight pixel is bent there at all."""


@dataclass(frozen=True)
class Calibration:
    """All that has to be known of a camera to turn pixels into a pose in W.

    Attributes:
        pose: Where it stands.
        pinhole: Camera matrix and size of the image.
        distortion: Coefficients in OpenCV's order: 0, 4, 5, 8, 12 or 14 of them.
    """

    pose: CameraPose
    pinhole: Pinhole = KINECT
    distortion: tuple[float, ...] = KINECT_DISTORTION

    def straightened(self, pixels: Array) -> Array:
        """Pixels (n, 2) that a pinhole camera without distortion would have in place of these pixels (n, 2)."""
        if not any(self.distortion) or not len(pixels):
            return np.array(pixels, float).reshape(-1, 2)
        wanted = np.array(pixels, float).reshape(-1, 2)
        straight = wanted.copy()
        for _ in range(ROUNDS):
            # bending is small against the field of view, so what it is off by is nearly what the pixel is off by
            off = wanted - self._bend(straight)
            straight += off
            if np.abs(off).max() < CLOSE:
                break
        return straight

    def project(self, p_W: Array) -> Array:
        """Pixels (n, 2) at which points (n, 3) of W in front of the camera appear."""
        straight = self.pinhole.project(self.pose.seen(p_W))
        return self._bend(straight) if any(self.distortion) else straight

    def needed(self, window: Window) -> Window:
        """The pinhole camera's window out of which `bent` makes the lens' window."""
        if not any(self.distortion):
            return window
        return window_around(self._nodes(window).reshape(-1, 2), 1.0)

    def bent(self, picture: Image, window: Window) -> Image:
        """What the lens shows in a window.

        Args:
            picture: Grey, the pinhole camera's picture of `needed(window)`.
            window: Of the lens' image.
        """
        if not any(self.distortion):
            return picture
        cv2 = opencv()
        nodes = self._nodes(window)
        source = window_around(nodes.reshape(-1, 2), 1.0)
        rows, columns = nodes.shape[:2]
        maps = cv2.resize(
            (nodes - [source.left, source.top]).astype(np.float32),
            (NODE * columns, NODE * rows),
            interpolation=cv2.INTER_LINEAR,
        )[NODE : NODE + window.height, NODE : NODE + window.width]
        # OpenCV's cubic interpolation would shift edges by up to .05 px, the linear one by none
        out: Image = cv2.remap(picture, maps, None, cv2.INTER_LINEAR)
        return out

    def _bend(self, straight: Array) -> Array:
        """Pixels (n, 2) at which what a pinhole camera has in other pixels (n, 2) appears."""
        rays = np.column_stack([self.pinhole.normalised(straight), np.ones(len(straight))])
        still, K = np.zeros(3), self.pinhole.matrix
        pixels, _ = opencv().projectPoints(rays.reshape(-1, 1, 3), still, still, K, np.array(self.distortion))
        return np.asarray(pixels.reshape(-1, 2), float)

    def _nodes(self, window: Window) -> Array:
        """Straightened pixels (rows, columns, 2) of a grid that `resize` by NODE lays on the window's pixels."""
        columns, rows = -(-window.width // NODE) + 2, -(-window.height // NODE) + 2
        x = window.left + NODE * (np.arange(columns) - 0.5) - 0.5
        y = window.top + NODE * (np.arange(rows) - 0.5) - 0.5
        grid = np.stack(np.meshgrid(x, y), axis=-1)
        return self.straightened(grid.reshape(-1, 2)).reshape(rows, columns, 2)
