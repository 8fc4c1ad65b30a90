"""Real pictures by the same path: a camera, a video, an image or a folder of images, and a calibration file."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.errors import CameraError
from turnscrew.geometry.marker_board import MarkerBoard
from turnscrew.geometry.pinhole import Window
from turnscrew.sense.board import BoardPose
from turnscrew.sense.calibration_file import read_calibration
from turnscrew.sense.fiducials import Fiducials
from turnscrew.sense.opencv import opencv
from turnscrew.sense.sensed import Image
from turnscrew.sense.shutter import Frame
from turnscrew.sense.sight import MarkerSight

IMAGES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm"}
"""Endings of files that are taken as images; a folder's others are passed over."""

RATE = 30.0
"""Frames a second of images that tell no time: the paper's camera [Hz]."""


def see(source: str, calibration: Path, board: MarkerBoard, dictionary: str = "4X4_50") -> Iterator[Frame]:
    """The tool's pose in each picture of a source, as it comes.

    Args:
        source: An image, a folder of images (taken by name, each for itself), a video, or the number of a camera.
        calibration: File as `read_calibration` takes it.
        board: Where the markers are on the tool.
        dictionary: Of the markers.

    Yields:
        Time of the picture since the first [s]; the pose or None; why there is none.

    Raises:
        CameraError: The source or the calibration cannot be read, they do not fit, or OpenCV is missing.
    """
    fiducials = Fiducials(dictionary)
    solver = BoardPose(board, read_calibration(calibration), fiducials.noise)
    sight = MarkerSight(fiducials, solver, patch=None)
    track = sight.init()
    moving = not (Path(source).is_dir() or Path(source).suffix.lower() in IMAGES)
    for stamp, image in pictures(source):
        size = image.shape[1], image.shape[0]
        if size != solver.calibration.pinhole.size:
            wanted = "x".join(map(str, solver.calibration.pinhole.size))
            raise CameraError(f"{source}: image of {size[0]}x{size[1]}, calibrated for {wanted} by {calibration}")
        # images in a folder may show anything: only a video's or a camera's next picture goes on from the last
        track, vision, blind = sight.update(track if moving else sight.init(), stamp, size, partial(_cut, image))
        yield Frame(stamp, vision, blind)


def _cut(image: Image, window: Window) -> Image:
    rows, columns = slice(window.top, window.top + window.height), slice(window.left, window.left + window.width)
    return np.ascontiguousarray(image[rows, columns])


def pictures(source: str) -> Iterator[tuple[float, Image]]:
    """The grey pictures (height, width) of a source, with their times since the first [s].

    Raises:
        CameraError: There is no such source, or it cannot be read.
    """
    path = Path(source)
    if source.isdecimal() and not path.exists():
        yield from _video(opencv().VideoCapture(int(source)), f"camera {source}", live=True)
    elif path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix.lower() in IMAGES)
        if not files:
            raise CameraError(f"{path}: holds no image ({', '.join(sorted(IMAGES))})")
        for count, file in enumerate(files):
            yield count / RATE, _image(file)
    elif not path.is_file():
        raise CameraError(f"{path}: there is no such image, video or folder, nor is it the number of a camera")
    elif path.suffix.lower() in IMAGES:
        yield 0.0, _image(path)
    else:
        yield from _video(opencv().VideoCapture(str(path)), str(path), live=False)


def _image(path: Path) -> Image:
    cv2 = opencv()
    # imread prints what it dislikes; decoding from memory says nothing
    try:
        content = np.frombuffer(path.read_bytes(), np.uint8)
        image: Image | None = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if content.size else None
    except (OSError, cv2.error):
        image = None
    if image is None:
        raise CameraError(f"{path}: cannot be read as an image")
    return image


def _video(capture: Any, name: str, *, live: bool) -> Iterator[tuple[float, Image]]:
    cv2 = opencv()
    try:
        count, first = 0, None
        while True:
            read, picture = capture.read()
            if not read:
                break
            # a file knows its rate; a camera's frames are stamped by its driver, where it does that
            rate = capture.get(cv2.CAP_PROP_FPS) or RATE
            stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3 if live else count / rate
            first = stamp if first is None else first
            yield stamp - first if not live or stamp > 0.0 else count / rate, _grey(picture)
            count += 1
    finally:
        capture.release()
    if not count:
        raise CameraError(f"{name}: cannot be opened, or holds no picture")


def _grey(picture: Image) -> Image:
    cv2 = opencv()
    grey: Image = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    return grey
