"""ArUco markers in a grey picture: which ones, and where their corners are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from turnscrew.errors import CameraError
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.sense.edges import refined
from turnscrew.sense.opencv import opencv
from turnscrew.sense.sensed import Image

WIDELY_USED = ("4X4_1000", "5X5_1000", "6X6_1000", "7X7_1000", "APRILTAG_36h11", "APRILTAG_16h5", "ARUCO_ORIGINAL")
"""Dictionaries that `others` tries; each of the numbered ones begins with its smaller sisters."""

SHOWN = 2
"""Markers of another dictionary that make it worth a word: a single one may be chance."""


ENLARGED, LARGE = 3, 400_000
"""Pictures of up to LARGE pixels are enlarged so many times before the search.  Of OpenCV's refinements `contour` on a
threefold picture erred least at .4, .65 and 1 m, by .25 px a corner (`subpix` .35, `apriltag` .25 with a bias of half
an enlarged pixel and a fifth fewer markers, none .35; by .6 px all of them on the picture as it is); crossing edges
(`turnscrew.sense.edges`) thereafter leave .15 px."""

SMALLEST = 0.005
"""Least perimeter of a marker, of the picture's larger side: 20 px in the whole image of 4K, where cells blur."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """Markers found in a picture.

    Attributes:
        ids: (m,) which ones.
        corners: (m, 4, 2) their corners: upper left, upper right, lower right, lower left as printed [px].
    """

    ids: NDArray[np.int_]
    corners: Array


@dataclass(frozen=True, slots=True)
class Fiducials:
    """Finds the markers of a dictionary.

    Attributes:
        dictionary: OpenCV's name without `DICT_`, as in `4X4_50`.
        edges: Whether corners are refined by `turnscrew.sense.edges`, or by OpenCV alone.

    Raises:
        CameraError: OpenCV is missing or knows no such dictionary.
    """

    dictionary: str = "4X4_50"
    edges: bool = True

    def __post_init__(self) -> None:
        _dictionary(self.dictionary)

    def cells(self, ids: Sequence[int]) -> Flags:
        """(n, k, k) which cells of the markers are white, black border included.

        Raises:
            CameraError: The dictionary has no marker of such an id.
        """
        dictionary = _dictionary(self.dictionary)
        have = len(dictionary.bytesList)
        if max(ids) >= have:
            raise CameraError(f"dictionary {self.dictionary!r} has {have} markers, too few for {max(ids) + 1}")
        k = dictionary.markerSize + 2
        return np.array([opencv().aruco.generateImageMarker(dictionary, number, k) > 127 for number in ids])

    def find(self, image: Image) -> Sighting:
        """All markers of the dictionary in a grey picture, corners refined to fractions of a pixel."""
        scale = ENLARGED if self.fine(image) else 1
        cv2 = opencv()
        searched = image if scale == 1 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        corners, ids = _detected(self.dictionary, searched)
        if not len(ids):
            return Sighting(np.zeros(0, int), np.zeros((0, 4, 2)))
        # pixel centres are whole numbers before and after, so enlarging does not only multiply
        pixels = (np.array(corners, float).reshape(-1, 4, 2) + 0.5) / scale - 0.5
        return Sighting(ids.ravel().astype(int), refined(image, pixels) if scale > 1 and self.edges else pixels)

    @property
    def noise(self) -> float:
        """Deviation of a large marker's corners along each axis of the picture [px]: measured on drawn pictures."""
        return 0.06 if self.edges else 0.2

    @staticmethod
    def fine(image: Image) -> bool:
        """Whether a picture is small enough for corners to be found at full precision."""
        return image.size <= LARGE

    def others(self, image: Image) -> str:
        """Name of another widely used dictionary whose markers are in the picture; empty if there is none."""
        for name in WIDELY_USED:
            foreign = name.partition("_")[0] != self.dictionary.partition("_")[0] or "APRILTAG" in name
            if foreign and name != self.dictionary and len(_detected(name, image)[1]) >= SHOWN:
                return name
        return ""


def _dictionary(name: str) -> Any:
    aruco = opencv().aruco
    known = sorted(name.removeprefix("DICT_") for name in dir(aruco) if name.startswith("DICT_"))
    if name not in known:
        raise CameraError(f"there is no marker dictionary {name!r}: OpenCV knows {', '.join(known)}")
    return aruco.getPredefinedDictionary(getattr(aruco, f"DICT_{name}"))


def _detected(name: str, image: Image) -> tuple[Any, Any]:
    """Corners and numbers of a dictionary's markers.

    OpenCV fails, instead of rejecting it, at a candidate one of whose sides has less than two pixels of contour.
    Corners are then taken as they are found, to a pixel.
    """
    try:
        corners, ids, _ = _detector(name, True).detectMarkers(image)
    except opencv().error:
        corners, ids, _ = _detector(name, False).detectMarkers(image)
    return corners, () if ids is None else ids


@lru_cache(maxsize=2 * len(WIDELY_USED) + 4)
def _detector(name: str, refining: bool) -> Any:
    aruco = opencv().aruco
    parameters = aruco.DetectorParameters()
    parameters.cornerRefinementMethod = aruco.CORNER_REFINE_CONTOUR if refining else aruco.CORNER_REFINE_NONE
    parameters.minMarkerPerimeterRate = SMALLEST
    return aruco.ArucoDetector(_dictionary(name), parameters)
