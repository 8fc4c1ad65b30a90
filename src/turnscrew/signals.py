"""What passes between the rooms of the loop: frozen messages, in SI units, named by monogram notation.

Joint vectors have n = 28 entries in the order of `turnscrew.robot.joints.JOINTS` (4 of the arm, 24 of the
hand).  Per-finger arrays have five rows in the order of `FINGERS`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from turnscrew.geometry.arrays import Array, Flags

TIP_LAG = 7
"""Ticks by which `Estimate.tip_sure` lags behind a loss: a frame and its latency."""


@dataclass(frozen=True, slots=True)
class Vision:
    """One camera frame's tool pose, as it arrives (late).

    Attributes:
        stamp: Time of exposure [s]; the frame arrives `latency` later.
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        P: (6, 6) covariance of the errors of p_WT [m], then of the orientation as a rotation vector in W [rad].
    """

    stamp: float
    p_WT: Array
    R_WT: Array
    P: Array


@dataclass(frozen=True, slots=True)
class Measurement:
    """All that the robot knows at a tick.

    Attributes:
        time: Time of the reading [s].
        q: (28,) encoder readings [rad]; of a robot that takes torques as its faster beats have smoothed them.
        v: (28,) joint speeds from the encoders [rad/s], likewise.
        f_F: (5, 3) force that each fingertip exerts on what it touches, in the fingertip's frame F [N]; None for a
            hand without sensors there.
        tau: (24,) torque of each drive as its strain gauge tells, in the order of `turnscrew.robot.joints.DRIVEN`
            [N.m]; None for a hand without gauges.
        vision: The camera frame that arrived since the last tick, if any.
        blind: Why the camera's newest frame gave no pose, in a few words; empty when it gave one.
        tau_sent: (24,) torques that the drives were sent, low-passed as the joints' speeds are [N.m]; None before the
            first, and for a robot that takes positions.
    """

    time: float
    q: Array
    v: Array
    f_F: Array | None
    tau: Array | None
    vision: Vision | None
    blind: str
    tau_sent: Array | None = None


@dataclass(frozen=True, slots=True)
class Estimate:
    """What the loop believes about tool, contacts and screw.

    Attributes:
        time: [s].
        q: (28,) joint angles with the learned encoder offsets removed [rad].
        v: (28,) joint speeds [rad/s].
        offset: (28,) encoder angles less joint angles, as learned [rad].
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        nu: (6,) velocity of T, linear first, expressed in T [m/s, rad/s].
        radius: Handle radius as learned [m].
        p_WS: (3,) bottom centre of the screw's drive in W, with the learned offset [m].
        theta: Angle by which the screw has been turned in, >= 0 when fastening [rad].
        touching: (5,) which fingertips touch.
        f_W: (5, 3) low-passed force of each fingertip on the tool, in W [N].
        c_W: (5, 3) contact points on the handle (closest points where a finger is free), in W [m].
        n_W: (5, 3) handle's outward unit normals there, in W.
        gap: (5,) distance between fingertip and handle [m].
        F_s: (6,) wrench of the screw on the tool, in T, force first [N, N.m].
        stiffness: k_s of the thread as identified [N.m/rad]; not a number where it is no spring.
        tip_slip: How strongly forces, motion and camera contradict a tip that stays where it is: 1 is the threshold.
        finger_slip: (5,) way that each fingertip has slid down the handle lately [m].
        grip: (5,) share of the friction counted with that each finger is trusted with: 1 until it has slid.
        hung: (5,) which fingers' force sensors hang and are done without.
        P: (6, 6) covariance of the errors of p_WT [m], then of the orientation as a rotation vector in W [rad].
        frame: What became of the camera's last frame: "taken", "refused" (an outlier), "late" or "none".
        status: What the pose refinement said of its last frame: "warm", "cold" (solved from the last or from a fresh
            start), "relaxed" (with wider boxes), "predicted" (not at all), "no contact", or "filter" where none is
            wanted.
        p_WT_seen: (3,) the camera's last tip position, carried to now by odometry, in W [m]; NaN before the first.
        R_WT_seen: (3, 3) the camera's last orientation, likewise.
        p_WT_refined: (3,) tip position of the refinement (1)-(6), likewise.
        R_WT_refined: (3, 3) orientation of the refinement, likewise.
        tip_out: How strongly the camera's frames contradict a tip in its drive: 1 is the threshold.
        tip_sure: Whether nothing speaks against a tip in its drive: neither frames nor its load nor a slip lately.
    """

    time: float
    q: Array
    v: Array
    offset: Array
    p_WT: Array
    R_WT: Array
    nu: Array
    radius: float
    p_WS: Array
    theta: float
    touching: Flags
    f_W: Array
    c_W: Array
    n_W: Array
    gap: Array
    F_s: Array
    stiffness: float
    tip_slip: float
    finger_slip: Array
    grip: Array
    hung: Flags
    P: Array
    frame: str
    status: str
    p_WT_seen: Array
    R_WT_seen: Array
    p_WT_refined: Array
    R_WT_refined: Array
    tip_out: float = 0.0
    tip_sure: bool = True


class Role(IntEnum):
    """What a finger does: move freely, feel for the handle, or carry the tool."""

    FREE = 0
    REACH = 1
    GRIP = 2


FREE, REACH, GRIP = int(Role.FREE), int(Role.REACH), int(Role.GRIP)
"""The roles as plain numbers, with which arrays are compared in a tenth of the time."""


@dataclass(frozen=True, slots=True)
class Goal:
    """What the loop wants of the tool and of each finger at a tick.

    Attributes:
        phase: Name of the task's phase.
        round: Rounds completed.
        vain: Rounds in a row, up to the last, that have not turned the screw and do not count.
        roles: (5,) a `Role` for each finger.
        share: (5,) weight of a gripping finger in carrying the tool, 0 to 1; ramps bring fingers in and out.
        squeeze: (5,) wanted normal force of a gripping finger [N].
        approach: (5, 3) velocity in W of a fingertip that feels for the handle [m/s].
        q_free: (28,) postures of the free fingers [rad].
        q_guide: (28,) postures that a gripping finger with joints to spare keeps near [rad].
        turn_rate: Wanted yaw rate of the tool [rad/s], negative when fastening.
        tip_force: Wanted force of the screw on the tip along z of T [N].
        V_palm: (6,) twist in W, linear first, at which the arm moves the palm [m/s, rad/s].
        action: What is being done about trouble, in a word; empty while the gait goes on by itself.
        recoveries: How often something has been done about trouble until now.
        tip_free: Whether the tip is taken to be out of its drive: the fingers then move the tool as `V_tool` says.
        V_tool: (6,) twist of the tool in W at the tip, linear first, while the tip is free [m/s, rad/s].
        theta: Angle at which the screw is taken to stand meanwhile [rad].
        tip_moves: Whether the tool may move in the fingers in ways that they do not tell, meanwhile.
        locked: Whether the fingers keep posture and squeeze meanwhile: what they give then tells what pushes the tip.
    """

    phase: str
    round: int
    vain: int
    roles: NDArray[np.int_]
    share: Array
    squeeze: Array
    approach: Array
    q_free: Array
    q_guide: Array
    turn_rate: float
    tip_force: float
    V_palm: Array
    action: str = ""
    recoveries: int = 0
    tip_free: bool = False
    V_tool: Array = field(default_factory=lambda: np.zeros(6))
    theta: float = 0.0
    tip_moves: bool = False
    locked: bool = False


@dataclass(frozen=True, slots=True)
class Effort:
    """What the contacts are to do.

    Attributes:
        nu_d: (6,) wanted velocity of T in T, linear first [m/s, rad/s]: for position commands the servo's acceleration,
            integrated.
        f_W: (5, 3) wanted force of each gripping fingertip on the tool, in W [N].
        F_hd: (6,) wanted wrench of the hand on the tool, in T, force first [N, N.m].
        alpha: (6,) the servo's acceleration of T in T, linear first [m/s2, rad/s2].
        lost: (6,) part of F_hd that the contact forces do not give, in T [N, N.m].
        margin: (5,) by how much each contact force is inside the cone of the friction counted with [N]; not a number
            where no finger grips, or where nobody has worked it out.
        limited: (24,) which drives' torques hold the contact forces back.
    """

    nu_d: Array
    f_W: Array
    F_hd: Array
    alpha: Array = field(default_factory=lambda: np.zeros(6))
    lost: Array = field(default_factory=lambda: np.zeros(6))
    margin: Array = field(default_factory=lambda: np.full(5, np.nan))
    limited: Flags = field(default_factory=lambda: np.zeros(24, dtype=bool))


@dataclass(frozen=True, slots=True)
class Command:
    """What this robot accepts: positions or torques, in the order of `turnscrew.robot.joints.DRIVEN`.

    Attributes:
        q: (24,) position commands in encoder angles [rad]; None for a robot that takes torques.
        saturated: (24,) which commands were held back, by a joint's range or a drive's torque.
        tau: (24,) torque commands [N.m]; None for a robot that takes positions.
        motion: (28,) by how much the joints should move until the next tick, loads as expected [rad]; None for a robot
            that takes torques, whose joints are read more often than that.
    """

    q: Array | None
    saturated: Flags
    tau: Array | None = None
    motion: Array | None = None


class FaultKind(StrEnum):
    """Expected trouble, as the supervisor names it."""

    TIP_SLIP = "TIP_SLIP"
    CAM_OUT = "CAM_OUT"
    FINGER_SLIP = "FINGER_SLIP"
    CONTACT_LOST = "CONTACT_LOST"
    TOOL_DROPPED = "TOOL_DROPPED"
    STALLED = "STALLED"
    JOINT_LIMIT = "JOINT_LIMIT"
    TORQUE_SATURATED = "TORQUE_SATURATED"
    VISION_LOST = "VISION_LOST"
    POSE_SUSPECT = "POSE_SUSPECT"
    FORCE_SUSPECT = "FORCE_SUSPECT"
    TIMEOUT = "TIMEOUT"
    DIVERGED = "DIVERGED"


@dataclass(frozen=True, slots=True)
class Fault:
    """Trouble with its evidence.

    Attributes:
        kind: Its name.
        time: When it was named [s].
        evidence: A sentence with the figure that was exceeded.
        ends: Whether the run cannot go on as it is; other trouble is named once, when it begins, and lived with.
        hopeless: Whether there is nothing that could be done about it.
    """

    kind: FaultKind
    time: float
    evidence: str
    ends: bool = True
    hopeless: bool = False
