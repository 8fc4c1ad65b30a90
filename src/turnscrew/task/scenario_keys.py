"""The scenario's keys: frozen models in which every key carries its unit, range, meaning and source.

All values are SI (m, rad, kg, N, N.m, s, Hz).
"""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import model_validator

from turnscrew.task.scenario_robot import Control, Robot
from turnscrew.task.scenario_sensing import Estimation, Force, Markers, Sense, Vision
from turnscrew.task.scenario_tables import PAPER, Table, key


class Handle(Table):
    """The part of the tool that the fingers hold."""

    shape: Literal["cylinder"] = key("cylinder", "-", "Form of the handle.", "simplest form the gait was planned for")
    radius: float = key(
        0.018,
        "m",
        "Radius; whether a gait fits it is the planner's answer (plans are known for 0.010 to 0.018).",
        "found by trial: a fat handle gives the most torque that a pinch can hold",
        ge=0.005,
        le=0.05,
    )
    length: float = key(
        0.10,
        "m",
        "Length along the tool's axis.",
        "assumed: a bench screwdriver with a 1.0 x 6 mm blade",
        ge=0.04,
        le=0.25,
    )


class Tool(Table):
    """The screwdriver."""

    handle: Handle = Handle()
    markers: Markers = Markers()
    mass: float = key(
        0.08, "kg", "Mass of the whole tool.", "assumed: a bench screwdriver of this size", ge=0.01, le=1.0
    )
    drive: Literal["slotted"] = key("slotted", "-", "Kind of tip.", f"{PAPER}: a slotted screwdriver")
    contact_height: float = key(
        0.125,
        "m",
        "Height above the tip at which the fingers hold the handle, which is centred there.",
        "found by trial: the least height at which the hand clears the bench",
        ge=0.06,
        le=0.25,
    )
    shaft_radius: float = key(
        0.003, "m", "Radius of the shaft.", "assumed: a bench screwdriver with a 1.0 x 6 mm blade", ge=0.001, le=0.01
    )
    blade_width: float = key(
        0.006, "m", "Length of the tip's edge, along x of T.", "assumed: a blade for a slotted M4", ge=0.002, le=0.016
    )
    blade_thickness: float = key(
        0.001, "m", "Thickness of the tip.", "assumed: a blade for a 1.2 mm slot", ge=0.0003, le=0.003
    )


class Thread(Table):
    """What resists the screw's turning."""

    law: Literal["elastic", "self-locking"] = key(
        "elastic",
        "-",
        "'elastic': torque = stiffness * angle, it pushes back while fingers change; 'self-locking': torque = "
        "prevailing_torque + stiffness * (angle beyond seat_angle), only ever against the motion.",
        f"{PAPER}, section V-A: a stiffness makes the torque grow as the screw turns; real threads lock themselves",
    )
    stiffness: float = key(
        0.02,
        "N.m/rad",
        "k_s: growth of the resisting torque with the angle.",
        f"{PAPER} gives no value; found by trial: what a two-finger pinch holds over five rounds",
        ge=0.0,
        le=2.0,
    )
    prevailing_torque: float = key(
        0.02, "N.m", "Torque of the run-down ('self-locking').", "assumed: a dry M4 in a tapped hole", ge=0.0, le=1.0
    )
    seat_angle: float = key(
        10 * math.pi,
        "rad",
        "Angle at which the head meets its seat ('self-locking').",
        "five turns of thread are left when the driver takes over",
        ge=0.0,
        le=200.0,
    )
    seat_torque: float = key(
        1.19,
        "N.m",
        "Torque at which the screw is tight; the resistance grows no further ('self-locking').",
        "M4, class 4.6, 75 % of its proof load",
        gt=0.0,
        le=10.0,
    )


class Screw(Table):
    """The screw, premounted in its threaded hole."""

    pitch: float = key(0.0007, "m", "Advance in one turn.", "ISO 261: M4 coarse", ge=0.0001, le=0.003)
    head_radius: float = key(
        0.0045, "m", "Radius of the head.", "ISO 1207: M4, 7 to 8 mm, and a rim around the slot", ge=0.001, le=0.01
    )
    slot_width: float = key(0.0012, "m", "Width of the slot.", "ISO 1207: M4, n = 1.2 mm", ge=0.0004, le=0.004)
    slot_depth: float = key(0.0013, "m", "Depth of the slot.", "ISO 1207: M4, at least 1.1 mm", ge=0.0005, le=0.004)
    slot_length: float = key(
        0.0064,
        "m",
        "Length of the slot, whose ends are closed.",
        "found by trial: an open slot lets the tip slide out along it",
        ge=0.002,
        le=0.02,
    )
    slot_yaw: float = key(
        0.0, "rad", "Yaw of the slot at the start, about z of W.", "free choice", ge=-math.pi, le=math.pi
    )
    thread: Thread = Thread()


class Contact(Table):
    """Friction in the cell."""

    finger_friction: float = key(
        1.0,
        "-",
        "Coulomb coefficient, fingertip on handle.",
        "assumed: soft skin on a plastic handle, 0.6 to 1.1",
        ge=0.3,
        le=1.5,
    )
    tip_friction: float = key(
        0.3, "-", "Coulomb coefficient, tip in slot.", "dry steel on steel: 0.3 to 0.6, the low end", ge=0.05, le=1.0
    )

    passes: int = key(
        3,
        "-",
        "Passes of the simulator's second friction solver.",
        "found by trial: with 3 a fingertip near the end of its friction creeps by .5 mm/s, with 30 by a tenth of that",
        ge=0,
        le=100,
    )


