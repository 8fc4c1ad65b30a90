"""All that the estimation of tool, contacts and screw remembers between two ticks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from turnscrew.contact.carried import PalmPose
from turnscrew.estimate.contacts import TouchState
from turnscrew.estimate.correction import Correction
from turnscrew.estimate.driven_force import DrivenState
from turnscrew.estimate.filter_state import FilterState
from turnscrew.estimate.finger_force import FingerForceState
from turnscrew.estimate.free_tip import HELD, Free
from turnscrew.estimate.handle_contacts import HandleContacts
from turnscrew.estimate.hung_force import HungState
from turnscrew.estimate.joint_smoothing import JointState
from turnscrew.estimate.refine_step import Refined
from turnscrew.estimate.screw_angle import AngleState
from turnscrew.estimate.slips import SlipsState
from turnscrew.estimate.tip_out import OutState
from turnscrew.estimate.tip_wrench import WrenchState
from turnscrew.estimate.trail import Pose, Trail
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.profiles import Capsule
from turnscrew.signals import Measurement

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips


@dataclass(frozen=True, slots=True)
class EstimatorState:
    """All that the estimator remembers between ticks.

    Attributes:
        read: The last measurement, with numbers only.
        joints: Smoothed joints.
        filter: Tool, screw, radius and offsets.
        gauged: The gauges' last readings; None for a hand with sensors in its fingertips.
        driven: Of the forces from the torques that were sent; None for a robot that takes positions.
        f_F: (5, 3) force of each fingertip now, in its frame F, not low-passed [N].
        hung: Whether force sensors repeat themselves.
        touch: Touch flags and low-passed forces.
        tips: Fingertips at the last tick, with the present offsets removed.
        capsules: Their patches.
        contacts: Closest points there.
        trail: The last moments of odometry.
        since_correction: Time since the filter was last corrected [s].
        correction: What the last correction did, None before the first.
        correction_time: Processor time that it took [s].
        refined: The last refinement, None before the first.
        seen: The camera's last pose, carried along by odometry; NaN before the first.
        polished: III-A's last pose, likewise.
        status: What the refinement said of the last frame.
        omega_T: (3,) low-passed angular velocity of the tool, in T [rad/s].
        angle: The screw's angle.
        wrench: The tip wrench's filters.
        slips: Of the detectors of slips.
        out: Of the detector of a tip that has left its drive.
        start: Yaw of the tool when the run began, which the slot had, too [rad].
        free: Whether the tip is out.
        carrier: The palm at the last tick with the tip out.
        sure: The filter's states in the last ticks in which the tip was taken to be in its drive.
    """

    read: Measurement
    joints: JointState
    filter: FilterState
    gauged: FingerForceState | None
    driven: DrivenState | None
    f_F: Array
    hung: HungState
    touch: TouchState
    tips: Fingertips
    capsules: tuple[Capsule, ...]
    contacts: HandleContacts
    trail: Trail
    since_correction: float
    correction: Correction | None
    correction_time: float
    refined: Refined | None
    seen: Pose
    polished: Pose
    status: str
    omega_T: Array
    angle: AngleState
    wrench: WrenchState
    slips: SlipsState
    out: OutState
    start: float
    free: Free = HELD
    carrier: PalmPose | None = None
    sure: tuple[FilterState, ...] = ()
