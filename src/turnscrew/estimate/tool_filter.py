"""Error-state extended Kalman filter of the tool's pose, the screw's place, the radius and the joint offsets.

The paper's constraints (1) and (2) taken as measurements instead of boxes: tip at the screw, the depth to which its
force presses each touching fingertip, and the camera.  The learned b, radius and offsets are what makes the
constraints true enough for III-A to be feasible.

Errors that last are states, for they do not average out: the smoothed noise of the arm's encoders moves all fingertips
together for a tenth of a second, and a camera may see neighbouring frames wrong alike.

Paper: no counterpart; the paper feeds (6) with uncorrected kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import exp, tanh

import numpy as np

from turnscrew.estimate.error_flow import flow
from turnscrew.estimate.filter_state import (
    OFFSETS,
    RADIUS,
    SCREW,
    SEEN,
    SIZE,
    SLIDE,
    THETA,
    TIP,
    FilterState,
)
from turnscrew.estimate.gated_step import Rows, Verdict, gated_step
from turnscrew.estimate.measured_rows import camera, contacts
from turnscrew.estimate.odometry import Rolled
from turnscrew.estimate.trail import Seen
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import ARM, WRIST


@dataclass(frozen=True, slots=True)
class ToolFilter:
    """Noise of motion and measurements.

    Contacts count the fingers' readings as if they were not smoothed: what is left of their noise lasts two ticks.

    Attributes:
        encoder: Noise of a reading of the hand's joints [rad],
        arm_encoder: and of the arm's.
        arm_time: Time constant with which the arm's readings are smoothed [s],
        wrist_time: and the wrist's, whose noise is counted as if it lasted as long as the arm's.
        tip: Of the tip about the drive's bottom centre [m]: play of the blade in the slot.
        indentation: By how much a fingertip sinks in [m/N]: .1 mm at 5 N, a firm rubber skin on a hard handle,
        indentation_error: and the relative error of that: a force that is known to 25 %, and a skin as well.
        contact: Of a touching fingertip's distance [m], besides encoders and indentation: shape of skin and handle,
            and what is left of the kinematics' bend.  It is the same for as long as the posture is, a second: .05 mm
            thirty times over count as .05 sqrt(30).
        alike: In how many frames the contact's bend is the same: until the camera has averaged its own noise away.
        slide_drift: Random walk of the share of a roll by which the handle slides, over the angle of a stroke:
            strokes of the simulated hand differ by .2 % to .3 %.
        stroke: That angle [rad].
        tilt_drift: Random walk of the orientation while gripped [rad/sqrt(s)]; measured likewise: .04 deg,
        yaw_drift: and about the tool's axis [rad/sqrt(s)]: .2 deg, and half of it again for the noise of the fingers'
            encoders, of which smoothing leaves .08 deg in every reading.
        free_drift: The same for any axis with fewer than two fingers touching [rad/sqrt(s)].
        tip_drift: Random walk of the tip [m/sqrt(s)]: it wanders in the slot by its play.
        constants_drift: Random walk of b [m/sqrt(s)], and a tenth of it of the radius; keeps the filter from getting
            surer than its linear model deserves.
        offset_drift: The same of the joint offsets [rad/sqrt(s)].
        carried_tilt: What odometry errs by while it carries a late frame to now [rad]; found by trial: .04 and .08 deg
            estimate alike,
        carried_yaw: and about the tool's axis: the fingers' encoders, .08 deg at either end, and sliding [rad]; with
            .1 deg the filter was found too sure of the yaw (normalised squared error 1.4 of 1).
        sharpest: No frame is taken for better than this [m]: blade and collar are not one rigid piece.
        common: Share of a frame's variance that its neighbours share: 0 for noise that is drawn afresh for each, most
            of it for markers, whose corners are wrong by lens, print and lighting alike while the tool stands still.
        common_time: How long they do [s]: the time of a stroke, which shows the camera other markers.
    """

    encoder: float = np.deg2rad(0.05)
    arm_encoder: float = np.deg2rad(0.005)
    arm_time: float = 1.5
    wrist_time: float = 0.5
    tip: float = 0.0003
    indentation: float = 2e-5
    indentation_error: float = 0.35
    contact: float = 0.0003
    alike: float = 30.0
    slide_drift: float = 0.003
    stroke: float = 0.8
    tilt_drift: float = np.deg2rad(0.05)
    yaw_drift: float = np.deg2rad(0.3)
    free_drift: float = np.deg2rad(3.0)
    tip_drift: float = 0.0002
    constants_drift: float = 0.00002
    offset_drift: float = np.deg2rad(0.02)
    carried_tilt: float = np.deg2rad(0.08)
    carried_yaw: float = np.deg2rad(0.2)
    sharpest: float = 0.0001
    common: float = 0.0
    common_time: float = 1.0

    def predict(
        self, state: FilterState, rolled: Rolled, dp: Array, spin: float, reach: Array, gripped: bool, dt: float
    ) -> FilterState:
        """Move by odometry.

        Errors of orientation turn along with the tool.  Odometry turns it about the believed tip by the believed way of
        the fingertips, so errors of tip p, joint offsets o and hand h become errors of orientation as it turns:

            theta' = exp([dtheta]x) theta + G dtheta x (p + h) - D o - G (h' - h) - psi s,    h' = a h + w.

        Without the second term a lean that is believed of a tip in the wrong place would turn along with the tool,
        whose true axis stays where the fingers have it.  h is an Ornstein-Uhlenbeck process.  psi is the rotation about
        the tool's axis, of which the share s is lost.

        Args:
            state: Before.
            rolled: Of the odometry, slowed by the share that is believed to be lost; G is its `per_shift`, D its
                `per_offset`.
            dp: (3,) travel of the tip in W [m].
            spin: Low-passed yaw rate [rad/s]; dtheta itself is mostly encoder noise, which does not add up and must
                not be taken for travel.
            reach: (3, 6) linear Jacobian of the hand's middle by arm and wrist, in W [m].
            gripped: Whether two fingers or more touch.
            dt: [s].
        """
        drift = self.tilt_drift if gripped else self.free_drift
        keep = exp(-dt / self.arm_time)
        turn, P = flow(
            state.P, rolled.dtheta, rolled.per_shift, rolled.per_offset, state.R_WT, state.hand_W, keep,
            reach, (1.0 - keep * keep) * self._left(dt), self._walk(drift, spin, dt),
            dt * self.yaw_drift**2 if gripped else 0.0,
        )  # fmt: skip
        return FilterState(
            p_WT=state.p_WT + dp,
            R_WT=turn @ state.R_WT,
            b_W=state.b_W,
            radius_error=state.radius_error,
            offset=state.offset,
            hand_W=keep * state.hand_W,
            seen_W=state.seen_W,
            slide=state.slide,
            blind=state.blind + dt,
            P=P,
        )

    def _walk(self, drift: float, spin: float, dt: float) -> Array:
        """(37,) variances that random walks add in dt, `drift` that of the orientation [rad/sqrt(s)]."""
        noise = _steady_walk(drift, self.tip_drift, self.constants_drift, self.offset_drift, dt).copy()
        noise[SLIDE] = dt * self.slide_drift**2 * abs(spin) / self.stroke
        return noise

    def _left(self, dt: float) -> Array:
        """(6,) variance that smoothing leaves in the readings of arm and wrist [rad^2]."""
        return _left(self.arm_encoder, self.encoder, self.arm_time, self.wrist_time, dt)

    def lasting(self, state: FilterState, P_frame: Array) -> FilterState:
        """The camera's lasting error moved on to a new frame: a share `common` of its covariance P_frame (6, 6)."""
        keep = exp(-state.blind / self.common_time)
        P = state.P.copy()
        P[SEEN] *= keep
        P[:, SEEN] *= keep
        # before the first frame nothing is known of it
        fresh = 1.0 - keep * keep if P[SEEN, SEEN].any() else 1.0
        P[SEEN, SEEN] += fresh * self.common * P_frame
        return replace(state, seen_W=keep * state.seen_W, blind=0.0, P=P)

    def vision_rows(self, state: FilterState, seen: Seen) -> Rows:
        """Camera pose, already brought to now: one block, position and rotation."""
        z, R = camera(
            seen.pose.p_WT, seen.pose.R_WT, seen.P, state.p_WT, state.R_WT, state.seen_W,
            1.0 - self.common, self.sharpest, self.carried_tilt, self.carried_yaw,
        )  # fmt: skip
        return Rows(_CAMERA if self.common > 0.0 else _CAMERA_FRESH, z, R, (6,))

    def tip_rows(self, state: FilterState, p_WS: Array) -> Rows:
        """p_WT = p_WS + b: one block.

        Args:
            state: Now.
            p_WS: (3,) where the drive's bottom centre was said to be, in W [m].

        Paper: (1).
        """
        return Rows(_TIP_AT_SCREW, p_WS + state.b_W - state.p_WT, self.tip**2 * _EYE[:3, :3], (3,))

    def contact_rows(self, state: FilterState, P: Array, points: Array, p_WF: Array, J: Array, force: Array) -> Rows:
        """Each touching fingertip is as deep in the handle as its force presses it: one block each.

        A fingertip moves by J (-d offset), for an offset estimated too large has been taken off the reading.  The gap
        also grows with the square of how far the contact slides around the handle, s: by kappa s^2 / 2.  That is not
        known until the camera has told where the handle is; its mean is taken off, its spread is noise.

        Args:
            state: Where the gaps are taken.
            P: (37, 37) covariance before the contacts.
            points: (k, 17) closest points to the handle without its radius error, rows of `closest_table`.
            p_WF: (k, 3) fingertip centres in W [m].
            J: (k, 6, 17) their Jacobians by the joints with offset states.
            force: (k,) forces [N].

        Paper: (2), with the fingertips' indentation.
        """
        H, z, R = contacts(
            points, p_WF, J, force, state.p_WT, state.R_WT, P, state.hand_W, state.radius_error,
            self.encoder, self.indentation, self.indentation_error, self.contact, self.alike,
        )  # fmt: skip
        return Rows(H, z, R, (1,) * len(points))

    def update(self, state: FilterState, rows: Rows) -> tuple[FilterState, Verdict]:
        """Take in measurements in one step."""
        error, P, verdict = gated_step(state.P, rows)
        return state.corrected(error, P), verdict


@lru_cache(maxsize=16)
def _steady_walk(orientation: float, tip: float, constants: float, offset: float, dt: float) -> Array:
    """(37,) variances that random walks add in dt, whatever the tool does, by their drifts; to be copied."""
    noise = np.zeros(SIZE)
    noise[THETA] = dt * orientation**2
    noise[TIP] = dt * tip**2
    noise[SCREW], noise[RADIUS] = dt * constants**2, dt * (0.1 * constants) ** 2
    noise[OFFSETS] = dt * offset**2
    return noise


@lru_cache(maxsize=16)
def _left(arm_encoder: float, encoder: float, arm_time: float, wrist_time: float, dt: float) -> Array:
    """`ToolFilter._left`, which does not change."""
    arm, wrist = (noise**2 * tanh(0.5 * dt / time) for noise, time in ((arm_encoder, arm_time), (encoder, wrist_time)))
    return np.array([arm] * len(ARM) + [wrist] * len(WRIST))


_EYE = np.eye(SIZE)
_CAMERA_FRESH = np.concatenate([_EYE[TIP], _EYE[THETA]])
_CAMERA = _CAMERA_FRESH + _EYE[SEEN]
_TIP_AT_SCREW = _EYE[TIP] - _EYE[SCREW]