class Start(Table):
    """Where the tool stands when the fingers have it; directions are drawn from the seed."""

    tool_tilt: float = key(
        0.0, "rad", "Tilt of the tool's axis from the screw's.", "the grasp is given as correct", ge=0.0, le=0.15
    )
    tool_offset: float = key(
        0.0, "m", "Offset of the tip's edge centre along the slot.", "the tip is given as engaged", ge=0.0, le=0.003
    )


class Goal(Table):
    """When the job is done: as soon as everything that is given here holds."""

    rounds: int | None = key(
        None,
        "-",
        "Rounds of rolling and finger gaiting (5, or 1 stroke, where neither angle nor torque is given).",
        f"{PAPER}, section V-B: seventeen of twenty trials exceed five rounds",
        ge=1,
        le=1000,
    )
    angle: float | None = key(None, "rad", "Angle by which the screw is turned in.", "free choice", gt=0.0, le=1000.0)
    torque: float | None = key(None, "N.m", "Torque that the screw resists with.", "free choice", gt=0.0, le=10.0)
    course: Literal["rounds", "stroke"] = key(
        "rounds",
        "-",
        "'rounds': of the finger gait; 'stroke': one stroke of thumb and middle finger, as long as their joints allow, "
        "which is held for a moment at its end and counts as one round.",
        f"{PAPER}, section V-A: one stroke is what it simulates with torques",
    )
    time_limit: float = key(
        600.0,
        "s",
        "Simulated time after which the run ends in TIMEOUT.",
        "ten times what five rounds should take",
        gt=0.0,
        le=36000.0,
    )

    @model_validator(mode="before")
    @classmethod
    def _five_rounds_unless_told(cls, given: Any) -> Any:
        if isinstance(given, dict) and not {"rounds", "angle", "torque"} & given.keys():
            return {**given, "rounds": 1 if given.get("course") == "stroke" else 5}
        return given


class Speed(Table):
    """How fast the job is done."""

    turning: float = key(
        math.radians(60.0),
        "rad/s",
        "Speed of the tool while the fingers roll.",
        "found by trial: one roll a second",
        ge=0.05,
        le=6.0,
    )
    gait: float = key(
        1.0,
        "-",
        "How much faster than at leisure fingers come, take over, leave and go back.",
        "at leisure a round takes 3.7 s",
        ge=0.25,
        le=4.0,
    )


class Model(Table):
    """How the controller's model is wrong: what it believes = (1 + error) * what is, or a value of its own."""

    mass_error: float = key(0.0, "-", "Relative error of the masses.", "free choice", ge=-0.5, le=0.5)
    friction_error: float = key(0.0, "-", "Relative error of the friction.", "free choice", ge=-0.5, le=0.5)
    tool_mass: float | None = key(
        None,
        "kg",
        "Mass of the tool that is counted with (tool.mass and mass_error where not set).",
        "the tool has been weighed",
        ge=0.01,
        le=1.0,
    )
    finger_friction: float | None = key(
        None,
        "-",
        "Coulomb coefficient of the fingertips that is counted with (contact.finger_friction and friction_error where "
        "not set).",
        "skin and handle have been tried",
        ge=0.1,
        le=1.5,
    )


class Rate(Table):
    """How often plant and control step."""

    plant: float = key(1000.0, "Hz", "Steps of the plant a second.", "contact of an 80 g tool", ge=500.0, le=10000.0)
    control: float = key(
        100.0, "Hz", "Ticks of the loop a second.", "found by trial: 100 and 200 do equally well", ge=50.0, le=1000.0
    )
    torque: float = key(
        500.0,
        "Hz",
        'Torques a second with robot.actuation = "torque": servo, contact forces and (18) run that often, on the '
        "newest encoder readings; rounded to a whole number in each tick.",
        "two steps of a plant at 1 kHz, within the 1 kHz at which Shadow's hand takes efforts",
        ge=100.0,
        le=1000.0,
    )


class Scenario(Table):
    """One run, fully described: the same scenario gives the same run."""

    seed: int = key(0, "-", "Seed of all that is random in a run.", "free choice", ge=0, le=2**32 - 1)
    tool: Tool = Tool()
    screw: Screw = Screw()
    contact: Contact = Contact()
    robot: Robot = Robot()
    control: Control = Control()
    sense: Sense = Sense()
    vision: Vision = Vision()
    force: Force = Force()
    estimate: Estimation = Estimation()
    start: Start = Start()
    goal: Goal = Goal.model_validate({})
    speed: Speed = Speed()
    model: Model = Model()
    rate: Rate = Rate()

    @property
    def steps_per_tick(self) -> int:
        """Plant steps in one tick of the loop."""
        return round(self.rate.plant / self.rate.control)

    @property
    def delay_periods(self) -> int:
        """Control periods that a command takes to arrive."""
        return round(self.robot.delay * self.rate.control * self.beats_per_tick)

    @property
    def patience(self) -> int | None:
        """Plant steps without a command after which drives hold their joints; None if they never do.

        Position servos hold theirs anyway.
        """
        periods = self.robot.watchdog
        if self.robot.actuation == "position" or not periods:
            return None
        return periods * self.steps_per_tick // self.beats_per_tick

    @property
    def beats_per_tick(self) -> int:
        """How often in a tick torques are worked out: a divisor of the plant's steps; once for position commands."""
        if self.robot.actuation == "position":
            return 1
        steps, wanted = self.steps_per_tick, self.rate.torque / self.rate.control
        return min((n for n in range(1, steps + 1) if steps % n == 0), key=lambda n: abs(n - wanted))
