"""OpenCV, which only the marker camera needs: asked for where it is used, so that everything else runs without it."""

from __future__ import annotations

from types import ModuleType

from turnscrew.errors import CameraError


def opencv() -> ModuleType:
    """The module `cv2`.

    Raises:
        CameraError: It is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise CameraError(f"markers are found by OpenCV, and {error}: pip install 'turnscrew[vision]'") from None
    return cv2
