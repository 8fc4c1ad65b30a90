"""Corners of markers as crossings of their edges: each edge a line through places of steepest brightness.

OpenCV's refinements follow a threshold, so the blur of a picture moves their corners into or out of the marker by a
quarter of a pixel, all four alike; at .65 m that is a board two millimetres farther away.  Where brightness grows
fastest across an edge, a symmetric blur moves nothing.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.sense.opencv import opencv
from turnscrew.sense.sensed import Image

ALONG = (np.arange(10) + 0.5) / 10 * 0.8 + 0.1
"""Where along an edge brightness is looked at, as fractions; corners are left out, where two edges blur into one."""

ACROSS = np.linspace(-1.0, 1.0, 17)
"""Where across the edge, as fractions of the reach."""

REACH, CELLS = 2.0, 0.06
"""Reach across the edge [px], at most so much of the marker's height there: a third of a cell, less than the margin."""

PASSES = 2
"""Each pass centres the reach on the edge that the one before found."""

FAINT = 0.3
"""Slopes below this share of a profile's steepest are noise."""


def refined(image: Image, corners: Array) -> Array:
    """Corners (m, 4, 2) in a grey picture, from corners that are off by a pixel at most [px]."""
    if not len(corners):
        return corners
    grey = image.astype(np.float32)
    for _ in range(PASSES):
        corners = _once(grey, corners)
    return corners


def _once(grey: np.ndarray, corners: Array) -> Array:
    start, end = corners, np.roll(corners, -1, axis=1)
    side = end - start
    length = np.maximum(np.linalg.norm(side, axis=2), 1e-6)
    # corners go clockwise in the picture (y down), so this normal points out of the marker
    out = np.stack([side[..., 1], -side[..., 0]], axis=-1) / length[..., None]
    middles = (start + end) / 2
    height = np.abs(np.sum((middles - np.roll(middles, 2, axis=1)) * out, axis=2))
    reach = np.minimum(REACH, CELLS * height)
    points = start[:, :, None] + ALONG[None, None, :, None] * side[:, :, None]
    places = points[..., None, :] + (reach[..., None] * ACROSS)[:, :, None, :, None] * out[:, :, None, None, :]
    off = reach[..., None] * _steepest(grey, places)
    # a line through the places found: offset a + b t at the fraction t of the edge
    t = ALONG - ALONG.mean()
    a, b = off.mean(axis=2), off @ t / (t @ t)
    first = start + (a - b * ALONG.mean())[..., None] * out
    last = end + (a + b * (1.0 - ALONG.mean()))[..., None] * out
    return _crossings(first, last)


def _steepest(grey: np.ndarray, places: Array) -> Array:
    """Mean of the profile's slopes (m, 4, n), in fractions of the reach."""
    cv2 = opencv()
    maps = places.reshape(-1, len(ACROSS), 2).astype(np.float32)
    values = cv2.remap(grey, maps, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    slopes = np.diff(values, axis=1)
    slopes = np.maximum(slopes - FAINT * slopes.max(axis=1, keepdims=True), 0.0)
    centres = (ACROSS[1:] + ACROSS[:-1]) / 2
    return np.asarray((slopes @ centres / np.maximum(slopes.sum(axis=1), 1e-9)).reshape(places.shape[:3]), float)


def _crossings(first: Array, last: Array) -> Array:
    """Corner k (m, 4, 2) where the line of edge k - 1 meets that of edge k."""
    before, direction = np.roll(first, 1, axis=1), np.roll(last - first, 1, axis=1)
    here = last - first
    gap = first - before
    area = direction[..., 0] * here[..., 1] - direction[..., 1] * here[..., 0]
    share = (gap[..., 0] * here[..., 1] - gap[..., 1] * here[..., 0]) / np.where(np.abs(area) < 1e-9, 1e-9, area)
    return np.asarray(before + share[..., None] * direction)
