"""Plants that stand still, for their sensors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.geometry.arrays import Array


@dataclass(frozen=True)
class Still:
    """A plant at one moment: what `turnscrew.sense.sensed.Sensed` asks for."""

    time: float = 0.0
    q: Array = field(default_factory=lambda: np.zeros(28))
    f_F: Array = field(default_factory=lambda: np.zeros((5, 3)))
    p_WT: Array = field(default_factory=lambda: np.zeros(3))
    R_WT: Array = field(default_factory=lambda: np.eye(3))
    tau: Array = field(default_factory=lambda: np.zeros(24))

    def fingertip_forces(self) -> Array:
        return self.f_F

    def drive_torques(self) -> Array:
        return self.tau

    def tool_pose(self) -> tuple[Array, Array]:
        return self.p_WT, self.R_WT
