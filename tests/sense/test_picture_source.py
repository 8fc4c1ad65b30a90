"""Real pictures take the simulated camera's path: files, folders, videos, and what is wrong with them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from rigs.views import COLLAR, PICTURES, shipped

from turnscrew.errors import CameraError
from turnscrew.geometry.rotations import log_so3
from turnscrew.sense.picture_source import see

cv2 = pytest.importorskip("cv2")

CALIBRATION = PICTURES / "calibration.toml"


def test_shipped_image_is_seen() -> None:
    (frame,) = see(str(PICTURES / "collar2.png"), CALIBRATION, COLLAR)
    assert (frame.stamp, frame.blind) == (0.0, "")
    p_WT, R_WT = shipped()["collar2.png"]
    error = np.concatenate([p_WT - frame.vision.p_WT, log_so3(R_WT @ frame.vision.R_WT.T)])
    # chi squared of 6 exceeds 22.5 in one of a thousand pictures
    assert error @ np.linalg.solve(frame.vision.P, error) < 22.5


def test_folder_is_seen_in_order_and_other_files_are_passed_over(tmp_path: Path) -> None:
    for count, name in enumerate(["collar0.png", "collar0.png", "other.png"]):
        shutil.copy(PICTURES / name, tmp_path / f"{count}.png")
    (tmp_path / "notes.txt").write_text("nothing to see")
    frames = list(see(str(tmp_path), CALIBRATION, COLLAR))
    assert [frame.vision is not None for frame in frames] == [True, True, False]
    assert frames[2].blind == "no marker of 4X4_50 in view"
    np.testing.assert_allclose([frame.stamp for frame in frames], [0.0, 1 / 30, 2 / 30])


def test_video_is_seen(tmp_path: Path) -> None:
    file = tmp_path / "collar.avi"
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, (400, 300))
    if not writer.isOpened():
        pytest.skip("this OpenCV writes no MJPG")
    for _ in range(3):
        writer.write(cv2.imread(str(PICTURES / "collar3.png")))
    writer.release()
    frames = list(see(str(file), CALIBRATION, COLLAR))
    assert [frame.blind for frame in frames] == ["", "", ""]
    np.testing.assert_allclose([frame.stamp for frame in frames], [0.0, 0.04, 0.08])
    # JPEG costs some of the corners' precision
    assert np.linalg.norm(frames[0].vision.p_WT - shipped()["collar3.png"][0]) < 0.004


def test_what_is_no_picture_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "torn.png").write_bytes(b"\x89PNG torn")
    (tmp_path / "torn.mp4").write_bytes(b"no video")
    (tmp_path / "none.png").touch()
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((48, 64), np.uint8))
    for name, expected in {
        "missing.png": "there is no such image, video or folder, nor is it the number of a camera",
        "empty": "holds no image",
        "torn.png": "cannot be read as an image",
        "none.png": "cannot be read as an image",
        "torn.mp4": "cannot be opened, or holds no picture",
        "small.png": "image of 64x48, calibrated for 400x300",
    }.items():
        with pytest.raises(CameraError, match=expected) as caught:
            list(see(str(tmp_path / name), CALIBRATION, COLLAR))
        assert "\n" not in str(caught.value)
    with pytest.raises(CameraError, match="there is no such calibration file"):
        list(see(str(PICTURES / "collar0.png"), tmp_path / "none.toml", COLLAR))
