"""What III-A goes by, and what is said of the frames that it gets."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from turnscrew.estimate.pose_refine import Refinement
from turnscrew.estimate.trail import Pose

NO_CONTACT = "no contact"
"""Status while no frame has been refined, or the last had no fingertip in contact: III-A has nothing to work with."""

FILTERED = "filter"
"""Status where no III-A is wanted: the filter's pose is handed on as it is."""

NO_DATA = Pose(np.full(3, np.nan), np.full((3, 3), np.nan))


SOLVED = (Refinement.WARM.value, Refinement.COLD.value)
"""Statuses of a frame solved within the boxes of (1)-(5)."""


class Reference(StrEnum):
    """Which orientation is rbar of (6): the filter's, which has heard all frames, or the camera's, as in the paper."""

    FILTER = "filter"
    CAMERA = "camera"
