"""From pictures to poses, frame after frame: where to look, what to make of it, and what not to believe.

The same path serves drawn and real pictures: whoever has them hands out grey windows of the full image.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.pinhole import Window, window_around
from turnscrew.geometry.rotations import log_so3
from turnscrew.sense.board import BoardPose, Posed
from turnscrew.sense.fiducials import Fiducials, Sighting
from turnscrew.sense.sensed import Image
from turnscrew.signals import Vision

Take: TypeAlias = Callable[[Window], Image]
"""Hands out a grey window of a frame."""

Pose: TypeAlias = tuple[Array, Array]

MARGIN = 0.01
"""How far around where the markers were last seen they are looked for, at first [m]: what .3 m/s moves in a frame."""

WIDENED = 3
"""Misses after which the window, doubled each time, is given up for the whole image, patch after patch."""

PATCH = (640, 720)
"""Largest patch that is searched in one frame [px]: 4K takes 18, six tenths of a second at 30 Hz, some 30 ms each."""

FEWEST = 2
"""Markers that a pose needs: a single one of 12 mm gives the tip to a centimetre and flips."""

WORST = 5.0
"""Corners that are off by more than so many deviations are no picture of this board."""

RIVAL = 25.0
"""Two poses are told apart by vision if their costs (chi squared) differ by more: five deviations."""

TURN, SHIFT = np.deg2rad(6.0), 0.015
"""A pose is believed at once within this of the last one [rad, m]: four times the largest errors at 1 m, a fifth of a
flip ..."""

TURN_RATE, SHIFT_RATE, RECENT = 1.0, 0.05, 0.3
"""... plus this for each second since [rad/s, m/s], for so long at most [s]: the fastest roll, and what a gripped tool
is moved at.  The sum stays below a flip's 30 deg."""

PERSISTS = 10
"""Frames in a row after which a pose that contradicts the last one is the new truth: a third of a second, twice as
long as markers were seen to flip in a row."""

ASK_OTHERS = 10
"""Every so many blind frames other dictionaries are tried."""


@dataclass(frozen=True, slots=True)
class Track:
    """What is remembered from frame to frame.

    Attributes:
        pose: p_WT and R_WT believed last, or where the tool is expected; None if nothing is known.
        stamp: When it was believed [s]; minus infinity for an expectation.
        missed: Frames since then without any marker.
        rival: Pose that contradicts it, if the last frames agreed on one.
        agreed: How many frames have agreed on the rival.
        others: Dictionary whose markers were found instead, or nothing.
    """

    pose: Pose | None = None
    stamp: float = -np.inf
    missed: int = 0
    rival: Pose | None = None
    agreed: int = 0
    others: str = ""


