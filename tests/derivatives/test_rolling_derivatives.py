"""Rates of contacts against finite differences along a motion that rolls exactly, built without the rates.

Two paths of one speed are laid on the two surfaces by their geometry alone: one is chosen, the other follows
because `R dc' = R_i dc_i` once the fingertip's frame is placed by (14) and a chosen angle between the meridians.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.contact.rolling import Contact, contact_rates, slip_velocity
from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel
from turnscrew.geometry.rotations import exp_so3, log_so3

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

STEP = 1e-5
HANDLES = [
    Cylinder(0.018, 0.08, 0.18),
    barrel(0.08, 0.18, 0.012, 0.018),
    TurnedHandle((0.08, 0.10, 0.12, 0.15, 0.18), (0.012, 0.016, 0.013, 0.017, 0.015)),
]


class Motion:
    """Poses of tool and fingertip and the contact, as functions of time, rolling exactly."""

    def __init__(self, handle, tip, rng, v):
        self.handle, self.tip = handle, tip
        self.xi = rng.uniform(-3.0, 3.0), rng.uniform(0.125, 0.145)
        self.xi_speed = rng.normal(size=2) * [1.0, 0.02]
        self.angle, self.angle_speed = rng.uniform(0.3, 2.8), rng.normal()
        self.R_0, self.omega_T, self.v_T = exp_so3(rng.normal(size=3)), rng.normal(size=3), rng.normal(size=3)
        self.start = np.array([rng.uniform(-3.0, 3.0), v])

    def on_handle(self, t):
        return np.array(self.xi) + t * self.xi_speed

    def relative(self, t, u):
        """Orientation of F in T from opposed normals and the angle between the meridians at time t."""
        on_handle, on_tip = self.handle.local_geometry(*self.on_handle(t)), self.tip.local_geometry(*u)
        angle = self.angle + t * self.angle_speed
        t_u = np.cos(angle) * on_handle.t_u + np.sin(angle) * on_handle.t_v
        frame = np.column_stack([t_u, np.cross(-on_handle.n, t_u), -on_handle.n])
        return frame @ np.column_stack([on_tip.t_u, on_tip.t_v, on_tip.n]).T

    def u_speed(self, t, u):
        sweep = self.handle.tangents(*self.on_handle(t)) @ self.xi_speed
        return np.linalg.lstsq(self.relative(t, u) @ self.tip.tangents(*u), sweep, rcond=None)[0]

    def on_tip(self, t):
        """One Runge-Kutta step from time 0: of fifth order in t, far below the differences' own error."""
        k1 = self.u_speed(0.0, self.start)
        k2 = self.u_speed(0.5 * t, self.start + 0.5 * t * k1)
        k3 = self.u_speed(0.5 * t, self.start + 0.5 * t * k2)
        k4 = self.u_speed(t, self.start + t * k3)
        return self.start + t / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    def poses(self, t):
        u = self.on_tip(t)
        p_WT, R_WT = t * self.v_T, self.R_0 @ exp_so3(t * self.omega_T)
        R_WF = R_WT @ self.relative(t, u)
        return p_WT, R_WT, p_WT + R_WT @ self.handle.point(*self.on_handle(t)) - R_WF @ self.tip.point(*u), R_WF


@pytest.mark.parametrize("handle", HANDLES)
@pytest.mark.parametrize("v", [-1.0, 0.7])
def test_rates_are_those_of_a_motion_that_rolls_exactly(handle, v):
    rng = np.random.default_rng(2)
    for _ in range(5):
        motion = Motion(handle, Capsule(0.00705, 0.02), rng, v)
        (_, _, p_before, R_before), (_, _, p_after, R_after) = motion.poses(-STEP), motion.poses(STEP)
        p_WT, R_WT, p_WF, R_WF = motion.poses(0.0)
        omega_F = log_so3(R_before.T @ R_after) / (2.0 * STEP)
        rates = contact_rates(
            handle, motion.tip, Contact(*motion.start, *motion.xi), R_WT, motion.omega_T, R_WF, omega_F
        )
        expected = np.concatenate([motion.u_speed(0.0, motion.start), motion.xi_speed])
        # Central differences: STEP^2 / 6 = 2e-11 times third derivatives up to 1000 (speeds of 8 rad/s, cubed, twice).
        assert_close(rates.rates, expected, atol=1e-7)

        # The same motion satisfies (13), which was not used to build it.
        c_W = p_WT + R_WT @ handle.point(*motion.xi)
        V_WT = np.concatenate([motion.v_T, R_WT @ motion.omega_T])
        V_WF = np.concatenate([(p_after - p_before) / (2.0 * STEP), R_WF @ omega_F])
        assert_close(slip_velocity(c_W, p_WT, V_WT, p_WF, V_WF), 0.0, atol=1e-7)  # differences, as above
