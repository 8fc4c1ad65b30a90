"""The room's block: from measurements to the estimate of tool, contacts and screw.

Each tick: touch flags, rolling odometry, the filter's prediction, the tip's wrench.  At each camera frame (or at the
same pace while frames fail to come): the filter's correction, and III-A on the filter's corrected fingertips.

Which pose is handed on.  The position is the filter's.  The orientation is III-A's where it was solved within its
boxes, with the filter's orientation as rbar.  Where the filter's pose satisfies (1)-(5), that is the filter's own, and
in runs of five rounds it does in 99.7 % of the frames: so III-A certifies frames, in .2 ms each, rather than improve
them, and `Estimate.status` tells when it could not.  With the camera's orientation as rbar, the paper's choice, III-A
errs by .59 mm / .39 deg of tilt / 1.39 deg of yaw (rms, medians of five runs), for it forgets all frames but one; the
filter by .47 / .23 / .34, the camera itself by 5.1 / 2.8 / 2.0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import thread_time
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.estimate.contacts import TouchDetector
from turnscrew.estimate.correction import Corrector
from turnscrew.estimate.driven_force import DrivenForce, DrivenState
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.filter_state import FilterState, Prior, pose_covariance
from turnscrew.estimate.finger_force import FingerForceState, ForceFromTorque
from turnscrew.estimate.free_tip import HELD, Free, FreeTip, Hold, seated_angle
from turnscrew.estimate.handle_contacts import HandleContacts, capsules_of, handle_contacts
from turnscrew.estimate.hung_force import HungForce
from turnscrew.estimate.joint_smoothing import JointSmoother, JointState
from turnscrew.estimate.odometry import RollingOdometry
from turnscrew.estimate.pose_refine import PoseRefiner
from turnscrew.estimate.readings import filled
from turnscrew.estimate.reference import FILTERED, NO_CONTACT, NO_DATA, SOLVED, Reference
from turnscrew.estimate.refine_step import refine
from turnscrew.estimate.screw_angle import ScrewAngle
from turnscrew.estimate.slips import Slips
from turnscrew.estimate.tip_out import TipOut
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.estimate.trail import Pose, Trail
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.euler import yaw
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.surfaces import SurfaceOfRevolution
from turnscrew.robot.joints import ARM, FINGERS, WRIST
from turnscrew.signals import TIP_LAG, Estimate, Measurement
from turnscrew.values import changed

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

REACH = len(ARM) + len(WRIST)
"""Joints that move all fingertips alike: the first of the joint vector."""


@dataclass(frozen=True, slots=True)
class ToolEstimator:
    """Parameters of the whole estimation.

    Attributes:
        fingertips: Kinematics: fingertips at joint angles (28,).
        handle: Patch of the handle in T, as said.
        p_WS: (3,) bottom centre of the screw's drive in W at the start, as said [m].
        wrench: Tip wrench (III-B), with tool and thread.
        forces: Fingertip forces from the drives' torques; None for a hand with sensors in its fingertips.
        driven: Contact forces from the torques that were sent, which tell the load of a robot that takes torques; None
            for one that takes positions, whose load the fingertips' sensors tell.
        reach: Distance from the handle beyond which a fingertip cannot touch it [m]: three sigmas of joint offsets
            (.57 deg) and hand-to-screw calibration (2 mm) together.
        joints: Smoother of the joints' readings.
        hung: Finds force sensors that hang.
        touch: Touch detector.
        odometry: Rolling odometry.
        filter: Noise of the filter.
        prior: Its doubt at the start.
        refiner: III-A, or None where the filter's pose is handed on as it is.
        reference: What (6) stays close to.
        angle: Slot play.
        slips: Detectors of fingers that slide, and of slips of the tip.
        out: Detector of a tip that has left its drive.
        free_tip: Carries a tool whose tip is out; None where a lost tip ends the run.
        memory: How far back odometry is kept for frames that come late [s]; later ones are refused.
        correction_period: Longest time without a correction when no frame comes [s]: two periods of the camera.
        rate_time: Time constant of the tool's angular velocity [s]: encoder noise of .05 deg makes .15 deg of yaw,
            so 50 ms leave 3 deg/s.
    """

    fingertips: Callable[[Array], Fingertips]
    handle: SurfaceOfRevolution
    p_WS: Array
    wrench: TipWrench
    forces: ForceFromTorque | None = None
    driven: DrivenForce | None = None
    reach: float = 0.006
    joints: JointSmoother = field(default_factory=JointSmoother)
    hung: HungForce = field(default_factory=HungForce)
    touch: TouchDetector = field(default_factory=TouchDetector)
    odometry: RollingOdometry = field(default_factory=RollingOdometry)
    filter: ToolFilter = field(default_factory=ToolFilter)
    prior: Prior = field(default_factory=Prior)
    refiner: PoseRefiner | None = field(default_factory=PoseRefiner)
    reference: Reference = Reference.FILTER
    angle: ScrewAngle = field(default_factory=ScrewAngle)
    slips: Slips = field(default_factory=Slips)
    out: TipOut = field(default_factory=TipOut)
    free_tip: FreeTip | None = None
    memory: float = 0.1
    correction_period: float = 2.0 / 30.0
    rate_time: float = 0.05

    def init(self, measurement: Measurement, p_WT: Array, R_WT: Array) -> EstimatorState:
        """Start.

        Args:
            measurement: The first.
            p_WT: (3,) where the tip is believed to be, in W [m].
            R_WT: (3, 3) how the tool is believed to stand.
        """
        measurement = filled(measurement, None)
        filtered = self.prior.state(p_WT, R_WT, measurement.q)
        tips = self.fingertips(measurement.q - filtered.joint_offset())
        capsules = capsules_of(tips)
        return EstimatorState(
            read=measurement,
            joints=self.joints.init(measurement.q),
            filter=filtered,
            gauged=None if self.forces is None else self.forces.init(),
            driven=None if self.driven is None else self.driven.init(),
            f_F=np.zeros((len(FINGERS), 3)),
            hung=self.hung.init(measurement),
            touch=self.touch.init(),
            tips=tips,
            capsules=capsules,
            contacts=self._contacts(filtered, tips, capsules),
            trail=Trail(span=self.memory).extended(measurement.time, np.zeros(3), np.zeros(3)),
            since_correction=0.0,
            correction=None,
            correction_time=0.0,
            refined=None,
            seen=NO_DATA,
            polished=NO_DATA,
            status=NO_CONTACT,
            omega_T=np.zeros(3),
            angle=self.angle.init(yaw(R_WT)),
            wrench=self.wrench.init(),
            slips=self.slips.init(),
            out=self.out.init(),
            start=yaw(R_WT),
        )

    def update(
        self, state: EstimatorState, measurement: Measurement, motion: Array, dt: float, free: Free = HELD
    ) -> tuple[EstimatorState, Estimate]:
        """One tick.

        Args:
            state: Of the last tick.
            measurement: Now.
            motion: (28,) by how much the joints were told to move since the last tick [rad].
            dt: Time since then [s].
            free: Whether the tip is out of its drive, and where the screw stands then.

        Returns:
            The new state and the estimate.
        """
        if self.free_tip is not None and free.tip != state.free.tip:
            state = self._changed_over(self.free_tip, state, free.tip)
        state = changed(state, free=free)
        read = filled(measurement, state.read)
        joints, q, v = self.joints.update(state.joints, read.q, read.v, motion, dt)
        measurement = changed(read, q=q, v=v)
        state, rolled = self._predict(state, read, joints, measurement, dt)
        state = changed(state, driven=self._driven(state, measurement, dt))
        if measurement.vision is not None or state.since_correction >= self.correction_period:
            state = self._correct(state, measurement)
        return self._conclude(state, measurement, rolled, dt)

    def _radius(self, f: FilterState) -> float:
        """Of the handle in its middle, as learned [m]."""
        return self.handle.meridian(0.5 * sum(self.handle.domain)).r + f.radius_error

    def _contacts(self, f: FilterState, tips: Fingertips, capsules: tuple[Capsule, ...]) -> HandleContacts:
        return handle_contacts(self.handle, f.radius_error, capsules, tips, f.p_WT, f.R_WT)

    def _predict(
        self, state: EstimatorState, read: Measurement, joints: JointState, measurement: Measurement, dt: float
    ) -> tuple[EstimatorState, float]:
        """Touch flags, odometry and the filter's prediction; also what odometry says of the yaw's change."""
        f = state.filter
        tips = self.fingertips(measurement.q - f.joint_offset())
        gauged, f_F = self._forces(state, measurement, tips, dt)
        hung, near = self.hung.update(state.hung, read, dt), state.contacts
        f_F = self.hung.believed(hung, f_F, tips.R_WF, near.gap, near.n_W, f.R_WT[:, 2])
        touch = self.touch.update(state.touch, f_F, tips.R_WF, dt)
        state = changed(state, gauged=gauged, f_F=f_F, hung=hung, touch=touch)
        if state.free.tip and self.free_tip is not None:
            state, dtheta, dp = self._carry(self.free_tip, state, measurement, tips, dt)
        else:
            state, dtheta, dp = self._roll(state, tips, dt)
        moved = changed(
            state,
            read=read,
            joints=joints,
            tips=tips,
            contacts=self._contacts(state.filter, tips, state.capsules),
            trail=state.trail.extended(measurement.time, dtheta, dp),
            since_correction=state.since_correction + dt,
            seen=state.seen.moved(dtheta, dp),
            polished=state.polished.moved(dtheta, dp),
        )
        return moved, float(f.R_WT[:, 2] @ dtheta)

    def _roll(self, state: EstimatorState, tips: Fingertips, dt: float) -> tuple[EstimatorState, Array, Array]:
        """Filter and slips moved on with a tool that turns about its tip; its rotation vector and the tip's way."""
        f, near, touch = state.filter, state.contacts, state.touch
        weight = touch.level * touch.touching
        rolled = self.odometry.increment(state.tips, tips, near.tip_W, weight, f.p_WT, f.R_WT)
        rolled = rolled.slowed(f.slide, f.R_WT[:, 2])
        dtheta = rolled.dtheta
        # The tip follows the screw along its thread.
        dp = self.wrench.advance(float(f.R_WT[:, 2] @ dtheta)) * f.R_WT[:, 2]
        omega_T = state.omega_T + dt / (self.rate_time + dt) * (f.R_WT.T @ dtheta / dt - state.omega_T)
        slips = self.slips.rolled(
            state.slips, f, state.tips, tips, near.tip_W, state.f_F, weight, dtheta, dp, self.filter.arm_time,
            self._radius(f), dt,
        )  # fmt: skip
        reach = tips.J[FINGERS.index("MF"), :3, :REACH]
        f = self.filter.predict(f, rolled, dp, float(omega_T[2]), reach, int(touch.touching.sum()) >= 2, dt)
        return changed(state, filter=f, omega_T=omega_T, slips=slips), dtheta, dp

    def _carry(
        self, free_tip: FreeTip, state: EstimatorState, measurement: Measurement, tips: Fingertips, dt: float
    ) -> tuple[EstimatorState, Array, Array]:
        """The same for a tool whose tip is out of its drive, and which goes with the hand."""
        f, touch = state.filter, state.touch
        hold = Hold((state.tips, tips), state.contacts.tip_W, touch.level * touch.touching * state.free.holds)
        palm, dp, dtheta = free_tip.carry(state.carrier, measurement.q, hold, f.p_WT)
        reach, gripped = tips.J[FINGERS.index("MF"), :3, :REACH], int(touch.touching.sum()) >= 2
        f = free_tip.predict(self.filter, f, (dp, dtheta), reach, gripped, state.free.moves, dt)
        return changed(state, filter=f, carrier=palm, omega_T=np.zeros(3)), dtheta, dp

    def _changed_over(self, free_tip: FreeTip, state: EstimatorState, out: bool) -> EstimatorState:
        """The tip has left its drive, or is in it again and in another grasp than the one that slips are told by."""
        if out:
            known = free_tip.freed(state.filter, (*state.sure, state.filter)[0])
            return changed(state, filter=known, carrier=None, status=NO_CONTACT, refined=None, out=self.out.init())
        angle = seated_angle(state.angle, yaw(state.filter.R_WT), state.start)
        return changed(state, filter=free_tip.seated(state.filter), angle=angle, slips=self.slips.init(), sure=())

    def _forces(
        self, state: EstimatorState, measurement: Measurement, tips: Fingertips, dt: float
    ) -> tuple[FingerForceState | None, Array]:
        """(5, 3) force of each fingertip in its frame [N], from sensors there or from the drives' torques."""
        if self.forces is None or state.gauged is None or measurement.tau is None:
            return None, np.zeros((len(FINGERS), 3)) if measurement.f_F is None else measurement.f_F
        q = measurement.q - state.filter.joint_offset()
        gauged, f_F = self.forces.update(
            state.gauged, measurement.tau, q, measurement.v, tips, state.contacts.tip_W, dt
        )
        # the drives also move and brake the finger itself: what is left of that is no touch where no handle is
        return gauged, f_F * (state.contacts.gap < self.reach)[:, None]

    def _driven(self, state: EstimatorState, measurement: Measurement, dt: float) -> DrivenState | None:
        """Contact forces from the torques that were sent, of a robot that takes them."""
        if self.driven is None or state.driven is None or measurement.tau_sent is None:
            return state.driven
        q, tip_W = measurement.q - state.filter.joint_offset(), state.contacts.tip_W
        return self.driven.update(state.driven, measurement.tau_sent, q, measurement.v, state.tips, tip_W, dt)

    def _pressing(self, state: EstimatorState) -> Array:
        """(5, 3) force of each touching fingertip on the tool in W [N], from what was sent or from its sensor."""
        known = state.touch if state.driven is None else state.driven
        return known.f_W * state.touch.touching[:, None]

    def _screw(self, theta: float) -> Array:
        """The drive's bottom centre as said, advanced along the thread by the screw's angle [rad]."""
        sunk: Array = np.array([0.0, 0.0, self.wrench.advance(-theta)])
        return self.p_WS + sunk

    def _correct(self, state: EstimatorState, measurement: Measurement) -> EstimatorState:
        """The filter's correction, then III-A at what it gave."""
        frame = measurement.vision
        seen = None if frame is None else state.trail.to_now(frame)
        # of slips of the tip, and of its loss, frames tell only while it is in its drive
        told = None if state.free.tip else seen
        said = self._screw(state.angle.theta)
        corrector = Corrector(self.handle, self.filter, self.prior)
        refused = state.correction.refused if state.correction is not None else 0
        touch, began = state.touch, thread_time()
        done = corrector.apply(
            state.filter, seen, said, state.tips, state.capsules, touch.pressing, touch.level, refused, state.free.tip
        )
        took, radius = thread_time() - began, self._radius(state.filter)
        tips = self.fingertips(measurement.q - done.state.joint_offset())
        state = changed(
            state,
            filter=done.state,
            correction=done,
            correction_time=took,
            since_correction=0.0,
            slips=state.slips if told is None else self.slips.turned(state.slips, state.filter, told, radius),
            out=state.out if told is None else self.out.seen(state.out, state.filter, told, self.filter.common),
            tips=tips,
            contacts=self._contacts(done.state, tips, state.capsules),
            seen=state.seen if seen is None else seen.pose,
            polished=Pose(done.state.p_WT, done.state.R_WT),
        )
        if self.refiner is None:
            return changed(state, status=FILTERED)
        if told is None:
            return state
        return self._refine(self.refiner, state, said + done.state.b_W, told.pose)

    def _refine(self, refiner: PoseRefiner, state: EstimatorState, p_WS: Array, seen: Pose) -> EstimatorState:
        """III-A with the fingers whose contact the filter believes."""
        rows = state.correction.contacts if state.correction is not None else ()
        if not rows:
            return changed(state, status=NO_CONTACT, refined=None)
        R_bar = seen.R_WT if self.reference is Reference.CAMERA else state.filter.R_WT
        tip = state.capsules[FINGERS.index("FF")]
        refined = refine(
            refiner, self.handle, tip, state.filter, p_WS, R_bar, state.tips, state.contacts, rows, state.refined
        )
        pose = Pose(refined.pose.p_WT, refined.pose.R_WT)
        return changed(state, refined=refined, polished=pose, status=refined.pose.status.value)

    def _orientation(self, state: EstimatorState) -> Array:
        """What is handed on: III-A's orientation where it was solved within its boxes, otherwise the filter's."""
        return state.polished.R_WT if state.status in SOLVED else state.filter.R_WT

    def _verdict(self, state: EstimatorState, measurement: Measurement) -> str:
        """What became of this tick's camera frame."""
        if measurement.vision is None:
            return "none"
        if state.correction is None or state.correction.vision is None:
            return "late"
        return "taken" if state.correction.vision else "refused"

    def _conclude(
        self, state: EstimatorState, measurement: Measurement, rolled: float, dt: float
    ) -> tuple[EstimatorState, Estimate]:
        """Screw angle, tip wrench and message."""
        f, contacts, R_WT = state.filter, state.contacts, self._orientation(state)
        nu = np.array([0.0, 0.0, self.wrench.advance(float(state.omega_T[2])), *state.omega_T.tolist()])
        f_W = self._pressing(state)
        F_h, squeeze = contacts.load(f_W, f.p_WT, R_WT)
        if state.free.tip:
            state = changed(state, angle=changed(state.angle, theta=state.free.theta))
            F_s, tip_slip = self.wrench.solve(F_h, R_WT, nu, 0.0)[0], 0.0
        else:
            angle = self.angle.update(state.angle, yaw(f.R_WT), rolled, dt)
            wrench, F_s = self.wrench.update(state.wrench, F_h, squeeze, self._radius(f), R_WT, nu, angle.theta, dt)
            slips, tip_slip = self.slips.felt(state.slips, f, state.tips, contacts, state.f_F, measurement.vision, dt)
            out = self.out.felt(state.out, float(wrench.axial.x[0]), tip_slip, dt)
            sure = (*state.sure, f)[-TIP_LAG:] if self.out.sure(out) else state.sure
            state = changed(state, angle=angle, wrench=wrench, slips=slips, out=out, sure=sure)
        return state, self._estimate(state, measurement, (R_WT, nu), f_W, F_s, tip_slip)

    def _estimate(
        self, state: EstimatorState, measurement: Measurement, pose: tuple[Array, Array], f_W: Array, F_s: Array,
        slip: float,
    ) -> Estimate:  # fmt: skip
        """The message."""
        f, near = state.filter, state.contacts
        return Estimate(
            time=measurement.time,
            q=measurement.q - f.joint_offset(),
            v=measurement.v,
            offset=f.joint_offset(),
            p_WT=f.p_WT,
            R_WT=pose[0],
            nu=pose[1],
            radius=self._radius(f),
            p_WS=self._screw(state.angle.theta) + f.b_W,
            theta=state.angle.theta,
            touching=state.touch.touching,
            f_W=f_W,
            c_W=near.c_W,
            n_W=near.n_W,
            gap=near.gap,
            F_s=F_s,
            stiffness=self.wrench.thread.stiffness(state.wrench.thread),
            tip_slip=slip,
            finger_slip=state.slips.fingers.slid,
            grip=state.slips.fingers.grip,
            hung=self.hung.hung(state.hung),
            P=pose_covariance(f.P),
            frame=self._verdict(state, measurement),
            status=state.status,
            p_WT_seen=state.seen.p_WT,
            R_WT_seen=state.seen.R_WT,
            p_WT_refined=state.polished.p_WT,
            R_WT_refined=state.polished.R_WT,
            tip_out=self.out.signal(state.out),
            tip_sure=self.out.sure(state.out),
        )
