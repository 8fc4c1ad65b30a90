"""Square markers on a tool: where their corners are in the tool frame T."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.errors import ModelError
from turnscrew.geometry.arrays import Array

INK = 5e-5
"""Thickness of a printed marker above what carries it [m]: a label's; a renderer has to tell ink from carrier."""


@dataclass(frozen=True)
class Collar:
    """A hexagonal prism around the axis, with markers one above the other on each of its faces.

    Attributes:
        across: Distance between opposite faces [m].
        bottom: Height of its lower end above the tip [m].
        top: Height of its upper end [m].
        side: Side of a marker, black border included [m].
        rows: Markers on each face.
    """

    across: float = 0.026
    bottom: float = 0.040
    top: float = 0.070
    side: float = 0.012
    rows: int = 2

    @property
    def ids(self) -> tuple[int, ...]:
        """Identities of the markers, in the order of `corners`."""
        return tuple(range(6 * self.rows))

    @property
    def corners(self) -> Array:
        """(n, 4, 3) corners in T: upper left, upper right, lower right, lower left, seen from outside [m]."""
        pitch = (self.top - self.bottom) / self.rows
        heights = [self.bottom + pitch * (row + 0.5) for row in range(self.rows)]
        return _around(6, self.across / 2 + INK, heights, self.side)


@dataclass(frozen=True)
class Plates:
    """Small plates around the handle, tangent to it, one marker on each.

    Attributes:
        radius: Of the handle [m].
        height: Of the plates' middles above the tip [m].
        side: Side of a marker [m].
        count: Of plates, evenly spaced.
        thickness: Of a plate [m].

    Paper: Fig. 5 shows such plates on the handle, without figures.
    """

    radius: float
    height: float
    side: float = 0.010
    count: int = 6
    thickness: float = 0.001

    @property
    def width(self) -> float:
        """Side of a plate: a marker's and a white margin of one of its six cells all round [m]."""
        return self.side * 4 / 3

    @property
    def ids(self) -> tuple[int, ...]:
        """Identities of the markers, in the order of `corners`."""
        return tuple(range(self.count))

    @property
    def corners(self) -> Array:
        """(n, 4, 3) corners in T, as a collar's [m]."""
        return _around(self.count, self.radius + self.thickness + INK, [self.height], self.side)


MarkerBoard = Collar | Plates
"""Forms that carry markers: `ids` and `corners` tell which and where."""

CLEAR = 0.005
"""Gap between a collar and the handle above it [m]: a thumb that reaches down finds the handle's rim free."""

BENCH = 0.015
"""A collar stays this far above the tip [m]: a screw's head and what stands around it are below."""


def collar_below(handle_start: float, across: float = 0.026) -> Collar:
    """A collar on the shaft, under the handle, where no finger holds.

    Args:
        handle_start: Height of the handle's lower end above the tip [m].
        across: Distance between opposite faces [m]; a marker takes 4/5 of a face's width.

    Raises:
        ModelError: Handle and tip are too close for it.
    """
    face = across / np.sqrt(3.0)
    collar = Collar(across, handle_start - CLEAR - 2.0 * face, handle_start - CLEAR, 0.8 * face)
    if collar.bottom < BENCH:
        raise ModelError(
            f"a marker collar of {1e3 * across:g} mm needs {1e3 * (2.0 * face + CLEAR + BENCH):.0f} mm of shaft below "
            f"the handle, which begins {1e3 * handle_start:g} mm above the tip: choose plates, or a smaller collar"
        )
    return collar


def _around(count: int, distance: float, heights: list[float], side: float) -> Array:
    """Corners (n, 4, 3) of squares on `count` faces at a distance from the axis, the first one facing along x."""
    half = side / 2
    corners = []
    for angle in 2 * np.pi / count * np.arange(count):
        out, along = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
        for height in heights:
            middle = distance * out + [0.0, 0.0, height]
            # seen from outside with z up, the tangent in the sense of growing angle points to the right
            square = [(-half, half), (half, half), (half, -half), (-half, -half)]
            corners.append([middle + x * along + [0.0, 0.0, z] for x, z in square])
    return np.array(corners)
