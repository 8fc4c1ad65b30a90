"""The largest steady torque: closed forms, laws, prices against differences, and what is named when nothing holds."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turnscrew.contact.envelope import SIDES, Drive, Drives, Hold, Verdict, largest_torque, surest_forces
from turnscrew.contact.friction import cone_margin
from turnscrew.contact.grasp import grasp_matrix

RADIUS, HEIGHT, FRICTION, MOST, THRUST = 0.015, 0.13, 0.8, 10.0, 5.0


def ring(count: int, radius: float = RADIUS, friction: float = FRICTION, most: float = MOST) -> Hold:
    """Contacts evenly around an upright, weightless tool at one height; drives without limits."""
    angles = 2.0 * np.pi * np.arange(count) / count + 0.3
    n = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
    A = grasp_matrix(radius * n + [0.0, 0.0, HEIGHT], np.zeros(3))
    free = Drives(np.zeros((1, 3 * count)), np.zeros(1), np.ones(1))
    return Hold(A, n, np.zeros(6), friction, np.full(count, most), free, Drive(THRUST, 3.0, np.array([0.002, 0.015])))


def closed_form(count: int, radius: float, friction: float, most: float) -> float:
    """Each contact carries its part of the thrust, and what friction is left goes around the axis."""
    return count * radius * sqrt((friction * most) ** 2 - (THRUST / count) ** 2)


def uneven() -> Hold:
    """Three contacts, neither opposed nor level, with drives that are loaded and a tool that weighs."""
    rng = np.random.default_rng(5)
    angles = np.array([0.2, 2.1, 4.4])
    n = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    c = RADIUS * n + np.array([[0, 0, 0.128], [0, 0, 0.134], [0, 0, 0.131]])
    drives = Drives(0.05 * rng.normal(size=(4, 9)), 0.05 * rng.normal(size=4), np.array([0.45, 0.6, 0.5, 0.7]))
    weight = np.array([0.0, 0.0, -0.8, 0.0, 0.0, 0.0])
    most = np.array([9.0, 14.0, 12.0])
    return Hold(grasp_matrix(c, np.zeros(3)), n, weight, 0.8, most, drives, Drive(5.0, 0.3, np.array([0.002, 0.01])))


@pytest.mark.parametrize("count", [2, 3, 4, 6])
def test_contacts_around_a_handle_give_the_closed_form(count: int) -> None:
    found = largest_torque(ring(count))
    exact = closed_form(count, RADIUS, FRICTION, MOST)
    assert found.verdict is Verdict.SOLVED
    # the round cones lie between the pyramids
    assert found.torque <= exact * (1.0 + 1e-9)
    assert found.ceiling >= exact * (1.0 - 1e-9)
    # a pyramid gives away 1 - cos(pi / sides) of mu, and the torque falls by at most (mu N)^2 / (...) times that
    worth = (FRICTION * MOST) ** 2 / ((FRICTION * MOST) ** 2 - (THRUST / count) ** 2)
    assert exact - found.torque < 1.05 * worth * (1.0 - cos(pi / SIDES)) * exact


def test_the_forces_hold_the_tool_within_every_limit() -> None:
    hold = uneven()
    found = largest_torque(hold)
    # the solver's feasibility tolerance is 1e-7
    np.testing.assert_allclose(hold.A @ found.f_W.ravel() + found.F_s + hold.load, 0.0, atol=1e-6)
    assert found.F_s[5] == pytest.approx(found.torque)
    assert (cone_margin(found.f_W, hold.n_W, hold.friction) > -1e-6).all()
    assert (-(found.f_W * hold.n_W).sum(axis=1) < hold.most + 1e-6).all()
    torques = hold.drives.rest + hold.drives.T @ found.f_W.ravel()
    assert (np.abs(torques) < hold.drives.rating + 1e-6).all()


def scaled(hold: Hold, name: str, index: int | None, factor: float) -> Hold:
    """The hold with one limit changed."""
    drives, drive = hold.drives, hold.drive
    if name == "friction":
        return replace(hold, friction=hold.friction * factor)
    if name == "squeeze":
        most = hold.most.copy()
        most[index] *= factor
        return replace(hold, most=most)
    if name == "drives":
        rating = drives.rating.copy()
        rating[index] *= factor
        return replace(hold, drives=replace(drives, rating=rating))
    changed = {"side": drive.side * factor} if name == "side" else {"lean": drive.lean * factor}
    return replace(hold, drive=replace(drive, **changed))


@pytest.mark.parametrize(
    ("name", "index"),
    [("friction", None), *(("squeeze", i) for i in range(3)), *(("drives", i) for i in range(4)), ("side", None),
     ("lean", None)],
)  # fmt: skip
def test_gains_are_what_a_little_more_of_a_limit_gives(name: str, index: int | None) -> None:
    hold, step = uneven(), 1e-4
    more = [largest_torque(scaled(hold, name, index, 1.0 + sign * step)).torque for sign in (1, -1)]
    gains = np.sum(getattr(largest_torque(hold).gains, name) if index is None else
                   getattr(largest_torque(hold).gains, name)[index])  # fmt: skip
    # a linear program is exactly linear until its basis changes; in mu the rest is of second order, 1e-4 of it
    assert (more[0] - more[1]) / (2 * step) == pytest.approx(gains, rel=2e-3, abs=1e-6)


def test_some_limits_of_every_kind_bind_in_the_example() -> None:
    gains = largest_torque(uneven()).gains
    assert gains.friction.max() > 0.0
    assert gains.squeeze.max() + gains.drives.max() > 0.0
    assert (gains.friction >= 0.0).all()
    assert (gains.squeeze >= 0.0).all()
    assert (gains.drives >= 0.0).all()


def levered(rest: float, rating: float) -> Hold:
    """Two contacts; a drive presses contact 0 through a lever of 5 cm, and the tip gives no side force to help."""
    hold = ring(2)
    T = np.zeros((1, 6))
    T[0, :3] = -0.05 * hold.n_W[0]
    alone = Drive(THRUST, 0.0, np.zeros(2))
    return replace(hold, drives=Drives(T, np.array([rest]), np.array([rating])), drive=alone)


def test_a_weak_drive_is_what_binds() -> None:
    found = largest_torque(levered(0.0, 0.3))
    # 6 N; the pyramids' share as above
    assert found.torque == pytest.approx(closed_form(2, RADIUS, FRICTION, 6.0), rel=5e-3)
    assert found.gains.drives[0] > 0.0
    assert not found.gains.squeeze.any()


def test_a_drive_loaded_by_gravity_has_less_to_give() -> None:
    for rest, newtons in ((-0.1, 8.0), (0.1, 4.0)):
        found = largest_torque(levered(rest, 0.3))
        assert found.torque == pytest.approx(closed_form(2, RADIUS, FRICTION, newtons), rel=1e-2)


def test_contacts_that_are_neither_opposed_nor_level_need_the_slots_side_force() -> None:
    hold = ring(2)
    x, y, _ = hold.n_W[1]
    n = np.array([hold.n_W[0], [x * cos(0.1) - y * sin(0.1), x * sin(0.1) + y * cos(0.1), 0.0]])
    A = grasp_matrix(RADIUS * n + np.array([[0.0, 0.0, HEIGHT], [0.0, 0.0, HEIGHT + 0.005]]), np.zeros(3))
    askew = replace(hold, A=A, n_W=n)
    without = largest_torque(replace(askew, drive=replace(askew.drive, side=0.0)))
    assert without.torque < 0.9 * largest_torque(askew).torque


@settings(max_examples=40, deadline=None)
@given(st.floats(0.4, 1.1), st.floats(6.0, 20.0), st.floats(0.008, 0.02), st.floats(1.01, 1.5))
def test_more_friction_squeeze_or_radius_never_gives_less(
    friction: float, most: float, radius: float, factor: float
) -> None:
    least = largest_torque(ring(3, radius, friction, most)).torque
    assert largest_torque(ring(3, radius, factor * friction, most)).torque >= least
    assert largest_torque(ring(3, radius, friction, factor * most)).torque >= least
    assert largest_torque(ring(3, factor * radius, friction, most)).torque >= least


@pytest.mark.parametrize("solve", [largest_torque, lambda hold: surest_forces(hold, 0.01)])
def test_drives_that_cannot_even_bear_gravity_are_said(solve) -> None:
    found = solve(replace(ring(2), drives=Drives(np.zeros((1, 6)), np.array([2.0]), np.array([1.0]))))
    assert found.verdict is Verdict.HELPLESS
    assert not found.f_W.any()


def test_contacts_too_slippery_to_press_the_tip_give_no_torque() -> None:
    # 2 x .2 x 10 N < 5 N
    found = largest_torque(ring(2, friction=0.2))
    assert found.verdict is Verdict.HELPLESS
    assert found.torque == 0.0


def test_the_surest_forces_have_the_margin_that_the_torque_leaves() -> None:
    hold = uneven()
    most = largest_torque(hold).torque
    margins = []
    for share in (0.3, 0.6, 0.9, 1.0):
        found = surest_forces(hold, share * most)
        assert found.verdict is Verdict.SOLVED
        np.testing.assert_allclose(hold.A @ found.f_W.ravel() + found.F_s + hold.load, 0.0, atol=1e-6)
        # the pyramid is inside the cone
        assert cone_margin(found.f_W, hold.n_W, hold.friction).min() >= found.margin - 1e-6
        margins.append(found.margin)
    assert margins == sorted(margins, reverse=True)
    assert margins[0] > 0.5
    # at the largest torque there is none left, to the solver's tolerance
    assert margins[-1] == pytest.approx(0.0, abs=1e-5)


def test_beyond_the_envelope_the_surest_forces_leave_their_cones() -> None:
    hold = ring(3)
    found = surest_forces(hold, 1.1 * largest_torque(hold).torque)
    assert found.verdict is Verdict.SOLVED
    assert found.margin < 0.0
