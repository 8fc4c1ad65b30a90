from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigs.views import view

from turnscrew.errors import CameraError
from turnscrew.geometry.pinhole import KINECT, Pinhole, Window
from turnscrew.sense.calibration_file import read_calibration, write_calibration
from turnscrew.sense.lens import Calibration

pytest.importorskip("cv2")

TURNED = Calibration(
    view(), Pinhole((1900.0, 1910.0), (1900.5, 1100.25), (3840, 2160)), (0.1, -0.04, 1e-3, -1e-3, 0.01)
)


def test_straightened_pixels_bend_back() -> None:
    rng = np.random.default_rng(0)
    pixels = rng.uniform([0, 0], KINECT.size, (500, 2))
    for calibration in (Calibration(view()), TURNED):
        # a thousandth of a pixel is where straightening stops
        np.testing.assert_allclose(calibration._bend(calibration.straightened(pixels)), pixels, atol=1e-3)


def test_lens_without_distortion_changes_nothing() -> None:
    calibration = Calibration(view(), distortion=())
    window = Window(100, 200, 30, 20)
    picture = np.arange(600, dtype=np.uint8).reshape(20, 30)
    assert calibration.needed(window) == window
    assert calibration.bent(picture, window) is picture
    p_W = view().p_WK + view().R_WK @ np.array([0.1, -0.05, 0.5])
    np.testing.assert_allclose(calibration.project(p_W[None]), [[1919.5 + 384, 1079.5 - 192]], atol=1e-9)


def test_bent_picture_shows_what_the_straight_pixels_show() -> None:
    window = Window(3000, 1500, 200, 150)
    need = TURNED.needed(window)
    # brightness tells the column, then the row
    columns, rows = np.meshgrid(np.arange(need.width), np.arange(need.height))
    u, v = np.meshgrid(window.left + np.arange(200), window.top + np.arange(150))
    straight = TURNED.straightened(np.stack([u, v], axis=-1).reshape(-1, 2)).reshape(150, 200, 2)
    for axis, ramp in enumerate((columns, rows)):
        shown = TURNED.bent(ramp.astype(np.float32), window)
        expected = straight[..., axis] - (need.left, need.top)[axis]
        # lines between nodes are off by less than a hundredth
        np.testing.assert_allclose(shown, expected, atol=0.01)


def test_calibration_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    write_calibration(TURNED, tmp_path / "camera.toml")
    back = read_calibration(tmp_path / "camera.toml")
    assert (back.pinhole, back.distortion) == (TURNED.pinhole, TURNED.distortion)
    assert np.array_equal(back.pose.p_WK, TURNED.pose.p_WK)
    # a quaternion's rounding
    np.testing.assert_allclose(back.pose.R_WK, TURNED.pose.R_WK, atol=1e-15)


def test_opencvs_own_file_is_read(tmp_path: Path) -> None:
    import cv2

    storage = cv2.FileStorage(str(tmp_path / "camera.yml"), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 3840)
    storage.write("image_height", 2160)
    storage.write("camera_matrix", TURNED.pinhole.matrix)
    storage.write("distortion_coefficients", np.array([TURNED.distortion]))
    storage.write("p_WK", np.array([1.0, 2.0, 3.0]))
    storage.write("q_WK", np.array([0.0, 1.0, 0.0, 0.0]))
    storage.release()
    back = read_calibration(tmp_path / "camera.yml")
    assert (back.pinhole, back.distortion) == (TURNED.pinhole, TURNED.distortion)
    np.testing.assert_allclose(back.pose.R_WK, np.diag([1.0, -1.0, -1.0]), atol=1e-15)


GOOD = {
    "image_size": "[3840, 2160]", "camera_matrix": "[[1920, 0, 1919.5], [0, 1920, 1079.5], [0, 0, 1]]",
    "distortion": "[]", "p_WK": "[1, 0, 0.5]", "q_WK": "[1, 0, 0, 0]",
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"p_WK": None, "q_WK": None}, "p_WK and q_WK missing: a calibration has image_size"),
        ({"camera_matrix": "[[1920, 0], [0, 1920]]"}, "camera_matrix = .*: must be 3 rows of 3 numbers"),
        ({"camera_matrix": "[[-1, 0, 5], [0, 1920, 5], [0, 0, 1]]"}, "must be positive focal lengths"),
        ({"camera_matrix": "[[9, 1, 5], [0, 9, 5], [0, 0, 1]]"}, r"must be \[\[fx,0,cx\]"),
        ({"image_size": "[3840]"}, "image_size = .*: must be width and height"),
        ({"distortion": "[0.1, 0.2, 0.3]"}, "distortion = .*: must be 0, 4, 5, 8, 12 or 14 coefficients"),
        ({"p_WK": "[1, nan, 0]"}, "p_WK: holds what is not a finite number"),
        ({"p_WK": "'left'"}, "p_WK = 'left': must be numbers"),
        ({"q_WK": "[2, 0, 0, 0]"}, "q_WK = .*: must be a unit quaternion"),
        ({"q_WK": "["}, "cannot be read as TOML"),
    ],
)
def test_what_is_wrong_with_a_calibration_is_told_in_one_line(
    tmp_path: Path, change: dict[str, str | None], expected: str
) -> None:
    file = tmp_path / "camera.toml"
    file.write_text("".join(f"{name} = {value}\n" for name, value in {**GOOD, **change}.items() if value is not None))
    with pytest.raises(CameraError, match=expected) as caught:
        read_calibration(file)
    assert "\n" not in str(caught.value)
    assert str(file) in str(caught.value)


def test_file_that_is_no_calibration_is_told(tmp_path: Path) -> None:
    with pytest.raises(CameraError, match="there is no such calibration file"):
        read_calibration(tmp_path / "none.toml")
    for name in ("camera.yml", "camera.txt"):
        (tmp_path / name).write_text("a shopping list\n- milk")
        with pytest.raises(CameraError, match=name):
            read_calibration(tmp_path / name)