@dataclass(frozen=True)
class MarkerSight:
    """Follows the tool by its markers.

    Attributes:
        fiducials: The dictionary.
        solver: Board and calibration.
        expected: p_WT and R_WT near which the tool is looked for first, if there is an expectation.
        patch: Largest piece of an image that is searched in one frame [px]; None searches it all at once.
    """

    fiducials: Fiducials
    solver: BoardPose
    expected: Pose | None = None
    patch: tuple[int, int] | None = PATCH

    def init(self) -> Track:
        """Nothing seen yet."""
        return Track(self.expected)

    def update(self, track: Track, stamp: float, size: tuple[int, int], take: Take) -> tuple[Track, Vision | None, str]:
        """Looks at a frame.

        Args:
            track: Of the frame before.
            stamp: Time of exposure [s].
            size: Width and height of the full image [px].
            take: Hands out windows of it.

        Returns:
            What to remember; the pose, if one is believed; and otherwise why there is none.
        """
        calibrated = self.solver.calibration.pinhole.size
        if size != calibrated:
            return track, None, f"image of {size[0]}x{size[1]}, calibrated for {calibrated[0]}x{calibrated[1]}"
        window = self._where(track)
        image = take(window)
        sighting = self._found(image, window, take)
        if not len(sighting.ids):
            return self._missed(track, image)
        last = track.pose if np.isfinite(track.stamp) else None
        posed, blind = self._posed(sighting, last)
        if posed is None:
            return replace(track, missed=0 if track.missed < WIDENED else track.missed), None, blind
        return self._judged(track, posed, stamp)

    def _where(self, track: Track) -> Window:
        """Around the markers' expected place, wider after each miss, at last anywhere."""
        calibration = self.solver.calibration
        whole = calibration.pinhole.image
        if track.pose is not None and track.missed <= WIDENED:
            p_WT, R_WT = track.pose
            p_W = p_WT + self.solver.board.corners.reshape(-1, 3) @ R_WT.T
            z = calibration.pose.seen(p_W)[:, 2]
            if z.min() > 0.05:
                margin = MARGIN * 2**track.missed * calibration.pinhole.f[0] / float(z.min())
                window = window_around(calibration.project(p_W), margin).within(*whole[2:])
                if window.width > 0 and window.height > 0:
                    return window
        if self.patch is None:
            return whole
        return _patch(whole, self.patch, track.missed)

    def _found(self, image: Image, window: Window, take: Take) -> Sighting:
        """Markers of the board in the full image's pixels, the corners found at full precision."""
        sighting = self._shifted(self.fiducials.find(image), window)
        if len(sighting.ids) and not self.fiducials.fine(image):
            # found in a large picture: look again at the place itself
            spread = sighting.corners.reshape(-1, 2)
            side = float(np.ptp(spread, axis=0).max())
            window = window_around(spread, 0.5 * side).within(*self.solver.calibration.pinhole.size)
            sighting = self._shifted(self.fiducials.find(take(window)), window)
        return sighting

    def _shifted(self, sighting: Sighting, window: Window) -> Sighting:
        known = self.solver.known(sighting)
        return Sighting(known.ids, known.corners + np.array([window.left, window.top]))

    def _missed(self, track: Track, image: Image) -> tuple[Track, None, str]:
        missed = track.missed + 1
        others = self.fiducials.others(image) if missed % ASK_OTHERS == WIDENED else track.others
        name = self.fiducials.dictionary
        blind = f"markers of another dictionary: {others}?" if others else f"no marker of {name} in view"
        return replace(track, missed=missed, others=others), None, blind

    def _posed(self, sighting: Sighting, last: Pose | None) -> tuple[Posed | None, str]:
        """The pose that the markers tell, or why they tell none."""
        if len(sighting.ids) < FEWEST:
            return None, f"{len(sighting.ids)} marker in view, {FEWEST} needed"
        found = self.solver.solve(sighting, last)
        if not found:
            return None, "no pose explains the markers"
        best = found[0]
        if best.misfit > WORST:
            return None, f"corners fit no pose: {best.misfit:.0f} times their noise away"
        if len(found) > 1 and found[1].cost - best.cost < RIVAL:
            # the one before tells which of the two it is, if exactly one goes on from there
            near = [] if last is None else [one for one in found if _distance((one.p_WT, one.R_WT), last)[0] < TURN]
            if len(near) != 1:
                return None, "ambiguous pose"
            best = near[0]
        return best, ""

    def _judged(self, track: Track, posed: Posed, stamp: float) -> tuple[Track, Vision | None, str]:
        """Believes a pose that goes on from the last one, or one that persists."""
        pose = posed.p_WT, posed.R_WT
        since = stamp - track.stamp
        if track.pose is not None and np.isfinite(since):
            turn, shift = _distance(pose, track.pose)
            if not _near(pose, track.pose, since):
                agreed = track.agreed + 1 if track.rival is not None and _near(pose, track.rival, 0.0) else 1
                if agreed < PERSISTS:
                    blind = f"pose jumped by {np.rad2deg(turn):.0f} deg and {1e3 * shift:.0f} mm"
                    return replace(track, missed=0, rival=pose, agreed=agreed), None, blind
        return Track(pose, stamp), Vision(stamp, posed.p_WT, posed.R_WT, posed.P), ""


def _near(pose: Pose, other: Pose, since: float) -> bool:
    turn, shift = _distance(pose, other)
    time = min(since, RECENT)
    return turn < TURN + TURN_RATE * time and shift < SHIFT + SHIFT_RATE * time


def _distance(pose: Pose, other: Pose) -> tuple[float, float]:
    """Angle [rad] and distance of the tips [m] between two poses."""
    phi, gap = log_so3(pose[1] @ other[1].T), pose[0] - other[0]
    return float(np.sqrt(phi @ phi)), float(np.sqrt(gap @ gap))


def _patch(whole: Window, largest: tuple[int, int], turn: int) -> Window:
    """One of the patches that cover an image, in turn, overlapping by what a collar may take."""
    columns, rows = -(-whole.width // largest[0]), -(-whole.height // largest[1])
    column, row = turn % columns, turn // columns % rows
    width, height = -(-whole.width // columns), -(-whole.height // rows)
    return Window(column * width, row * height, width, height).grown(100).within(whole.width, whole.height)
