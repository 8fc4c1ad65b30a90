from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from turnscrew.geometry.rotations import (
    cross,
    exp_so3,
    log_so3,
    matrix_from_quaternion,
    quaternion_conjugate,
    quaternion_from_matrix,
    quaternion_product,
    skew,
)

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

ROUNDING = 1e-14  # a few dozen operations on numbers of order 1

component = st.floats(-3.0, 3.0)
vector = st.tuples(component, component, component).map(np.array)


@given(vector, vector)
def test_skew_and_cross_are_numpys_cross_product(a, b):
    assert_close(skew(a) @ b, np.cross(a, b), atol=1e-14)  # products up to 18 round at 2e-15
    assert_close(cross(a, b), np.cross(a, b), atol=1e-14)


@given(vector)
def test_exp_agrees_with_scipy_and_is_a_rotation(phi):
    R = exp_so3(phi)
    assert_close(R, Rotation.from_rotvec(phi).as_matrix(), atol=ROUNDING)
    assert_close(R @ R.T, np.eye(3), atol=ROUNDING)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=ROUNDING)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-8, 0.99e-4, 1.01e-4, 1e-3, 1.0, 3.0, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, -2, 2), (-3, 1e-9, 4)])
def test_log_undoes_exp_from_no_turn_to_half_a_turn(angle, axis):
    phi = angle * np.array(axis, dtype=float) / np.linalg.norm(axis)
    back = log_so3(exp_so3(phi))
    if angle == np.pi and back @ phi < 0.0:
        back = -back  # a half turn has two rotation vectors
    # A rotation matrix holds its angle to rounding of its entries, whatever the angle.
    assert_close(back, phi, atol=2e-15)


def test_exp_and_log_keep_their_precision_for_angles_whose_squares_vanish():
    phi = np.array([1e-9, -2e-9, 3e-9])
    assert_close(log_so3(exp_so3(phi)), phi, rtol=1e-7)  # entries near 1e-9 stand beside others near 1e-18


@given(vector, vector)
def test_quaternions_multiply_as_their_matrices(a, b):
    p, q = quaternion_from_matrix(exp_so3(a)), quaternion_from_matrix(exp_so3(b))
    product = quaternion_product(p, q)
    assert_close(matrix_from_quaternion(product), exp_so3(a) @ exp_so3(b), atol=ROUNDING)
    assert_close(quaternion_product(product, quaternion_conjugate(product)), [1, 0, 0, 0], atol=ROUNDING)


@given(vector)
def test_quaternion_of_a_matrix_is_a_unit_one_with_scalar_first_and_not_negative(phi):
    q = quaternion_from_matrix(exp_so3(phi))
    assert q[0] >= 0.0
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=ROUNDING)
    assert_close(matrix_from_quaternion(q), exp_so3(phi), atol=ROUNDING)
    assert_close(matrix_from_quaternion(-3.0 * q), exp_so3(phi), atol=ROUNDING)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_about_each_axis_keep_their_axis(axis):
    q = quaternion_from_matrix(np.diag(np.where(np.arange(3) == axis, 1.0, -1.0)))
    assert_close(q, np.eye(4)[axis + 1], atol=0.0)  # all entries are exact


def test_quarter_turn_about_z_takes_x_to_y():
    q = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    assert_close(matrix_from_quaternion(q) @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=ROUNDING)
