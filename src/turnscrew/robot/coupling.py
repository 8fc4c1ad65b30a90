"""From 28 joints to the 24 that are driven: J1 follows J2 in every finger but the thumb.

With `q = S q_d`, S the constant selection below, speeds go by S, torques by its transpose, and the mass matrix of the
driven joints is `S^T M S`.
"""

from __future__ import annotations

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import COUPLED, DRIVEN, INDEX, JOINTS

DRIVEN_INDEX = np.array([INDEX[name] for name in DRIVEN])
"""(24,) rows of the driven joints in a joint vector."""

SELECTION: Array = np.array([[float(COUPLED.get(joint, joint) == name) for name in DRIVEN] for joint in JOINTS])
"""S (28, 24): which driven joint each joint follows."""

DRIVE = {name: index for index, name in enumerate(DRIVEN)}
"""Places of the driven joints among the drives."""

DRIVE_OF_JOINT = SELECTION.argmax(axis=1)
"""(28,) place of the drive that moves each joint."""
