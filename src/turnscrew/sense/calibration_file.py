"""Calibration files: TOML, or YAML, XML and JSON as OpenCV's FileStorage writes them.

    image_size = [3840, 2160]                                             # width and height [px]
    camera_matrix = [[1920.0, 0, 1919.5], [0, 1920.0, 1079.5], [0, 0, 1]] # [px]
    distortion = [0.08, -0.05, 0.0003, -0.0002]                           # OpenCV's order: k1, k2, p1, p2, ...
    p_WK = [1.0, -0.6, 0.5]                                               # camera in the arm's base frame W [m]
    q_WK = [0.2, -0.6, 0.7, -0.3]                                         # (w, x, y, z); z looks ahead, y down

OpenCV's own names `image_width`, `image_height` and `distortion_coefficients` are understood too.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.errors import CameraError
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.pinhole import CameraPose, Pinhole
from turnscrew.geometry.rotations import matrix_from_quaternion, quaternion_from_matrix
from turnscrew.sense.lens import COUNTS, Calibration
from turnscrew.sense.opencv import opencv

KEYS = ("image_size", "camera_matrix", "distortion", "p_WK", "q_WK")
OTHER_NAMES = {"distortion": "distortion_coefficients"}


def read_calibration(path: Path) -> Calibration:
    """Reads a calibration; its format is told by the ending, `.toml` or one of OpenCV's.

    Raises:
        CameraError: The file is missing, unreadable or incomplete, or holds what no camera has.
    """
    if not path.is_file():
        raise CameraError(f"{path}: there is no such calibration file")
    values = _toml(path) if path.suffix == ".toml" else _storage(path)
    missing = [name for name in KEYS if name not in values]
    if missing:
        raise CameraError(f"{path}: {' and '.join(missing)} missing: a calibration has {', '.join(KEYS)}")
    arrays = {name: _array(path, name, values[name]) for name in KEYS}
    return _calibration(path, arrays)


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Writes a calibration as TOML, to the last bit.

    Raises:
        CameraError: The file cannot be written.
    """
    values = {
        "image_size": list(calibration.pinhole.size),
        "camera_matrix": calibration.pinhole.matrix.tolist(),
        "distortion": list(calibration.distortion),
        "p_WK": calibration.pose.p_WK.tolist(),
        "q_WK": quaternion_from_matrix(calibration.pose.R_WK).tolist(),
    }
    try:
        path.write_text("".join(f"{name} = {value}\n" for name, value in values.items()), encoding="utf-8")
    except OSError as error:
        raise CameraError(f"{path}: cannot be written: {error.strerror}") from None


def _toml(path: Path) -> Mapping[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CameraError(f"{path}: cannot be read as TOML: {' '.join(str(error).split())}") from None


def _storage(path: Path) -> Mapping[str, Any]:
    cv2 = opencv()
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        names = storage.root().keys()
        values = {name: _node(storage.getNode(name)) for name in names}
        storage.release()
    except (cv2.error, SystemError):
        raise CameraError(f"{path}: cannot be read: a calibration is TOML, or YAML, XML or JSON of OpenCV") from None
    for name, other in OTHER_NAMES.items():
        if other in values:
            values.setdefault(name, values[other])
    if "image_width" in values and "image_height" in values:
        values.setdefault("image_size", [values["image_width"], values["image_height"]])
    return values


def _node(node: Any) -> Any:
    if node.isSeq():
        return [_node(node.at(index)) for index in range(node.size())]
    if node.isMap():
        return node.mat()
    return node.string() if node.isString() else node.real()


def _array(path: Path, name: str, value: Any) -> Array:
    try:
        array = np.array(value, float)
    except (TypeError, ValueError):
        raise CameraError(f"{path}: {name} = {value!r}: must be numbers") from None
    if not np.isfinite(array).all():
        raise CameraError(f"{path}: {name}: holds what is not a finite number")
    return array


def _calibration(path: Path, given: Mapping[str, Array]) -> Calibration:
    K, size, k = given["camera_matrix"], given["image_size"].ravel(), given["distortion"].ravel()
    p_WK, q_WK = given["p_WK"].ravel(), given["q_WK"].ravel()
    rules: tuple[tuple[Callable[[], bool], str], ...] = (
        (lambda: size.size == 2 and bool((size >= 1).all() and (size % 1 == 0).all()), "image_size: width and height"),
        (lambda: K.shape == (3, 3), "camera_matrix: 3 rows of 3 numbers"),
        (lambda: K[0, 0] > 0 and K[1, 1] > 0, "camera_matrix: positive focal lengths"),
        (
            lambda: K[0, 1] == K[1, 0] == 0 and K[2].tolist() == [0, 0, 1],
            "camera_matrix: [[fx,0,cx],[0,fy,cy],[0,0,1]]",
        ),
        (lambda: k.size in COUNTS, f"distortion: {', '.join(map(str, COUNTS[:-1]))} or {COUNTS[-1]} coefficients"),
        (lambda: p_WK.size == 3, "p_WK: 3 numbers"),
        (lambda: q_WK.size == 4 and bool(abs(q_WK @ q_WK - 1.0) < 1e-3), "q_WK: a unit quaternion (w, x, y, z)"),
    )
    for holds, wish in rules:
        if not holds():
            name, _, what = wish.partition(": ")
            raise CameraError(f"{path}: {name} = {given[name].tolist()}: must be {what}")
    fx, fy, cx, cy = K[0, 0].item(), K[1, 1].item(), K[0, 2].item(), K[1, 2].item()
    pinhole = Pinhole((fx, fy), (cx, cy), (int(size[0]), int(size[1])))
    return Calibration(CameraPose(p_WK, matrix_from_quaternion(q_WK)), pinhole, tuple(k.tolist()))
