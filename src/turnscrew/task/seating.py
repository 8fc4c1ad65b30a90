"""How tightly screws are seated: what a grasp's torque has to reach."""

from __future__ import annotations

from dataclasses import dataclass

NUT_FACTOR = 0.2
"""Torque over diameter times clamping force, of dry steel threads (K of the short-form torque equation)."""

PROOF_STRESS, PROOF_SHARE = 225e6, 0.75
"""Of a screw of class 4.6 [Pa] (ISO 898-1), and the share of it that a joint to be opened again is clamped with."""


@dataclass(frozen=True, slots=True)
class ScrewSize:
    """A metric coarse thread.

    Attributes:
        name: As it is called.
        diameter: Nominal [m].
        area: Stress area [m2] (ISO 898-1).
    """

    name: str
    diameter: float
    area: float

    @property
    def seating_torque(self) -> float:
        """`K d F` with F = 75 % of the proof load, class 4.6 [N.m]."""
        return NUT_FACTOR * self.diameter * PROOF_SHARE * PROOF_STRESS * self.area


SIZES = (
    ScrewSize("M2", 0.002, 2.07e-6),
    ScrewSize("M3", 0.003, 5.03e-6),
    ScrewSize("M4", 0.004, 8.78e-6),
    ScrewSize("M5", 0.005, 14.2e-6),
    ScrewSize("M6", 0.006, 20.1e-6),
)


def seated_by(torque: float) -> ScrewSize | None:
    """The largest size that a torque seats [N.m]; None where it does not even seat the smallest."""
    return next((size for size in reversed(SIZES) if size.seating_torque <= torque), None)
