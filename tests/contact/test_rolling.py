"""Closed forms of rolling, and what is said where the contact is not regular."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.contact.rolling import Contact, contact_rates, roll, slip_velocity
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import exp_so3

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

HANDLE = Cylinder(0.018, 0.08, 0.18)
ACROSS = np.column_stack([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # finger's axis along -y of the tool
STILL = np.zeros(3)


def test_a_finger_across_a_turning_handle_rolls_along_its_axis():
    # The finger is straight where it touches and stands still, so the contact stays where the handle faces it:
    # on the handle it goes back as fast as that turns, and on the finger it sweeps the same length.
    tip, w = Capsule(0.007, 0.03), 0.5
    contact = Contact(u=np.pi / 2, v=-1.0, xi=0.0, eta=0.13)
    assert_close(ACROSS @ tip.normal(contact.u, contact.v), [-1.0, 0.0, 0.0], atol=1e-15)  # as (14) demands
    rates = contact_rates(HANDLE, tip, contact, np.eye(3), np.array([0.0, 0.0, w]), ACROSS, STILL)
    assert rates.regular
    # v counts the finger's length in its radius, and the finger's axis points along -y.
    assert_close(rates.rates, [0.0, 0.018 * w / 0.007, -w, 0.0], atol=1e-15)  # rounding
    assert_close(rates.sweep_W, [0.0, -0.018 * w, 0.0], atol=1e-16)


@pytest.mark.parametrize("w", [0.8, -2.0])
def test_a_sphere_rolls_around_a_fixed_cylinder_as_gears_do(w):
    rho, v, dt = 0.009, 0.7, 0.004
    tip, omega_F = Capsule(rho, 0.0), np.array([0.0, w, 0.0])
    # y of F along z of T; turned by -v about it the meridian u = pi faces the handle's axis at latitude v.
    R_WF = np.column_stack([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) @ exp_so3(np.array([0.0, -v, 0.0]))
    contact = Contact(u=np.pi, v=v, xi=0.0, eta=0.13)
    assert_close(R_WF @ tip.normal(contact.u, contact.v), [-1.0, 0.0, 0.0], atol=1e-15)  # as (14) demands
    steps = round(0.8 / (abs(w) * dt))
    for _ in range(steps):
        contact = roll(HANDLE, tip, contact, np.eye(3), STILL, R_WF, omega_F, dt)
        R_WF = R_WF @ exp_so3(dt * omega_F)
    turned = w * dt * steps
    # All rates are constant along this motion, so the midpoint rule is exact to rounding of some hundred steps.
    assert contact.xi == pytest.approx(turned * rho / (0.018 + rho), abs=1e-12)
    assert contact.v == pytest.approx(v - turned * 0.018 / (0.018 + rho), abs=1e-12)
    assert (contact.u, contact.eta) == pytest.approx((np.pi, 0.13), abs=1e-12)


def test_a_spinning_finger_leaves_its_contact_where_it_is():
    tip = Capsule(0.007, 0.03)
    contact = Contact(u=np.pi / 2, v=-1.0, xi=0.0, eta=0.13)
    spin_F = ACROSS.T @ np.array([3.0, 0.0, 0.0])  # about the common normal
    rates = contact_rates(HANDLE, tip, contact, np.eye(3), STILL, ACROSS, spin_F)
    assert_close(rates.rates, 0.0, atol=1e-14)  # rounding


def test_bodies_that_turn_together_do_not_roll():
    tip, omega = Capsule(0.007, 0.03), np.array([0.3, -0.7, 1.1])
    contact = Contact(u=np.pi / 2, v=-1.0, xi=0.0, eta=0.13)
    rates = contact_rates(HANDLE, tip, contact, np.eye(3), omega, ACROSS, ACROSS.T @ omega)
    assert_close(rates.rates, 0.0, atol=1e-13)  # rounding over lengths of 10 mm


def test_two_parallel_cylinders_roll_as_gears_and_are_said_to_touch_along_a_line():
    tip, w = Capsule(0.009, 0.03), 0.7
    R_WF = np.eye(3)
    contact = Contact(u=np.pi, v=-1.0, xi=0.0, eta=0.13)
    rates = contact_rates(HANDLE, tip, contact, np.eye(3), STILL, R_WF, np.array([0.0, 0.0, w]))
    assert not rates.regular
    advance = 0.009 * w / (0.018 + 0.009)
    # The point on the fingertip travels the same length the other way round.
    assert_close(rates.rates, [-advance * 0.018 / 0.009, 0.0, advance, 0.0], atol=1e-14)  # rounding


def test_the_pole_of_a_fingertip_has_no_angle_but_finite_rates():
    tip = Capsule(0.009, 0.03)
    R_WF = np.column_stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])  # pointing at the handle along -x
    contact = Contact(u=0.0, v=0.5 * np.pi, xi=0.0, eta=0.13)
    rates = contact_rates(HANDLE, tip, contact, np.eye(3), np.array([0.0, 0.0, 1.0]), R_WF, STILL)
    assert not rates.regular
    assert rates.rates[0] == 0.0
    assert rates.rates[2] == pytest.approx(-0.009 / (0.018 + 0.009), rel=1e-12)  # gears again


def test_slip_is_the_difference_of_the_points_velocities():
    V_WT, V_WF = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0]), np.array([0.0, 0.03, 0.0, 0.0, 0.0, 0.0])
    slip = slip_velocity(np.array([0.018, 0.0, 0.13]), np.zeros(3), V_WT, np.array([0.03, 0.0, 0.13]), V_WF)
    assert_close(slip, [0.0, 0.006, 0.0], atol=1e-17)
