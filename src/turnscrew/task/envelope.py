"""What the grasps of a gait plan can give: the largest steady torque at each angle of the stroke, and what binds it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from turnscrew.contact.envelope import Drive, Drives, Hold, Steady, Verdict, largest_torque
from turnscrew.contact.grasp import grasp_matrix
from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.decide.gait import Gait
from turnscrew.decide.plan import ROLLING, SUPPORTING, GaitPlan
from turnscrew.errors import ScenarioError
from turnscrew.estimate.handle_contacts import HandleContacts, capsules_of, handle_contacts
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import exp_so3
from turnscrew.robot.contact_jacobian import contact_jacobian
from turnscrew.robot.coupling import SELECTION
from turnscrew.robot.joints import DRIVEN, FINGERS
from turnscrew.robot.model import Fingertips, RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.start import plan_of
from turnscrew.task.wiring import believed_inertia

MOST = 12.0
"""Largest squeeze of a finger that torque control asks for [N]: Shadow's fingertips stand 5-8 N for long, this for a
moment."""

SIDE = 3.0
"""Largest side force of the drive on the tip along x and y of T each [N].  Walls and closed ends of a slot give more.
Grasps ask for half a newton to one, without which two hard contacts, never quite opposed and level, give next to
nothing; they gain nothing from more."""

DULL = 0.01
"""Share of the torque's growth with all limits below which a limit is not named."""


class Grip(StrEnum):
    """The grasps of a round."""

    ROLLING = "TH+MF"
    HOLDING = "FF+RF"
    ALL = "all four"

    @property
    def fingers(self) -> tuple[str, ...]:
        """Which fingers hold, in the order of `FINGERS`."""
        held = {Grip.ROLLING: ROLLING, Grip.HOLDING: SUPPORTING}.get(self, (*ROLLING, *SUPPORTING))
        return tuple(finger for finger in FINGERS if finger in held)


@dataclass(frozen=True, slots=True)
class Conditions:
    """What the grasps work under.

    Attributes:
        friction: Of a fingertip on the handle.
        most: Largest squeeze of a finger [N].
        drive: What the screw's drive supplies to the tip.
        tool: Mass and centre of mass.
    """

    friction: float
    most: float
    drive: Drive
    tool: ToolInertia


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit that binds.

    Attributes:
        name: A drive's, as "MFJ2"; or "TH friction", "MF squeeze", "tip side force", "tip lean".
        share: Of the torque's growth if all limits grew together, 0 to 1.
    """

    name: str
    share: float


@dataclass(frozen=True, slots=True)
class Moment:
    """A grasp at one angle of the stroke.

    Attributes:
        grip: Which grasp.
        angle: By which the handle has been turned since the roll's start [rad].
        steady: What it can give.
        limits: What binds, the strongest first.
    """

    grip: Grip
    angle: float
    steady: Steady
    limits: tuple[Limit, ...]


@dataclass(frozen=True, slots=True)
class Envelope:
    """What the grasps of a handle's plan can give.

    Attributes:
        radius: Of the handle [m].
        friction: Of fingertips on it.
        most: Largest squeeze of a finger [N].
        stroke: Angle of the plan's roll [rad].
        moments: Every grasp at every angle.
    """

    radius: float
    friction: float
    most: float
    stroke: float
    moments: tuple[Moment, ...]

    def of(self, grip: Grip) -> tuple[Moment, ...]:
        """One grasp over the stroke."""
        return tuple(moment for moment in self.moments if moment.grip is grip)

    def weakest(self, grip: Grip) -> Moment:
        """Where in the stroke a grasp gives least: so much it gives throughout."""
        return min(self.of(grip), key=lambda moment: moment.steady.torque)


def envelope(
    scenario: Scenario, most: float = MOST, angles: int = 13, on_planning: Callable[[str], None] | None = None
) -> Envelope:
    """The envelope of a scenario's handle.

    Args:
        scenario: Tool and friction.
        most: Largest squeeze of a finger [N].
        angles: How many of the stroke, its ends among them.
        on_planning: Told in a line what the planner is doing, if there is anything to plan.

    Raises:
        ScenarioError: the squeeze is no force.
        PlanError: no gait fits the handle.
    """
    under = conditions(scenario, most)
    plan = plan_of(scenario, on_planning)
    moments = tuple(walk(plan, RobotModel(), under, np.linspace(0.0, 1.0, angles).tolist()))
    return Envelope(plan.radius, under.friction, most, plan.stroke, moments)


def conditions(scenario: Scenario, most: float = MOST) -> Conditions:
    """Conditions of a scenario.

    The tip stands on its edge: the screw's thrust acts somewhere within the edge's width and the blade's thickness,
    and so far its torque about x and y of T goes.

    Args:
        scenario: Tool, friction.
        most: Largest squeeze of a finger [N].

    Raises:
        ScenarioError: the squeeze is no force.
    """
    if not 0.0 < most < np.inf:
        raise ScenarioError(f"largest squeeze {most:g}: must be a force above 0 N")
    tool = scenario.tool
    thrust = Gait.tip_force
    lean = thrust * np.array([tool.blade_thickness, tool.blade_width]) / 2.0
    friction = scenario.contact.finger_friction
    return Conditions(friction, most, Drive(thrust, SIDE, lean), believed_inertia(scenario, tool.handle.radius))


def walk(plan: GaitPlan, robot: RobotModel, under: Conditions, fractions: Sequence[float]) -> Iterator[Moment]:
    """All grasps at fractions (0 to 1) of the stroke; FF and RF hold where the plan has them at any of them."""
    for grip in Grip:
        for fraction in fractions:
            yield at(plan, robot, under, grip, fraction)


def at(plan: GaitPlan, robot: RobotModel, under: Conditions, grip: Grip, fraction: float) -> Moment:
    """One grasp at a fraction of the stroke."""
    q = plan.adding(1.0, rolled=fraction)
    angle = fraction * plan.stroke
    R_WT = plan.R_WT @ exp_so3(np.array([0.0, 0.0, -angle]))
    touch = touching(plan, robot, q, R_WT)
    steady = largest_torque(hold_of(robot, q, plan.p_WS, R_WT, touch.c_W, touch.n_W, under, grip.fingers))
    return Moment(grip, angle, steady, binding(steady, grip.fingers))


def touching(plan: GaitPlan, robot: RobotModel, q: Array, R_WT: Array) -> HandleContacts:
    """Closest points of fingertips and handle, the tool upright in the screw as planned."""
    tips = robot.fingertips(q)
    return handle_contacts(*handle_of(plan, tips), tips, plan.p_WS, R_WT)


def handle_of(plan: GaitPlan, tips: Fingertips) -> tuple[Cylinder, float, tuple[Capsule, ...]]:
    """The surfaces that meet: the plan's handle, no error of its radius, the fingertips."""
    handle = plan.handle
    low, high = handle.middle - handle.length / 2, handle.middle + handle.length / 2
    return Cylinder(handle.radius, low, high), 0.0, capsules_of(tips)


