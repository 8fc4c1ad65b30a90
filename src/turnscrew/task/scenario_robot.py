"""The scenario's keys of the robot and its control."""

from __future__ import annotations

from typing import Literal

from turnscrew.task.scenario_tables import PAPER, Table, key


class Robot(Table):
    """Arm, hand and how they are commanded."""

    arm: Literal["wam"] = key("wam", "-", "Arm: Barrett WAM with four joints.", PAPER)
    hand: Literal["shadow"] = key("shadow", "-", "Hand: Shadow Dexterous Hand, right.", PAPER)
    actuation: Literal["position", "torque"] = key(
        "position",
        "-",
        "What the robot accepts.",
        f"{PAPER}, section V-B: the hand's interface accepts position commands only",
    )
    delay: float = key(
        0.0,
        "s",
        "Time that a command takes to arrive at the drives; rounded to whole control periods, which are 1 / rate.torque"
        ' with actuation = "torque" and 1 / rate.control otherwise.',
        "none: Shadow's loop of 1 kHz puts a command out within a millisecond; `turnscrew study stability` tells how "
        "much a grasp stands",
        ge=0.0,
        le=0.1,
    )
    watchdog: int = key(
        2,
        "periods",
        "Control periods without a command after which the drives hold their joints where they are, on top of the last "
        'torque; 0: never, they go on giving that. For actuation = "torque".',
        "assumed: drives on a bus watch it; two, for one telegram may be late",
        ge=0,
        le=100,
    )


class Control(Table):
    """How the tool is held, and the wrench shared among the fingertips; where the hand is meanwhile."""

    forces: Literal["optimal", "null-space"] = key(
        "optimal",
        "-",
        "'optimal': the least squeeze that holds, within cones and joint torques, by a QP; 'null-space': (15) and (16) "
        "with F_0 the inward normals times a squeeze. Position commands always take the latter.",
        f"{PAPER} leaves the choice of F_0 open",
    )
    squeeze: float | None = key(
        None,
        "N",
        "Squeeze F_0 of each finger that has its whole share, the same at all times; without it the squeeze grows with "
        'the load. Not for torques with forces = "optimal".',
        f"{PAPER}, (16): F_0 is chosen, and no value is given; `turnscrew study actuation` tells what it costs",
        ge=0.5,
        le=20.0,
    )
    frequency: float = key(
        32.0,
        "rad/s",
        "Natural frequency of the errors of the tool's angles: k_p of (10) is its square.",
        "a third of the 100 rad/s of the finger joints' own damping",
        ge=1.0,
        le=500.0,
    )
    damping: float = key(
        1.0,
        "-",
        "Damping ratio of these errors: k_v of (10) is 2 * damping * frequency.",
        "critical: the fastest that does not swing over",
        ge=0.1,
        le=10.0,
    )
    palm_weight: float = key(
        100.0,
        "-",
        "How many times heavier than they are arm and wrist count when joints are chosen that move the tool: at 1 the "
        'palm follows the tool as gladly as the fingers. For actuation = "torque".',
        "found by trial: below 10 the palm follows fast rolls by a degree, and fingers meet; a single stroke goes "
        "farther with a palm that helps",
        ge=1.0,
        le=1e4,
    )
    friction_used: float = key(
        0.6,
        "-",
        "Share of the believed friction that the squeeze counts on; the rest is margin.",
        "readings that err by 25 % and 30 deg leave at worst .75 cos(30 deg) = .65 of what was asked for; a robot that "
        "takes torques presses more nearly as told",
        ge=0.2,
        le=1.0,
    )
    largest_squeeze: float = key(
        12.0,
        "N",
        'Largest squeeze of a finger with actuation = "torque".',
        "Shadow's fingertips stand 5-8 N for long and more for a moment",
        ge=4.0,
        le=20.0,
    )
    recentre: bool = key(
        True,
        "-",
        "Whether arm and wrist, at the start and while the handle rolls, bring the hand to where the plan has it over "
        "the screw, as the estimate tells.",
        "fingers that stray from the plan's postures run out of reach",
    )
