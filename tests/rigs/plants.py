"""Plants that stand still, for their sensors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.sense.sensed import Image

DARK = np.zeros((2160, 3840, 3), np.uint8)


@dataclass(frozen=True)
class Still:
    """A plant at one moment: what `turnscrew.sense.sensed.Sensed` asks for."""

    time: float = 0.0
    q: Array = field(default_factory=lambda: np.zeros(28))
    f_F: Array = field(default_factory=lambda: np.zeros((5, 3)))
    p_WT: Array = field(default_factory=lambda: np.zeros(3))
    R_WT: Array = field(default_factory=lambda: np.eye(3))
    tau: Array = field(default_factory=lambda: np.zeros(24))
    image: Image = field(default_factory=lambda: DARK)

    def fingertip_forces(self) -> Array:
        return self.f_F

    def drive_torques(self) -> Array:
        return self.tau

    def tool_pose(self) -> tuple[Array, Array]:
        return self.p_WT, self.R_WT

    def picture(self, left: int, top: int, width: int, height: int) -> Image:
        """A window of the image; its rim goes on where the window reaches beyond."""
        rows, columns = np.arange(top, top + height), np.arange(left, left + width)
        return np.take(np.take(self.image, rows, axis=0, mode="clip"), columns, axis=1, mode="clip")
