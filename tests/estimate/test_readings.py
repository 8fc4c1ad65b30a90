from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from turnscrew.estimate.readings import filled, is_pose
from turnscrew.geometry.rotations import exp_so3
from turnscrew.signals import Measurement, Vision

FRAME = Vision(0.1, np.ones(3), exp_so3(np.array([0.1, 0.2, 0.3])), np.eye(6) * 1e-6)
GOOD = Measurement(0.1, np.arange(28.0), np.arange(28.0), np.ones((5, 3)), np.ones(24), FRAME, "")


def test_good_readings_pass_untouched() -> None:
    assert filled(GOOD, None) is GOOD
    silent = replace(GOOD, f_F=None, tau=None, vision=None)
    assert filled(silent, GOOD) is silent


@pytest.mark.parametrize("name", ["q", "v", "f_F", "tau"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_bad_entries_keep_their_last_value_and_good_ones_their_own(name: str, bad: float) -> None:
    reading = getattr(GOOD, name) + 1.0
    reading.flat[3] = bad
    got = getattr(filled(replace(GOOD, **{name: reading}), GOOD), name)
    expected = getattr(GOOD, name) + 1.0
    expected.flat[3] -= 1.0
    np.testing.assert_array_equal(got, expected)
    first = getattr(filled(replace(GOOD, **{name: reading}), None), name)
    assert first.flat[3] == 0.0


SPOILT = {
    "no position": replace(FRAME, p_WT=np.array([0.0, np.nan, 0.0])),
    "no rotation": replace(FRAME, R_WT=np.eye(3) * 1.1),
    "mirrored": replace(FRAME, R_WT=np.diag([1.0, 1.0, -1.0])),
    "no number": replace(FRAME, R_WT=np.full((3, 3), np.nan)),
    "no covariance": replace(FRAME, P=np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0])),
    "endless covariance": replace(FRAME, P=np.full((6, 6), np.inf)),
}


@pytest.mark.parametrize("frame", SPOILT.values(), ids=SPOILT.keys())
def test_frames_that_are_no_pose_are_left_out_and_said_so(frame: Vision) -> None:
    assert not is_pose(frame)
    got = filled(replace(GOOD, vision=frame), GOOD)
    assert got.vision is None
    assert got.blind


def test_a_perfect_frame_is_a_pose() -> None:
    assert is_pose(replace(FRAME, P=np.zeros((6, 6))))
