from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from turnscrew.geometry.euler import (
    body_rate_matrix,
    euler_from_matrix,
    euler_rate_matrix,
    matrix_from_euler,
    tilt,
    yaw,
)

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

ROUNDING = 1e-14  # a few dozen operations on numbers of order 1

angles = st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)).map(np.array)


@given(angles)
def test_matrix_is_scipys_intrinsic_z_y_x(gamma):
    roll, pitch, yaw_angle = gamma
    expected = Rotation.from_euler("ZYX", [yaw_angle, pitch, roll]).as_matrix()
    assert_close(matrix_from_euler(gamma), expected, atol=ROUNDING)


@given(angles)
def test_angles_come_back_from_the_matrix(gamma):
    # At a pitch of 1.5 rad the yaw is read from entries of size 0.07, which loses a factor of 14 of rounding.
    assert_close(euler_from_matrix(matrix_from_euler(gamma)), gamma, atol=2e-14)


@given(angles)
def test_rates_matrix_in_the_tool_is_the_one_in_the_world_turned_back(gamma):
    assert_close(body_rate_matrix(gamma), matrix_from_euler(gamma).T @ euler_rate_matrix(gamma), atol=ROUNDING)
    assert np.linalg.det(euler_rate_matrix(gamma)) == pytest.approx(np.cos(gamma[1]), abs=ROUNDING)


@given(st.floats(0.0, np.pi), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_tilt_is_the_angle_of_the_axis_whatever_the_turn_about_it(angle, heading, turn):
    axis = np.array([np.cos(heading), np.sin(heading), 0.0])
    R = (Rotation.from_rotvec(angle * axis) * Rotation.from_rotvec([0.0, 0.0, turn])).as_matrix()
    assert tilt(R) == pytest.approx(angle, abs=ROUNDING)


def test_tilt_of_a_microradian_is_not_lost():
    assert tilt(matrix_from_euler(np.array([1e-6, 0.0, 1.0]))) == pytest.approx(1e-6, rel=1e-9)  # acos would give 1e-10


@given(angles)
def test_yaw_is_the_third_angle(gamma):
    assert yaw(matrix_from_euler(gamma)) == pytest.approx(gamma[2], abs=2e-14)  # as for the angles above


def test_yaw_falls_when_the_tool_fastens_a_right_hand_screw():
    # Seen from the handle a right-hand screw is driven clockwise: about the axis from tip to handle, negatively.
    assert yaw(matrix_from_euler(np.array([0.01, 0.02, -0.5]))) < 0.0
