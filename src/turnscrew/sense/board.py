"""The tool's pose from the corners of its markers, with its covariance, and the pose it could be mistaken for.

Corner k at `c_k` in T appears, straightened, at `u_k = c + f (x / z, y / z)`, `p_K = R_KW (p_WT + R_WT c_k - p_WK)`.
The pose minimises `sum |u_k - u_k,seen|^2 / sigma_k^2` over p_WT and R_WT; a change (dp, phi) of both in W, phi a
rotation vector on the left, moves the corner by `R_KW (dp + phi x R_WT c_k)`: so much for the Jacobian J (2n, 6).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.marker_board import MarkerBoard
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.sense.fiducials import Sighting
from turnscrew.sense.lens import Calibration
from turnscrew.sense.opencv import opencv

ROUNDS = 12
"""Most Gauss-Newton steps; from a start within 20 deg five are enough."""

SETTLED = 1e-7
"""Steps below this end the refinement [m and rad]: a thousandth of the noise."""

FINE = 18.0
"""Smaller side at which the deviation of a marker's corners has doubled [px].  On 1900 drawn markers from .3 to 1.4 m
the median deviation was .21, .15, .11, .08, .07 px at 11, 15, 20, 32, 65 px; the law gives .22, .15, .11, .08, .06."""

OUTLIER = 4.0
"""A marker whose corners are off by more than so many deviations is half covered or misread, and left out."""

APART = 0.1
"""Two poses are different ones from this angle on [rad]: flips are of 20 deg and more."""


@dataclass(frozen=True, slots=True)
class Posed:
    """A pose that explains what was seen.

    Attributes:
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        P: (6, 6) covariance of the errors of p_WT [m], then of the orientation as a rotation vector in W [rad].
        cost: Sum of squared corner errors, each over its own deviation: chi squared.
        misfit: Root mean square of those, about 1 for a good pose.
        markers: How many markers it explains.
    """

    p_WT: Array
    R_WT: Array
    P: Array
    cost: float
    misfit: float
    markers: int


@dataclass(frozen=True)
class BoardPose:
    """Solves for the pose of a board.

    Attributes:
        board: Where the markers are on the tool.
        calibration: Of the camera.
        noise: Deviation of a corner of a large marker along each axis of the picture [px].
    """

    board: MarkerBoard
    calibration: Calibration
    noise: float

    def known(self, sighting: Sighting) -> Sighting:
        """Those of the markers that are on the board, each at most once."""
        once = [
            row for row, number in enumerate(sighting.ids)
            if number in self.board.ids and np.count_nonzero(sighting.ids == number) == 1
        ]  # fmt: skip
        return Sighting(sighting.ids[once], sighting.corners[once])

    def solve(self, sighting: Sighting, last: tuple[Array, Array] | None = None) -> list[Posed]:
        """Poses that explain the markers, the best first; a second one only where it is another orientation.

        Args:
            sighting: Markers of the board, at least one.
            last: p_WT and R_WT of the frame before, as one more place to start from.
        """
        rows = [self.board.ids.index(int(number)) for number in sighting.ids]
        c_T = self.board.corners[rows]
        seen = self.calibration.straightened(sighting.corners.reshape(-1, 2)).reshape(-1, 4, 2)
        found: list[Posed] = []
        view = _View(c_T, seen, self.noise * _coarseness(seen))
        for p_WT, R_WT in self._starts(c_T, seen) + ([last] if last else []):
            posed = self._refined(p_WT, R_WT, view)
            if posed is not None and all(_angle(posed, other) > APART for other in found):
                found.append(posed)
            elif posed is not None:
                found = [
                    posed if _angle(posed, other) <= APART and posed.cost < other.cost else other for other in found
                ]
        found.sort(key=lambda posed: posed.cost)
        return [self._without_outliers(found[0], view), *found[1:2]] if found else []

    def _starts(self, c_T: Array, seen: Array) -> list[tuple[Array, Array]]:
        """Poses to start from: both of each of the two largest markers, and one of all corners together."""
        cv2 = opencv()
        K, none = self.calibration.pinhole.matrix, np.zeros(4)
        areas = [abs(cv2.contourArea(square.astype(np.float32))) for square in seen]
        starts = []
        for row in np.argsort(areas)[-2:]:
            R_TM, p_TM, half = _marker_frame(c_T[row])
            square = half * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0]])
            _, rotations, positions, _ = cv2.solvePnPGeneric(square, seen[row], K, none, flags=cv2.SOLVEPNP_IPPE_SQUARE)
            for rotation, p_KM in zip(rotations, positions, strict=True):
                R_KT = exp_so3(rotation.ravel()) @ R_TM.T
                starts.append(self._in_world(p_KM.ravel() - R_KT @ p_TM, R_KT))
        if len(c_T) > 1:
            solved, rotation, p_KT = cv2.solvePnP(
                c_T.reshape(-1, 3), seen.reshape(-1, 2), K, none, flags=cv2.SOLVEPNP_SQPNP
            )
            if solved:
                starts.append(self._in_world(p_KT.ravel(), exp_so3(rotation.ravel())))
        return starts

    def _in_world(self, p_KT: Array, R_KT: Array) -> tuple[Array, Array]:
        pose = self.calibration.pose
        return pose.p_WK + pose.R_WK @ p_KT, pose.R_WK @ R_KT

    def _refined(self, p_WT: Array, R_WT: Array, view: _View) -> Posed | None:
        """The nearest minimum, by Gauss-Newton; None where it runs behind the camera or settles nowhere."""
        for _ in range(ROUNDS):
            linear = self._linearised(p_WT, R_WT, view)
            if linear is None:
                return None
            J, residual = linear
            step = np.asarray(np.linalg.solve(J.T @ J + 1e-6 * np.eye(6), J.T @ residual), float)
            p_WT, R_WT = p_WT - step[:3], exp_so3(-step[3:]) @ R_WT
            if np.abs(step).max() < SETTLED:
                break
        linear = self._linearised(p_WT, R_WT, view)
        if linear is None:
            return None
        J, residual = linear
        cost = float(residual @ residual)
        # corners that fit worse than they should widen the covariance; that they fit well by chance does not narrow it
        spread = max(1.0, cost / (len(residual) - 6))
        P = np.asarray(spread * np.linalg.inv(J.T @ J + 1e-6 * np.eye(6)), float)
        return Posed(p_WT, R_WT, P, cost, float(np.sqrt(cost / len(residual))), len(view.sigma))

    def _linearised(self, p_WT: Array, R_WT: Array, view: _View) -> tuple[Array, Array] | None:
        """Jacobian (2n, 6) and residual (2n,) of the corners in deviations; None with a corner behind the camera."""
        pose, f = self.calibration.pose, np.array(self.calibration.pinhole.f)
        arms = view.c_T.reshape(-1, 3) @ R_WT.T
        p_K = pose.seen(p_WT + arms)
        z = p_K[:, 2]
        if z.min() < 1e-3:
            return None
        sigma = np.repeat(view.sigma, 4)[:, None]
        residual = (self.calibration.pinhole.project(p_K) - view.seen.reshape(-1, 2)) / sigma
        # of both pixel coordinates by p_K, then by a shift of the corner in W
        by_K = np.zeros((len(z), 2, 3))
        by_K[:, 0, 0], by_K[:, 1, 1] = f[0] / z, f[1] / z
        by_K[:, :, 2] = -f * p_K[:, :2] / (z**2)[:, None]
        by_W = by_K @ pose.R_WK.T / sigma[:, :, None]
        J = np.empty((len(z), 2, 6))
        J[:, :, :3] = by_W
        x, y, w = arms.T[:, :, None]
        J[:, :, 3] = by_W[:, :, 2] * y - by_W[:, :, 1] * w
        J[:, :, 4] = by_W[:, :, 0] * w - by_W[:, :, 2] * x
        J[:, :, 5] = by_W[:, :, 1] * x - by_W[:, :, 0] * y
        return J.reshape(-1, 6), residual.ravel()

    def _without_outliers(self, posed: Posed, view: _View) -> Posed:
        """The pose without the markers that contradict it, as long as two are left."""
        while len(view.sigma) > 2:
            linear = self._linearised(posed.p_WT, posed.R_WT, view)
            if linear is None:
                return posed
            off = np.sqrt(np.mean(linear[1].reshape(-1, 8) ** 2, axis=1))
            worst = int(np.argmax(off))
            if off[worst] < OUTLIER:
                return posed
            view = _View(*(np.delete(part, worst, axis=0) for part in view))
            posed = self._refined(posed.p_WT, posed.R_WT, view) or posed
        return posed


class _View(NamedTuple):
    """Corners of m markers: on the tool (m, 4, 3) [m], in the picture (m, 4, 2) and their deviations (m,) [px]."""

    c_T: Array
    seen: Array
    sigma: Array


def _coarseness(seen: Array) -> Array:
    """By how much the corners of markers (m, 4, 2) are worse than a large one's: 1 + (FINE / smaller side)^2."""
    sides = np.linalg.norm(np.roll(seen, -1, axis=1) - seen, axis=2)
    diagonals = seen[:, 2] - seen[:, 0], seen[:, 3] - seen[:, 1]
    area = np.abs(diagonals[0][:, 0] * diagonals[1][:, 1] - diagonals[0][:, 1] * diagonals[1][:, 0]) / 2
    return np.asarray(1.0 + (FINE * sides.max(axis=1) / np.maximum(area, 1.0)) ** 2)


def _marker_frame(corners: Array) -> tuple[Array, Array, float]:
    """R_TM, p_TM and half the side of a marker: M in its middle, x to the right, y up, z outwards as printed."""
    right, up = corners[1] - corners[0], corners[0] - corners[3]
    side = float(np.sqrt(right @ right))
    x, y = right / side, up / side
    z = np.array([x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]])
    return np.column_stack([x, y, z]), corners.mean(axis=0), side / 2


def _angle(one: Posed, other: Posed) -> float:
    """Angle between two orientations [rad]."""
    phi = log_so3(one.R_WT @ other.R_WT.T)
    return float(np.sqrt(phi @ phi))
