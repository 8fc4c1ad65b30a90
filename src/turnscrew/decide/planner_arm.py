"""Where the arm puts the palm for a planned round: the tool upright over a screw in front of the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.decide.plan import Handle
from turnscrew.decide.planner_round import Unknowns, axis
from turnscrew.errors import PlanError
from turnscrew.geometry.arrays import Array
from turnscrew.robot.inverse_kinematics import Reach, place_palm
from turnscrew.robot.joints import ARM, JOINTS, WRIST
from turnscrew.robot.model import RobotModel

DISTANCES = np.linspace(0.75, 1.0, 6)
"""Distances of the screw in front of the arm's base that are tried [m]: folded to stretched."""

HEADINGS = np.linspace(-0.4, 0.4, 5)
"""Directions of the fingers, seen from above, that are tried [rad]; 0 is straight away from the base."""

SCREW_HEIGHT = 0.19
"""Height of the screw above the arm's base [m]: the work stands on a low bench."""

LEAST_MARGIN = 0.08
"""Distance of arm and wrist from their limits [rad]: the arm re-centres by up to 20 mm, 0.05 rad of the wrist."""


ELBOW_UP = np.array([0.0, 1.1, 0.0, 0.9, 0.0, 0.0])
"""Start of the inverse kinematics for arm and wrist [rad]; other starts may end with the elbow near the bench."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Where the robot stands over the screw.

    Attributes:
        arm: (6,) WAMJ1..J4, WRJ2, WRJ1 [rad].
        p_WS: (3,) the screw's drive in W [m].
        margin: Smallest distance of these joints from their limits [rad].
    """

    arm: Array
    p_WS: Array
    margin: float


def stand(robot: RobotModel, handle: Handle, unknowns: Unknowns, rng: np.random.Generator) -> Stand:
    """The posture of arm and wrist, and the screw's place, with the largest joint margin.

    Args:
        robot: Kinematics and joint ranges.
        handle: What is held.
        unknowns: Of the planned round.
        rng: Draws starts of the inverse kinematics.

    Raises:
        PlanError: The arm cannot hold the palm so that the tool stands upright.
    """
    u = np.array(axis(unknowns["u"], np.sqrt))
    count = len(ARM) + len(WRIST)
    low, high = robot.limits[:count].T
    best: Stand | None = None
    for distance in DISTANCES:
        p_WS = np.array([distance, 0.0, SCREW_HEIGHT])
        for heading in HEADINGS:
            R_WH = _palm(u, float(heading))
            p_WH = p_WS + np.array([0.0, 0.0, handle.middle]) - R_WH @ unknowns["c"]
            q = np.concatenate([ELBOW_UP, np.zeros(len(JOINTS) - count)])
            found = place_palm(robot, p_WH, R_WH, q, rng, margin=LEAST_MARGIN, starts=1)
            if found.status is Reach.SOLVED:
                arm = found.q[:count]
                margin = float(np.minimum(arm - low, high - arm).min())
                if arm[3] > 0.0 and (best is None or margin > best.margin):
                    best = Stand(arm, p_WS, margin)
    if best is None:
        raise PlanError(f"the arm cannot hold a handle of radius {handle.radius * 1e3:.1f} mm upright in this grip")
    return best


def _palm(u: Array, heading: float) -> Array:
    """R_WH that stands the axis u upright and points the palm's z, seen from above, along the heading."""
    forward = np.array([0.0, 0.0, 1.0]) - u[2] * u
    forward /= np.sqrt(forward @ forward)
    left = np.cross(u, forward)
    R_HU = np.stack([forward, left, u], axis=1)
    cosine, sine = np.cos(heading), np.sin(heading)
    R_WU = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(R_WU @ R_HU.T)
