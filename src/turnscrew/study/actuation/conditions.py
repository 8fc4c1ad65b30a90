"""Who does the task in the study of actuation, and what goes wrong meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from turnscrew.errors import ScenarioError
from turnscrew.task.scenario_keys import Scenario


@dataclass(frozen=True)
class Arm:
    """A robot and its control.

    Attributes:
        kind: For the command line.
        name: For tables.
        meaning: In a few words.
        overrides: Of the scenario, `key=value` each.
    """

    kind: str
    name: str
    meaning: str
    overrides: tuple[str, ...]


@dataclass(frozen=True)
class Condition:
    """What is otherwise than the robot believes.

    Attributes:
        name: For tables and the command line.
        meaning: In a few words.
        mass_error: By which the robot's idea of all masses is too large, relative.
        friction: Of the fingertips, as a share of what the robot believes.
        pushed: Whether the handle is pushed again and again.
    """

    name: str
    meaning: str
    mass_error: float = 0.0
    friction: float = 1.0
    pushed: bool = False

    def overrides(self, scenario: Scenario) -> tuple[str, ...]:
        """What makes it so of a scenario, which keeps what the robot believes of friction."""
        wishes = (f"model.mass_error={self.mass_error!r}",) if self.mass_error else ()
        if self.friction == 1.0:
            return wishes
        real = self.friction * scenario.contact.finger_friction
        error = (1.0 + scenario.model.friction_error) / self.friction - 1.0
        return (*wishes, f"contact.finger_friction={real!r}", f"model.friction_error={error!r}")


MASS, LESS = 0.1, 0.8
CONDITIONS = (
    Condition("nothing", "no disturbance; noise and constant errors as ever"),
    Condition("pushes", "3 N for .1 s on the handle, level, every 2 to 4 s", pushed=True),
    Condition("mass", "masses taken for a tenth more than they are", mass_error=MASS),
    Condition("friction", "fingertips with a fifth less friction than believed", friction=LESS),
    Condition("all", "all three together", mass_error=MASS, friction=LESS, pushed=True),
)


TORQUE, FIXED, POSITION = "torque", "fixed", "position"
"""Kinds of arm."""


def arms(squeezes: Sequence[float]) -> tuple[Arm, ...]:
    """All arms of the study, one for each fixed F_0 among them [N]."""
    torque = ("robot.actuation=torque",)
    by_equation = (*torque, "control.forces=null-space")
    return (
        Arm(TORQUE, TORQUE, "torques, contact forces by optimisation", torque),
        *(
            Arm(FIXED, f"{FIXED} {force:g} N", f"torques, contact forces by (15) and (16) with F_0 = {force:g} N",
                (*by_equation, f"control.squeeze={force!r}"))
            for force in squeezes
        ),
        Arm(POSITION, POSITION, "positions", ("robot.actuation=position",)),
    )  # fmt: skip


def chosen_arms(kinds: Sequence[str] | None, squeezes: Sequence[float]) -> tuple[Arm, ...]:
    """Arms of the kinds asked for, all without.

    Raises:
        ScenarioError: there is none of that kind.
    """
    _check("--arm", kinds, (TORQUE, FIXED, POSITION))
    return tuple(arm for arm in arms(squeezes) if not kinds or arm.kind in kinds)


def chosen_conditions(names: Sequence[str] | None) -> tuple[Condition, ...]:
    """Conditions asked for, all without names.

    Raises:
        ScenarioError: there is none of that name.
    """
    _check("--condition", names, [condition.name for condition in CONDITIONS])
    return tuple(condition for condition in CONDITIONS if not names or condition.name in names)


def _check(option: str, names: Sequence[str] | None, known: Sequence[str]) -> None:
    for name in names or ():
        if name not in known:
            raise ScenarioError(f"{option} {name}: unknown; there are {', '.join(known)}")
