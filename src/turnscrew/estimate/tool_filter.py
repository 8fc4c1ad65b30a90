"""Error-state extended Kalman filter of the tool's pose, the screw's place, the radius and the joint offsets.

The paper's constraints (1) and (2) taken as measurements instead of boxes: tip at the screw, zero distance at each
touching fingertip, and the camera.  The learned b, radius and offsets are what makes the constraints true enough
for III-A to be feasible.

Paper: no counterpart; the paper feeds (6) with uncorrected kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.estimate.filter_state import OFFSET_COLUMNS, OFFSETS, RADIUS, SCREW, SIZE, THETA, TIP, FilterState
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.closest import ClosestPoints, gap_gradient
from turnscrew.geometry.rotations import exp_so3, log_so3

GATE = {1: 25.0, 3: 31.8}
"""Squared Mahalanobis distance of a 5-sigma outlier: as improbable (6e-7) in three dimensions as 25 is in one."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Measurements stacked, each block gated as a whole.

    Attributes:
        H: (m, 27) derivative of the prediction by the errors.
        z: (m,) innovation: measured less predicted.
        variance: (m,) of the measurement noise.
        blocks: Sizes of the blocks, 1 or 3, in order.
    """

    H: Array
    z: Array
    variance: Array
    blocks: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the gates said of each block: accepted or not, and its normalised innovation squared."""

    accepted: tuple[bool, ...]
    nis: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ToolFilter:
    """Noise of motion and measurements.

    Attributes:
        vision_position: Camera noise per axis [m].
        vision_rotation: Camera noise per axis [rad].
        tip: Of the tip about the drive's bottom centre [m]: play of the blade in the slot.
        contact: Of a touching fingertip's distance [m]: encoder noise (.1 mm), penetration (.16 mm at 10 N), and what
            the constant offsets do not model.
        scale_error: Relative error of odometry: 3 %, from radius and joint offsets,
        stroke_time: which stays the same for as long as a stroke takes [s].
        tilt_drift: Random walk of the orientation while gripped [rad/sqrt(s)]: fingers that creep by .2 mm in a second
            tilt a tool that they hold 130 mm above its tip by .1 deg,
        yaw_drift: and turn one of 18 mm radius by .4 deg (two of them, against each other) [rad/sqrt(s)].
        free_drift: The same for any axis with fewer than two fingers touching [rad/sqrt(s)].
        tip_drift: Random walk of the tip [m/sqrt(s)]: it may wander in the slot, .3 mm in a second.
        constants_drift: Random walk of b [m/sqrt(s)], and a tenth of it of the radius; keeps the filter from getting
            surer than its linear model deserves.
        offset_drift: The same of the joint offsets [rad/sqrt(s)].
    """

    vision_position: float = 0.003
    vision_rotation: float = np.deg2rad(2.0)
    tip: float = 0.0003
    contact: float = 0.0004
    scale_error: float = 0.03
    stroke_time: float = 1.0
    tilt_drift: float = np.deg2rad(0.1)
    yaw_drift: float = np.deg2rad(0.4)
    free_drift: float = np.deg2rad(3.0)
    tip_drift: float = 0.0003
    constants_drift: float = 0.0001
    offset_drift: float = np.deg2rad(0.03)

    def predict(
        self, state: FilterState, dtheta: Array, dp: Array, omega_W: Array, gripped: bool, dt: float
    ) -> FilterState:
        """Move by odometry.

        The rotation is measured in W, so an error of orientation turns along with the tool:
        theta' = exp([dtheta]x) theta.

        Args:
            state: Before.
            dtheta: (3,) rotation vector in W [rad].
            dp: (3,) travel of the tip in W [m].
            omega_W: (3,) low-passed angular velocity in W [rad/s]; dtheta itself is mostly encoder noise, which does
                not add up and must not be taken for travel.
            gripped: Whether two fingers or more touch.
            dt: [s].
        """
        turn = exp_so3(dtheta)
        P = state.P.copy()
        P[THETA] = turn @ P[THETA]
        P[:, THETA] = P[:, THETA] @ turn.T
        noise = np.empty(SIZE)
        noise[THETA] = dt * (self.tilt_drift if gripped else self.free_drift) ** 2
        noise[TIP] = dt * self.tip_drift**2
        noise[SCREW], noise[RADIUS] = dt * self.constants_drift**2, dt * (0.1 * self.constants_drift) ** 2
        noise[OFFSETS] = dt * self.offset_drift**2
        P.flat[:: SIZE + 1] += noise
        if gripped:
            z = state.R_WT[:, 2]
            P[THETA, THETA] += dt * self.yaw_drift**2 * (z[:, None] * z)
        P[THETA, THETA] += dt * self.stroke_time * self.scale_error**2 * (omega_W[:, None] * omega_W)
        return FilterState(state.p_WT + dp, turn @ state.R_WT, state.b_W, state.radius_error, state.offset, P)

    def vision_rows(self, state: FilterState, p_WT: Array, R_WT: Array) -> Rows:
        """Camera pose, already brought to now: blocks position and rotation."""
        H = np.zeros((6, SIZE))
        H[:3, TIP] = H[3:, THETA] = np.eye(3)
        z = np.concatenate([p_WT - state.p_WT, log_so3(R_WT @ state.R_WT.T)])
        return Rows(H, z, np.array([self.vision_position**2] * 3 + [self.vision_rotation**2] * 3), (3, 3))

    def tip_rows(self, state: FilterState, p_WS: Array) -> Rows:
        """p_WT = p_WS + b: one block.

        Args:
            state: Now.
            p_WS: (3,) where the drive's bottom centre was said to be, in W [m].

        Paper: (1).
        """
        H = np.zeros((3, SIZE))
        H[:, TIP], H[:, SCREW] = np.eye(3), -np.eye(3)
        return Rows(H, p_WS + state.b_W - state.p_WT, np.full(3, self.tip**2), (3,))

    def contact_rows(self, state: FilterState, points: list[ClosestPoints], p_WF: list[Array], J: list[Array]) -> Rows:
        """Zero distance of each touching fingertip: one block each.

        A fingertip moves by J (-d offset), for an offset estimated too large has been taken off the reading.

        Args:
            state: Now.
            points: Closest points to the handle without its radius error.
            p_WF: Fingertip centres in W, (3,) each [m].
            J: Their Jacobians, (6, 28) each.

        Paper: (2).
        """
        H, z = np.zeros((len(points), SIZE)), np.empty(len(points))
        for row, (point, p, jacobian) in enumerate(zip(points, p_WF, J, strict=True)):
            tool, finger = gap_gradient(point, state.p_WT, p)
            H[row, TIP], H[row, THETA] = tool[:3], tool[3:]
            H[row, RADIUS] = -1.0
            H[row, OFFSETS] = -(finger @ jacobian)[OFFSET_COLUMNS]
            z[row] = state.radius_error - point.gap
        return Rows(H, z, np.full(len(points), self.contact**2), (1,) * len(points))

    def update(self, state: FilterState, rows: Rows) -> tuple[FilterState, Verdict]:
        """Take in measurements; blocks beyond the 5-sigma gate are left out and reported."""
        HP = rows.H @ state.P
        S = HP @ rows.H.T
        S.flat[:: len(S) + 1] += rows.variance
        accepted, nis, keep, start = [], [], [], 0
        for size in rows.blocks:
            block = slice(start, start + size)
            z = rows.z[block]
            nis.append(float(z @ np.linalg.solve(S[block, block], z)))
            accepted.append(nis[-1] <= GATE[size])
            keep += list(range(start, start + size)) if accepted[-1] else []
            start += size
        verdict = Verdict(tuple(accepted), tuple(nis))
        if not keep:
            return state, verdict
        HP, S, z = HP[keep], S[keep][:, keep], rows.z[keep]
        gain = np.linalg.solve(S, HP).T
        P = state.P - gain @ HP
        return state.corrected(gain @ z, 0.5 * (P + P.T)), verdict


def stacked(*parts: Rows) -> Rows:
    """Several measurements as one."""
    return Rows(
        np.vstack([part.H for part in parts]),
        np.concatenate([part.z for part in parts]),
        np.concatenate([part.variance for part in parts]),
        sum((part.blocks for part in parts), ()),
    )
