"""Wrench of the screw on the tool from the tool's dynamics and the fingers' forces (III-B)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.geometry.arrays import Array


@dataclass(frozen=True, slots=True)
class WrenchState:
    """Low-passed torque of the slot's walls about T's y axis [N.m]."""

    tau_y: float


@dataclass(frozen=True, slots=True)
class TipWrench:
    """Solves (7), rewritten as in III-B, for f_s, tau_s,y, domega_x and domega_z.

    With v_z = p/(2 pi) omega_z, dv_x = dv_y = domega_y = 0, tau_s,x = 0 and tau_s,z = k_s theta,

        (f_s, 0, tau_s,y, k_s theta) + F_h = M (0, 0, p/(2 pi) domega_z, domega_x, 0, domega_z) + C.

    Paper: (7) and the equation after it.  z points from the tip to the handle, so the law v_z = p/(2 pi) omega_z
    holds for a right-hand screw, fastening is negative yaw and tau_s,z = +k_s theta >= 0.  Departures: tau_s,y is
    low-passed and clamped, because fed into (8) as it comes it is a pure feed-through of the measured forces; and
    without a stiffness (self-locking threads follow no spring) the tool is taken as turning steadily: domega_z = 0,
    and tau_s,z is solved for instead.

    Attributes:
        tool: Mass properties.
        pitch: Pitch of the thread p [m].
        stiffness: k_s [N.m/rad], or None where the thread is no spring.
        tau_y_time: Time constant of tau_s,y's low-pass [s], found by trial.
        tau_y_limit: Clamp of |tau_s,y| [N.m]: 5 N on a blade 4 mm wide, the most its bottom edge can give.
    """

    tool: ToolInertia
    pitch: float
    stiffness: float | None = None
    tau_y_time: float = 0.05
    tau_y_limit: float = 0.02
    _inverse: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        M = self.tool.M
        A = np.zeros((6, 6))
        A[:3, :3] = np.eye(3)
        A[4, 3] = 1.0
        A[:, 4] = -M[:, 3]
        if self.stiffness is None:
            A[5, 5] = 1.0
        else:
            A[:, 5] = -(M[:, 5] + self.advance(1.0) * M[:, 2])
        # The system's matrix is made of constants: inverted once.
        object.__setattr__(self, "_inverse", np.linalg.inv(A))

    def advance(self, spin: float) -> float:
        """Travel along z that goes with a turn about z by the thread, p/(2 pi) spin; of rates as of angles."""
        return self.pitch / (2.0 * np.pi) * spin

    def init(self) -> WrenchState:
        """No torque yet."""
        return WrenchState(0.0)

    def update(
        self, state: WrenchState, F_h: Array, R_WT: Array, nu: Array, theta: float, dt: float
    ) -> tuple[WrenchState, Array]:
        """Estimate the wrench now.

        Args:
            state: Of the last call.
            F_h: (6,) wrench of the hand on the tool at the origin of T, in T, force first [N, N.m].
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T, linear first [m/s, rad/s].
            theta: Angle by which the screw has been turned in [rad].
            dt: Time since the last call [s].

        Returns:
            The new state, and F_s: (6,) wrench of the screw on the tool at the origin of T, in T, force first.
        """
        F_s, _ = self.solve(F_h, R_WT, nu, theta)
        tau_y = state.tau_y + dt / (self.tau_y_time + dt) * (F_s[4] - state.tau_y)
        F_s[4] = min(max(tau_y, -self.tau_y_limit), self.tau_y_limit)
        return WrenchState(float(tau_y)), F_s

    def solve(self, F_h: Array, R_WT: Array, nu: Array, theta: float) -> tuple[Array, Array]:
        """The unfiltered solution.

        Args:
            F_h: (6,) as in `update`.
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T.
            theta: Angle by which the screw has been turned in [rad].

        Returns:
            F_s: (6,) as in `update`, with tau_s,y unfiltered.
            acceleration: (2,) domega_x and domega_z [rad/s2].
        """
        b = self.tool.bias(R_WT, nu) - F_h
        if self.stiffness is not None:
            b[5] -= self.stiffness * theta
        x = self._inverse @ b
        torque = x[5] if self.stiffness is None else self.stiffness * theta
        spin = 0.0 if self.stiffness is None else x[5]
        return np.array([x[0], x[1], x[2], 0.0, x[3], torque]), np.array([x[4], spin])
