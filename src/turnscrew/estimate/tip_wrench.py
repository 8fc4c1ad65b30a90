"""Wrench of the screw on the tool from the tool's dynamics and the fingers' forces (III-B)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.estimate.biased_load import BiasedLoad, LoadState
from turnscrew.estimate.thread_stiffness import ThreadState, ThreadStiffness
from turnscrew.geometry.arrays import Array


@dataclass(frozen=True, slots=True)
class WrenchState:
    """What the filters remember.

    Attributes:
        tau_y: Low-passed torque of the slot's walls about T's y axis [N.m].
        thread: Identification of k_s.
        axial: Filter of f_s,z.
    """

    tau_y: float
    thread: ThreadState
    axial: LoadState


@dataclass(frozen=True, slots=True)
class TipWrench:
    """Solves (7), rewritten as in III-B, for f_s, tau_s,y, domega_x and domega_z.

    With v_z = p/(2 pi) omega_z, dv_x = dv_y = domega_y = 0, tau_s,x = 0 and tau_s,z given by the thread,

        (f_s, 0, tau_s,y, tau_s,z) + F_h = M (0, 0, p/(2 pi) domega_z, domega_x, 0, domega_z) + C.

    Paper: (7) and the equation after it.  z points from the tip to the handle, so the law v_z = p/(2 pi) omega_z
    holds for a right-hand screw, fastening is negative yaw and tau_s,z = +k_s theta >= 0.  Departures: k_s is
    identified, with an offset beside it (`ThreadStiffness`); tau_s,y is low-passed and clamped, because fed into (8) as
    it comes it is a pure feed-through of the measured forces; and f_s,z passes a filter that learns, as fingers come
    and go, in which direction their readings err.

    Bandwidths: fingertip forces are low-passed at 7 Hz (`TouchDetector`, 22 ms) before they come here; tau_s,y then at
    3 Hz (.05 s), tau_s,z at 5 Hz (30 ms), f_s,z at 5 Hz; f_s,x and f_s,y not again.

    Attributes:
        tool: Mass properties.
        pitch: Pitch of the thread p [m].
        thread: Identification of k_s.
        axial: Filter of f_s,z.  Offset: 5 N, any force that a tip is pressed with.  Drift: 3 N in a second, what
            a change of fingers does to it.  Noise: .1 N, what is left of the fingertips' .03 N each, and ripples.
        tau_y_time: Time constant of tau_s,y's low-pass [s], found by trial.
        tau_y_limit: Clamp of |tau_s,y| [N.m]: 5 N on a blade 4 mm wide, the most its bottom edge can give.
    """

    tool: ToolInertia
    pitch: float
    thread: ThreadStiffness = field(default_factory=ThreadStiffness)
    axial: BiasedLoad = field(
        default_factory=lambda: BiasedLoad(offset=5.0, slope=0.0, drift=3.0, noise=0.1, surprise=np.inf)
    )
    tau_y_time: float = 0.05
    tau_y_limit: float = 0.02
    _inverse: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        M = self.tool.M
        A = np.zeros((6, 6))
        A[:3, :3] = np.eye(3)
        A[4, 3] = 1.0
        A[:, 4] = -M[:, 3]
        A[:, 5] = -(M[:, 5] + self.advance(1.0) * M[:, 2])
        # The system's matrix is made of constants: inverted once.
        object.__setattr__(self, "_inverse", np.linalg.inv(A))

    def advance(self, spin: float) -> float:
        """Travel along z that goes with a turn about z by the thread, p/(2 pi) spin; of rates as of angles."""
        return self.pitch / (2.0 * np.pi) * spin

    def init(self) -> WrenchState:
        """No torque yet, and no more force than the tool's weight."""
        return WrenchState(0.0, self.thread.init(), self.axial.init(9.81 * self.tool.mass))

    def update(
        self,
        state: WrenchState,
        F_h: Array,
        squeeze: Array,
        radius: float,
        R_WT: Array,
        nu: Array,
        theta: float,
        dt: float,
    ) -> tuple[WrenchState, Array]:
        """Estimate the wrench now.

        Args:
            state: Of the last call.
            F_h: (6,) wrench of the hand on the tool at the origin of T, in T, force first [N, N.m].
            squeeze: (5,) normal force of each finger, zero where it does not touch [N].
            radius: Of the handle [m].
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T, linear first [m/s, rad/s].
            theta: Angle by which the screw has been turned in [rad].
            dt: Time since the last call [s].

        Returns:
            The new state, and F_s: (6,) wrench of the screw on the tool at the origin of T, in T, force first.
        """
        b = self.tool.bias(R_WT, nu) - F_h
        thread, torque = self.thread.update(state.thread, float(b[5]), squeeze * radius, theta, dt)
        F_s, _ = self._solve(b, torque)
        tau_y = state.tau_y + dt / (self.tau_y_time + dt) * (F_s[4] - state.tau_y)
        F_s[4] = min(max(tau_y, -self.tau_y_limit), self.tau_y_limit)
        axial = self.axial.update(state.axial, float(F_s[2]), squeeze, 0.0, dt, loaded=True, learns=False)
        F_s[2] = axial.x[0]
        return WrenchState(float(tau_y), thread, axial), F_s

    def solve(self, F_h: Array, R_WT: Array, nu: Array, torque: float) -> tuple[Array, Array]:
        """The unfiltered solution.

        Args:
            F_h: (6,) as in `update`.
            R_WT: (3, 3) orientation of the tool.
            nu: (6,) velocity of T in T.
            torque: tau_s,z [N.m].

        Returns:
            F_s: (6,) as in `update`, with f_s,z and tau_s,y unfiltered.
            acceleration: (2,) domega_x and domega_z [rad/s2].
        """
        return self._solve(self.tool.bias(R_WT, nu) - F_h, torque)

    def _solve(self, b: Array, torque: float) -> tuple[Array, Array]:
        b[5] -= torque
        x = self._inverse @ b
        return np.array([x[0], x[1], x[2], 0.0, x[3], torque]), np.array([x[4], x[5]])
