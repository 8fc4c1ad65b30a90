from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.contact.grasp import grasp, grasp_matrix, squeeze, squeeze_all, weighted_grasp_matrix
from turnscrew.errors import TurnscrewError
from turnscrew.geometry.rotations import exp_so3, skew

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

ROUNDING = 1e-10  # eigenvalues of G G^T reach from 5 to 1e-4, which turns 1e-16 into 1e-12, of forces up to 30 N


@pytest.fixture(params=[2, 3, 4, 5])
def contacts(request):
    """Contacts around an 18 mm handle, 0.13 m above the tip of a tilted tool somewhere."""
    rng = np.random.default_rng(request.param)
    angles = np.linspace(0.0, 2.0 * np.pi, request.param, endpoint=False) + 0.2 * rng.normal(size=request.param)
    c_T = np.column_stack([0.018 * np.cos(angles), 0.018 * np.sin(angles), 0.13 + 0.003 * rng.normal(size=len(angles))])
    p_WT, R_WT = rng.normal(size=3), exp_so3(0.1 * rng.normal(size=3))
    return p_WT + c_T @ R_WT.T, p_WT


def test_the_matrix_is_identities_over_skew_matrices(contacts):
    c_W, p_WT = contacts
    expected = np.vstack([np.hstack([np.eye(3)] * len(c_W)), np.hstack([skew(c - p_WT) for c in c_W])])
    assert_close(grasp_matrix(c_W, p_WT), expected, atol=0.0)


def test_the_wrench_is_the_sum_of_forces_and_moments(contacts):
    c_W, p_WT = contacts
    f_W = np.random.default_rng(0).normal(size=c_W.shape)
    expected = np.concatenate([f_W.sum(axis=0), np.cross(c_W - p_WT, f_W).sum(axis=0)])
    assert_close(grasp(c_W, p_WT).wrench(f_W), expected, atol=ROUNDING)


def test_virtual_work_is_the_same_at_contacts_and_tool(contacts):
    c_W, p_WT = contacts
    rng = np.random.default_rng(1)
    f_W, V_WT, hold = rng.normal(size=c_W.shape), rng.normal(size=6), grasp(c_W, p_WT)
    velocities = V_WT[:3] + np.cross(V_WT[3:], c_W - p_WT)
    assert_close(hold.velocities(V_WT), velocities, atol=ROUNDING)
    assert (f_W * velocities).sum() == pytest.approx(hold.wrench(f_W) @ V_WT, abs=ROUNDING)


def test_distributed_forces_give_the_wrench_but_for_what_is_said_lost(contacts):
    c_W, p_WT = contacts
    F_W, hold = np.array([0.4, -0.3, 5.0, 0.01, -0.02, 0.1]), grasp(c_W, p_WT)
    out = hold.distribute(F_W)
    assert_close(hold.wrench(out.f_W) + out.lost, F_W, atol=ROUNDING)
    assert hold.rank == (5 if len(c_W) == 2 else 6)
    if hold.rank == 6:
        assert_close(out.lost, 0.0, atol=ROUNDING)


def test_a_wrench_that_forces_make_comes_back_whole(contacts):
    c_W, p_WT = contacts
    hold = grasp(c_W, p_WT)
    F_W = hold.wrench(np.random.default_rng(2).normal(size=c_W.shape))
    assert_close(hold.distribute(F_W).lost, 0.0, atol=ROUNDING)


def test_internal_forces_do_no_net_wrench_and_are_left_alone_by_the_projection(contacts):
    c_W, p_WT = contacts
    hold = grasp(c_W, p_WT)
    inner = hold.internal(10.0 * np.random.default_rng(3).normal(size=c_W.shape))
    assert_close(hold.wrench(inner), 0.0, atol=ROUNDING)
    assert_close(hold.internal(inner), inner, atol=ROUNDING)
    assert np.linalg.norm(inner) > 1.0  # the null space is not empty
    out = hold.distribute(np.array([1.0, 0.0, 5.0, 0.0, 0.0, 0.1]))
    assert (out.f_W * inner).sum() == pytest.approx(0.0, abs=1e-10)  # the smallest forces hold nothing inner