def hold_of(
    robot: RobotModel, q: Array, p_WT: Array, R_WT: Array, c_W: Array, n_W: Array, under: Conditions,
    fingers: Sequence[str],
) -> Hold:  # fmt: skip
    """Some fingers on a tool at rest.

    Args:
        robot: Jacobians, gravity.
        q: (28,) joint angles [rad].
        p_WT: (3,) tip in W [m].
        R_WT: (3, 3) orientation of the tool.
        c_W: (5, 3) where fingertips touch the handle, in W [m].
        n_W: (5, 3) handle's outward unit normals there, in W.
        under: Conditions.
        fingers: Which of them hold.
    """
    rows = np.array([FINGERS.index(finger) for finger in fingers])
    G = grasp_matrix(c_W[rows], p_WT)
    A = np.concatenate([R_WT.T @ G[:3], R_WT.T @ G[3:]])
    J = contact_jacobian(robot.fingertips(q), rows, c_W[rows])
    drives = Drives(J.T, robot.gravity(q) @ SELECTION, DRIVE_LIMITS)
    weight = -under.tool.bias(R_WT, np.zeros(6))
    return Hold(A, n_W[rows], weight, under.friction, np.full(len(rows), under.most), drives, under.drive)


def binding(steady: Steady, fingers: Sequence[str]) -> tuple[Limit, ...]:
    """Which limits bind, the strongest first."""
    if steady.verdict is not Verdict.SOLVED:
        return ()
    gains = steady.gains
    named = [
        *zip((f"{finger} friction" for finger in fingers), gains.friction.tolist(), strict=True),
        *zip((f"{finger} squeeze" for finger in fingers), gains.squeeze.tolist(), strict=True),
        *zip(DRIVEN, gains.drives.tolist(), strict=True),
        ("tip side force", gains.side),
        ("tip lean", gains.lean),
    ]
    total = sum(gain for _, gain in named)
    limits = [Limit(name, gain / total) for name, gain in named if gain > DULL * total]
    return tuple(sorted(limits, key=lambda limit: -limit.share))
