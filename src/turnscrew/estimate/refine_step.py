"""III-A within the loop: states one frame's problem from the filter's knowledge and solves it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from turnscrew.estimate.filter_state import FilterState
from turnscrew.estimate.handle_contacts import HandleContacts
from turnscrew.estimate.pose_problem import PoseFrame, pose_problem
from turnscrew.estimate.pose_refine import Guess, PoseRefiner, RefinedPose
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import ETA, XI, U, V
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.rotations import quaternion_from_matrix
from turnscrew.geometry.surfaces import SurfaceOfRevolution

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


@dataclass(frozen=True, slots=True)
class Refined:
    """The last refinement and which fingers it held.

    Attributes:
        rows: Rows of the fingers in contact.
        pose: The answer.
    """

    rows: tuple[int, ...]
    pose: RefinedPose


def refine(
    refiner: PoseRefiner,
    handle: SurfaceOfRevolution,
    tip: Capsule,
    filtered: FilterState,
    p_WS: Array,
    R_seen: Array,
    tips: Fingertips,
    contacts: HandleContacts,
    rows: tuple[int, ...],
    last: Refined | None,
) -> Refined:
    """Refine one frame.

    The previous contact (xi-, eta-) of (5) moves by up to 3.6 deg between frames, so it is predicted: the closest
    point at the filter's pose, which the rolling odometry has carried along.

    Args:
        refiner: Tolerances and ladder.
        handle: Patch of the handle as said.
        tip: Patch that stands for all fingertips.
        filtered: The filter's state: start, fall-back, radius error.
        p_WS: (3,) the drive's bottom centre with the learned offset, in W [m].
        R_seen: (3, 3) orientation to stay close to.
        tips: Fingertips with the learned encoder offsets removed.
        contacts: Closest points at the filter's pose.
        rows: Fingers in contact, one or more.
        last: The last refinement, for a warm start when it held the same fingers.
    """
    which = list(rows)
    points = contacts.table[which]
    xi, uv = points[:, [XI, ETA]], points[:, [U, V]]
    frame = PoseFrame(
        p_WS=p_WS,
        r_bar=quaternion_from_matrix(R_seen),
        p_WF=tips.p_WF[which],
        R_WF=tips.R_WF[which],
        tip_radius=tips.rho[which],
        radius_error=filtered.radius_error,
        xi=xi,
    )
    warm = last.pose.multipliers if last is not None and last.rows == rows else None
    guess = Guess(filtered.p_WT, filtered.R_WT, xi, uv, warm)
    return Refined(rows, refiner.solve(pose_problem(handle, tip, len(which)), frame, guess))