def test_squeezes_are_internal_and_press_inwards(contacts):
    c_W, p_WT = contacts
    hold, centre = grasp(c_W, p_WT), c_W.mean(axis=0)
    for f_W in (squeeze(c_W, 0, 1, 8.0), squeeze_all(c_W, 8.0)):
        assert_close(hold.wrench(f_W), 0.0, atol=ROUNDING)
        assert_close(hold.internal(f_W), f_W, atol=ROUNDING)
        assert (f_W * (centre - c_W)).sum() > 0.0
    assert_close(np.linalg.norm(squeeze(c_W, 0, 1, 8.0), axis=1)[:2], 8.0, atol=ROUNDING)
    assert np.linalg.norm(squeeze_all(c_W, 8.0), axis=1).mean() == pytest.approx(8.0, abs=ROUNDING)


def test_two_contacts_lose_just_the_torque_about_their_line():
    c_W, p_WT = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13]]), np.zeros(3)
    hold = grasp(c_W, p_WT)
    assert hold.rank == 5
    # The line runs along x, 0.13 m above the origin: a force along y turns the tool about it, and so does tau_x.
    turn = np.array([*np.cross(c_W[0], [1.0, 0.0, 0.0]), 1.0, 0.0, 0.0])
    F_W = np.array([0.3, 0.5, 5.0, 0.02, -0.04, 0.1])
    out = hold.distribute(F_W)
    about_line = turn @ F_W
    assert about_line == pytest.approx(0.02 + 0.13 * 0.5, abs=1e-15)
    assert_close(out.lost, turn * about_line / (turn @ turn), atol=ROUNDING)


@pytest.mark.parametrize(("length", "kept"), [(1e3, slice(0, 3)), (1e-4, slice(3, 6))])
def test_the_metric_says_whether_force_or_torque_is_given_up(length, kept):
    c_W = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13]])
    lost = grasp(c_W, np.zeros(3), length).distribute(np.array([0.3, 0.5, 5.0, 0.02, -0.04, 0.1])).lost
    # 0.085 N.m about the line; the other kind takes (0.13 / length)^2 or its inverse of it: 1e-6 and less.
    assert_close(lost[kept], 0.0, atol=1e-6)
    assert np.linalg.norm(lost) > 0.05


def test_three_contacts_nearly_on_a_line_do_not_ask_for_absurd_forces():
    c_W = np.array([[0.018, 0.0, 0.13], [-0.018, 0.0, 0.13], [0.0, 1e-4, 0.13]])
    hold = grasp(c_W, np.zeros(3))
    assert hold.rank == 5
    assert np.abs(hold.distribute(np.array([0.0, 0.0, 0.0, 0.02, 0.0, 0.0])).f_W).max() < 1.0


def test_one_contact_gives_force_only():
    hold = grasp(np.array([[0.018, 0.0, 0.13]]), np.array([0.018, 0.0, 0.13]))
    assert hold.rank == 3
    out = hold.distribute(np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]))
    assert_close(out.f_W, [[1.0, 2.0, 3.0]], atol=ROUNDING)
    assert_close(out.lost, [0.0, 0.0, 0.0, 0.1, 0.2, 0.3], atol=ROUNDING)


def test_no_contact_is_refused():
    with pytest.raises(TurnscrewError, match="at least one contact"):
        grasp(np.zeros((0, 3)), np.zeros(3))


def test_the_weighted_matrix_is_g_turned_into_the_tools_frame():
    rng = np.random.default_rng(4)
    c_W, p_WT, R_WT = rng.normal(size=(3, 3)), rng.normal(size=3), exp_so3(rng.normal(size=3))
    weights = rng.uniform(1.0, 50.0, 6)
    G = grasp_matrix(c_W, p_WT)
    expected = weights[:, None] * np.concatenate([R_WT.T @ G[:3], R_WT.T @ G[3:]])
    np.testing.assert_allclose(weighted_grasp_matrix(c_W, p_WT, R_WT, weights), expected, atol=1e-12)
