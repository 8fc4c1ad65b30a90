"""What sensors can get at in a plant: the physical quantities that they measure, each with its own errors."""

from __future__ import annotations

from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from turnscrew.geometry.arrays import Array

Image: TypeAlias = NDArray[np.uint8]
"""Grey (height, width) or RGB (height, width, 3), 8 bit."""


class Sensed(Protocol):
    """The plant, to its sensors."""

    @property
    def time(self) -> float:
        """Time [s]."""

    @property
    def q(self) -> Array:
        """(28,) joint angles [rad], for encoders."""

    def fingertip_forces(self) -> Array:
        """(5, 3) force of each fingertip on what it touches, in its frame F [N], for tactile fingertips."""

    def drive_torques(self) -> Array:
        """(24,) torque of each drive in the order of `turnscrew.robot.joints.DRIVEN` [N.m], for strain gauges."""

    def tool_pose(self) -> tuple[Array, Array]:
        """p_WT (3,) [m] and R_WT (3, 3), for a camera that is modelled by its error alone."""

    def picture(self, left: int, top: int, width: int, height: int) -> Image:
        """What a pinhole camera sees in a window of its image: (height, width, 3), RGB, for a camera with a lens."""
