"""What holds for rolling between any two patches of the family, in any pose that satisfies (12) and (14)."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.contact.rolling import Contact, closure, contact_rates, roll, rolling_system, slip_velocity
from turnscrew.geometry.closest import closest_points
from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel, tapered
from turnscrew.geometry.rotations import cross, exp_so3

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

HANDLES = {
    "cylinder": Cylinder(0.018, 0.08, 0.18),
    "cone": tapered(0.08, 0.18, 0.012, 0.018),
    "barrel": barrel(0.08, 0.18, 0.012, 0.018),
    "turned": TurnedHandle((0.08, 0.10, 0.12, 0.15, 0.18), (0.015, 0.0165, 0.016, 0.017, 0.015)),
}
TIPS = {"finger": Capsule(0.00705, 0.02), "thumb": Capsule(0.00918, 0.02)}


@pytest.fixture(params=[(h, t) for h in HANDLES for t in TIPS], ids="-".join)
def pair(request):
    return HANDLES[request.param[0]], TIPS[request.param[1]]


def touching(handle, tip, rng, side):
    """A random contact, with poses of tool and fingertip that close it; side -1 is the finger's body, +1 its top."""
    v = rng.uniform(0.1, 1.2) if side > 0 else rng.uniform(-1.5, -0.3)
    contact = Contact(rng.uniform(-3.0, 3.0), v, rng.uniform(-3.0, 3.0), rng.uniform(0.11, 0.15))
    p_WT, R_WT = rng.normal(size=3), exp_so3(rng.normal(size=3))
    on_tip, on_handle = tip.local_geometry(*contact[:2]), handle.local_geometry(*contact[2:])
    angle = rng.uniform(0.3, 2.8)  # between the meridians, away from parallel
    t_u = np.cos(angle) * on_handle.t_u + np.sin(angle) * on_handle.t_v
    frame = np.column_stack([t_u, np.cross(-on_handle.n, t_u), -on_handle.n])
    R_WF = R_WT @ frame @ np.column_stack([on_tip.t_u, on_tip.t_v, on_tip.n]).T
    p_WF = p_WT + R_WT @ handle.point(*contact[2:]) - R_WF @ tip.point(*contact[:2])
    return contact, p_WT, R_WT, p_WF, R_WF


def cases(pair, n=10):
    rng = np.random.default_rng(8)
    for i in range(n):
        yield rng, touching(*pair, rng, side=(-1) ** i)


def test_the_papers_system_has_rank_four_and_the_closed_form_solves_it(pair):
    for rng, (contact, _, R_WT, _, R_WF) in cases(pair):
        A, B = rolling_system(*pair, contact, R_WT, R_WF)
        lengths = np.array([0.007, 0.007, 0.018, 1.0])  # metres per parameter, so singular values compare
        assert np.linalg.matrix_rank(A / lengths, tol=1e-3) == 4
        omegas = rng.normal(size=6)
        rates = contact_rates(*pair, contact, R_WT, omegas[:3], R_WF, omegas[3:])
        assert rates.regular
        # All six equations hold, though four unknowns: rounding of entries up to 140 / m times metres.
        assert_close(A @ rates.rates, B @ omegas, atol=1e-12)


def test_both_surfaces_are_swept_by_one_velocity(pair):
    for rng, (contact, _, R_WT, _, R_WF) in cases(pair):
        handle, tip = pair
        rates = contact_rates(handle, tip, contact, R_WT, rng.normal(size=3), R_WF, rng.normal(size=3))
        over_tip = R_WF @ tip.tangents(*contact[:2]) @ rates.rates[:2]
        over_handle = R_WT @ handle.tangents(*contact[2:]) @ rates.rates[2:]
        assert_close(over_tip, rates.sweep_W, atol=1e-14)  # rounding
        assert_close(over_handle, rates.sweep_W, atol=1e-14)


def rolled(handle, tip, state, omega_T, omega_F, dt, steps):
    """Rolls without slip: the fingertip's origin moves as (13) demands, integrated as finely as the contact."""
    contact, p_WT, R_WT, p_WF, R_WF = state
    for _ in range(steps):
        new = roll(handle, tip, contact, R_WT, omega_T, R_WF, omega_F, dt)
        middle = roll(handle, tip, contact, R_WT, omega_T, R_WF, omega_F, 0.5 * dt)
        R_T, R_F = R_WT @ exp_so3(0.5 * dt * omega_T), R_WF @ exp_so3(0.5 * dt * omega_F)
        at_handle, at_tip = R_T @ handle.point(*middle[2:]), R_F @ tip.point(*middle[:2])
        v_WF = cross(R_T @ omega_T, at_handle) - cross(R_F @ omega_F, at_tip)
        p_WF = p_WF + dt * v_WF
        R_WT, R_WF = R_WT @ exp_so3(dt * omega_T), R_WF @ exp_so3(dt * omega_F)
        contact = new
    return contact, p_WT, R_WT, p_WF, R_WF


def test_rolling_without_slip_keeps_contact_closed_and_normals_opposed_to_second_order(pair):
    handle, tip = pair
    for rng, state in cases(pair, 4):
        omega_T, omega_F = 0.5 * rng.normal(size=3), 0.5 * rng.normal(size=3)
        errors = []
        for steps in (25, 50):
            offset, normals = closure(handle, tip, *rolled(handle, tip, state, omega_T, omega_F, 0.1 / steps, steps))
            errors.append(max(np.linalg.norm(offset) / 0.01, np.linalg.norm(normals)))
        # 4 ms steps over some 5 deg: errors of (omega dt)^2 per radian turned, so 1e-5 with curvatures that vary.
        assert errors[0] < 2e-5
        # A quarter at half the step, or rounding.
        assert errors[1] < 0.35 * errors[0] + 1e-12


def test_after_rolling_without_slip_the_closest_points_are_the_integrated_contact(pair):
    handle, tip = pair
    for rng, state in cases(pair, 4):
        omega_T, omega_F = 0.5 * rng.normal(size=3), 0.5 * rng.normal(size=3)
        contact, *poses = rolled(handle, tip, state, omega_T, omega_F, 0.002, 50)
        points = closest_points(handle, tip, *poses)
        seen = np.array([points.u, points.v, points.xi, points.eta])
        error = seen - contact
        error[[0, 2]] = (error[[0, 2]] + np.pi) % (2.0 * np.pi) - np.pi
        assert points.gap == pytest.approx(0.0, abs=2e-7)  # the integration's error, as above, times 10 mm
        # The contact's own error is that of the normals over the sine of the crossing angle, which is above 0.25.
        assert_close(error * [0.01, 0.01, 0.018, 1.0], 0.0, atol=1e-6)


def test_slip_is_zero_for_the_motion_that_rolls_and_the_added_velocity_otherwise(pair):
    handle, _ = pair
    for rng, (contact, p_WT, R_WT, p_WF, _) in cases(pair):
        c_W = p_WT + R_WT @ handle.point(*contact[2:])
        V_WT, omega_WF, extra = rng.normal(size=6), rng.normal(size=3), rng.normal(size=3)
        v_WF = V_WT[:3] + np.cross(V_WT[3:], c_W - p_WT) - np.cross(omega_WF, c_W - p_WF)
        slip = slip_velocity(c_W, p_WT, V_WT, p_WF, np.concatenate([v_WF - extra, omega_WF]))
        assert_close(slip, extra, atol=1e-14)  # rounding
