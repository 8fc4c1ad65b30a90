"""What a gait plan must keep to, for the planner that seeks it and the check that judges it.

Sources: found by trial unless said otherwise, in simulated gaits under calibration, encoder and vision errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Near(StrEnum):
    """What is near to what."""

    TOOL = "a link and the tool"
    OWN = "a touching finger's own link and the tool"
    HAND = "two links of the hand"


@dataclass(frozen=True, slots=True)
class Requirements:
    """Bounds on one round of the gait.

    Attributes:
        joint_margin: Distance of every driven joint from its limits [rad]: at a lever of 40 mm it lets a position
            servo push 4 mm past the planned place: 2 mm to press with 4 N, 2 mm for a handle that stands elsewhere.
            With .05 rad and handles of 10 and 12 mm, FF or RF failed to reach the handle in 8 of 20 runs.
        tool_clearance: Gap between the tool and all links but the touching fingertips [m].  The handle is known to
            a few mm before it is felt, and to a fraction of that while it is held.  The planner adds what it can.
        own_clearance: Gap between the tool and the other links of a finger that touches it [m]: what is unknown of
            the tool's place moves them together, so only their own angles count.
        finger_clearance: Gap between links of two fingers [m]; side by side, straight fingers have 2.4 mm.  Around
            thin handles they are crowded, and a touch of two fingers is no harm.
        opposition: Largest cosine between the normals at TH and MF: -0.985 is 10 deg from opposite; what is
            missing to opposite pushes the tool sideways.
        hold_opposition: The same for FF and RF, which carry no torque.
        level: Largest difference in height of the contacts of TH and MF [m]: it times the squeeze tilts the tool.
        hold_level: The same for FF and RF; 4 N make a moment of 0.02 N.m, 0.2 N on a tip 0.13 m below.
        rolling_side: Largest n.z of TH and MF, n the handle's outward normal at the contact and z the fingertip's
            axis: below 0 the half ball touches, at 0 the contact would jump along the capsule.
        holding_side: The same for FF and RF.
        rolling_lever: Least distance of MF's tip from its knuckle along the palm's z [m]: close to its own axis, the
            sideways joint cannot push.
        holding_lever: The same for FF and RF: that joint is all they squeeze with.
        lift: Least distance of a lifted TH or MF from the handle's surface, along the contact's normal [m].
        retreat: The same for FF and RF.
        cleared: Share of `lift` and `retreat` that the whole fingertip is away from the handle: when it tilts, its
            root stays nearer than its tip.
        thumb_bend: Least flexion of the thumb's last joint while it rolls [rad]: a straight thumb cannot follow
            a handle that stands farther away than planned; with .9 rad it reaches in all of 200 draws of the
            calibration error, with .7 in 98 %, with .4 in 73 % (radius 12 and 15 mm).
        edge: Least distance of a contact from the handle's ends [m].
        sideways: Largest sine by which the tool's axis may lean to the side of the palm, what wrist and arm can make up
            for.
        down: The same for fingers that point down.
        load: Squeeze of TH and MF that their drives must be able to give at every posture of the roll, with the share
            `load_friction` of it across the normal, to turn the handle and to press it down [N]; 0: not asked for.
        load_friction: See `load`.
        load_thrust: What each of the two presses the handle down with [N]: half of 5 N on the tip, less the weight.
        load_share: Share of a drive's torque that may be used for it; the rest moves the finger.
    """

    joint_margin: float = 0.11
    tool_clearance: float = 0.002
    own_clearance: float = 0.001
    finger_clearance: float = 0.0005
    opposition: float = -0.985
    hold_opposition: float = -0.985
    level: float = 0.003
    hold_level: float = 0.005
    rolling_side: float = -0.08
    holding_side: float = -0.02
    rolling_lever: float = 0.020
    holding_lever: float = 0.030
    lift: float = 0.008
    retreat: float = 0.005
    cleared: float = 0.8
    thumb_bend: float = 0.8
    edge: float = 0.009
    sideways: float = 0.3
    down: float = 0.5
    load: float = 0.0
    load_friction: float = 0.8
    load_thrust: float = 2.1
    load_share: float = 0.8

    def clearance(self, near: Near) -> float:
        """Least gap of a kind [m]."""
        return {Near.TOOL: self.tool_clearance, Near.OWN: self.own_clearance, Near.HAND: self.finger_clearance}[near]


REQUIRED = Requirements()

STROKE = Requirements(joint_margin=0.05, thumb_bend=0.4, sideways=0.6, down=0.45, load=10.0)
"""For one stroke of two fingers.  Nobody has to reach for the handle: .05 rad are 2 mm at a lever of 40.  10 N with .8
of friction 1 turn a handle of 12.5 mm by .19 N.m."""
