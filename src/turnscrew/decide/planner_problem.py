"""One step of the planner as a nonlinear program: palm pose and all postures of a round at once.

Rolling without slip is imposed between knots by the trapezoid rule: with the Jacobian `J` of the finger's material
point at the contact, its step `mean(J) dq` along the handle's tangent and axis equals that of the handle's surface,
`-stroke/(K-1) R (u x n)`; the third direction is the gap, which is zero at every knot.  For a fingertip's half ball
this is the paper's rolling constraint (12)-(14) with the odometry `dyaw = ((R + r) dphi - r dpsi)/R`, and no sliding
along the handle.

Every bound has a slack of its group, priced so high that slacks vanish whenever the bounds can be met.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from turnscrew.decide.plan import ROLLING, SUPPORTING, Course, Handle
from turnscrew.decide.plan_requirements import Near, Requirements
from turnscrew.decide.planner_clearance import Nearness, gap_rows
from turnscrew.decide.planner_kinematics import finger_kinematics
from turnscrew.decide.planner_round import KNOTS, Moment, Unknowns, axis, finger_of, roll_knot, sizes
from turnscrew.decide.planner_rows import Outcome, Rows, Wish
from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import robot_chain
from turnscrew.robot.joints import JOINTS, finger_joints
from turnscrew.robot.motors import drive_limit

UP = 0.1
"""Largest z of the tool's axis in the palm frame, fingers 6 deg up: further up, the forearm would come down to the
bench."""

STEP_ANGLE, STEP_PLACE, STEP_TILT = 0.25, 0.010, 0.1
"""Largest change of a joint [rad], the handle's place [m] and the tool's axis in one step of full length."""

SLACK_PRICE = 20.0
"""Objective per unit of slack (unit: 10 mm, 1 rad or 1): above the multipliers that the bounds reach in rounds which
keep them (up to 10, found by trial), so that slacks vanish there."""

MOST_LIFT = 0.015
"""Largest distance a finger leaves the handle by, along the normal [m]: farther only takes time."""

CENTIMETRE = 100.0
"""Lengths enter the program in units of 10 mm, the scale of their own bounds."""

EXTRA_SHARE = {Near.TOOL: 1.0, Near.OWN: 0.3, Near.HAND: 0.3}
"""How much of the extra clearance each kind of gap gets: fingers side by side have 2.4 mm at most."""

MOST_MARGIN, MOST_CLEARANCE = 0.12, 0.006
"""Joint margin [rad] and extra clearance [m] beyond which more is no better."""


@dataclass(frozen=True, slots=True)
class _Contact:
    name: str
    tip: ca.SX
    n: ca.SX
    height: ca.SX
    J: ca.SX
    J_w: ca.SX


def within_tilt(u: Array, need: Requirements) -> Array:
    """The tool's axis (2,), x and z in the palm frame, within what wrist and arm can make up for."""
    return np.clip(u, [-need.sideways, -need.down], [need.sideways, UP])


class Program:
    """The nonlinear program around given unknowns.

    Args:
        handle: What is held.
        need: What the round must keep to.
        moments: Of the round.
        near: Points whose clearance is watched.
        start: Present values of the unknowns.
        wish: What to maximise.
        step: Length of the step allowed, 1 for full.
        course: What is planned.
    """

    def __init__(
        self, handle: Handle, need: Requirements, moments: Sequence[Moment], near: Sequence[Nearness],
        start: Unknowns, wish: Wish, step: float,
        course: Course = Course.ROUND,
    ) -> None:  # fmt: skip
        self._handle, self._need, self._start, self._last = handle, need, start, KNOTS[course] - 1
        self._sizes = sizes(course)
        self._v = {name: ca.SX.sym(name, size) for name, size in self._sizes.items()}
        self._u = ca.vertcat(*axis(self._v["u"], ca.sqrt))
        self._margin, self._extra = ca.SX.sym("margin"), ca.SX.sym("extra")
        self._rows = Rows()
        self._spin = ca.SX(0.0)
        contacts = self._roll()
        if course is Course.ROUND:
            self._support()
            self._lift(contacts)
        self._limits()
        self._clear(near, moments)
        self._objective = self._smoothness() - (
            wish.stroke * self._v["stroke"]
            + wish.margin * self._margin
            + wish.clearance * self._extra * CENTIMETRE
            - wish.spin * self._spin
        )
        self._low, self._high = self._bounds(wish, step)

    def solve(self) -> Outcome:
        """One run of IPOPT."""
        rows, slacks = self._rows, list(self._rows.slacks.values())
        x = ca.vertcat(*self._v.values(), self._margin, self._extra, *slacks)
        problem = {"x": x, "f": self._objective + SLACK_PRICE * sum(slacks), "g": ca.vertcat(*rows.terms)}
        options: dict[str, Any] = {
            "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 150,
            "ipopt.tol": 1e-6, "ipopt.mu_strategy": "adaptive", "ipopt.bound_relax_factor": 0.0,
        }  # fmt: skip
        solver = ca.nlpsol("round", "ipopt", problem, options)
        first = np.concatenate([*self._start.values(), [self._need.joint_margin, 0.0], np.full(len(slacks), 0.01)])
        answer = solver(
            x0=np.clip(first, self._low, self._high), lbx=self._low, ubx=self._high, lbg=rows.low, ubg=rows.high
        )
        values, g = np.array(answer["x"]).ravel(), np.array(answer["g"]).ravel()
        unknowns, place = {}, 0
        for name, size in self._sizes.items():
            unknowns[name] = values[place : place + size]
            place += size
        excess = np.maximum(np.array(rows.low) - g, g - np.array(rows.high))
        return Outcome(
            unknowns,
            {name: max(0.0, float(values[place + 2 + k])) for k, name in enumerate(rows.slacks)},
            max(0.0, float(excess.max())),
            float(answer["f"]),
            str(solver.stats()["return_status"]),
        )

    def _touch(self, finger: str, name: str, side: float) -> _Contact:
        """The half ball touches the handle, below its top end, with the fingertip's axis leaning towards it."""
        rows, need, handle = self._rows, self._need, self._handle
        tip, z, J_p, J_w = finger_kinematics(finger).tip(self._v[name])
        reach = handle.radius + robot_chain().tips[finger].rho
        offset = tip - self._v["c"]
        height = ca.dot(offset, self._u)
        radial = offset - height * self._u
        n = radial / reach
        rows.zero((ca.dot(radial, radial) - reach**2) / (2 * reach) * CENTIMETRE)
        rows.most("side", ca.dot(n, z), side)
        room = handle.length / 2 - need.edge
        rows.most("edge", height * CENTIMETRE, room * CENTIMETRE)
        rows.least("edge", height * CENTIMETRE, -room * CENTIMETRE)
        arm = -robot_chain().tips[finger].rho * n
        J = J_p + ca.horzcat(*[ca.cross(J_w[:, k], arm) for k in range(J_w.shape[1])])
        return _Contact(name, tip, n, height, J, J_w)

    def _roll(self) -> dict[str, _Contact]:
        rows, need = self._rows, self._need
        contacts: dict[str, _Contact] = {}
        for knot in range(self._last + 1):
            for finger in ROLLING:
                name = roll_knot(finger, knot)
                now = contacts[name] = self._touch(finger, name, need.rolling_side)
                if finger == "TH":
                    rows.most("bend", self._v[name][-1], -need.thumb_bend)
                if knot:
                    self._no_slip(contacts[roll_knot(finger, knot - 1)], now, finger, knot)
            thumb, middle = contacts[roll_knot("TH", knot)], contacts[roll_knot("MF", knot)]
            rows.most("opposition", ca.dot(thumb.n, middle.n), need.opposition)
            self._level("level", thumb, middle, need.level)
            if need.load > 0.0:
                self._drives(thumb, "TH")
                self._drives(middle, "MF")
            lever = middle.tip[2] - finger_kinematics("MF").knuckle[2]
            rows.least("lever", lever * CENTIMETRE, need.rolling_lever * CENTIMETRE)
        return contacts

    def _drives(self, contact: _Contact, finger: str) -> None:
        """The finger's drives give the pinch that the roll has to end with."""
        need = self._need
        along = np.sqrt((need.load_friction * need.load) ** 2 - need.load_thrust**2)
        f = -need.load * contact.n - along * ca.cross(self._u, contact.n) - need.load_thrust * self._u
        tau = contact.J.T @ f
        most = np.array([drive_limit(JOINTS[joint]) for joint in finger_joints(finger)])
        self._rows.most("drives", tau / most, need.load_share)
        self._rows.least("drives", tau / most, -need.load_share)

    def _no_slip(self, before: _Contact, now: _Contact, finger: str, knot: int) -> None:
        turned = self._v[roll_knot(finger, knot)] - self._v[roll_knot(finger, knot - 1)]
        tangent = ca.cross(self._u, (before.n + now.n) / 2)
        slip = (before.J + now.J) @ turned / 2 + self._v["stroke"] / self._last * self._handle.radius * tangent
        self._rows.zero(ca.vertcat(ca.dot(slip, tangent), ca.dot(slip, self._u)) * CENTIMETRE)
        self._spin += self._last * (ca.dot(before.n + now.n, (before.J_w + now.J_w) @ turned) / 4) ** 2

    def _level(self, group: str, one: _Contact, other: _Contact, bound: float) -> None:
        difference = (one.height - other.height) * CENTIMETRE
        self._rows.most(group, difference, bound * CENTIMETRE)
        self._rows.least(group, difference, -bound * CENTIMETRE)

    def _support(self) -> None:
        rows, need = self._rows, self._need
        holds = {}
        for finger in SUPPORTING:
            hold = holds[finger] = self._touch(finger, f"{finger}_hold", need.holding_side)
            lever = hold.tip[2] - finger_kinematics(finger).knuckle[2]
            rows.least("lever", lever * CENTIMETRE, need.holding_lever * CENTIMETRE)
            self._leave("retreat", finger, hold, f"{finger}_retreat", need.retreat, 0.6)
        first, ring = holds["FF"], holds["RF"]
        rows.most("hold opposition", ca.dot(first.n, ring.n), need.hold_opposition)
        self._level("hold level", first, ring, need.hold_level)

    def _lift(self, contacts: dict[str, _Contact]) -> None:
        for finger in ROLLING:
            for place, knot in (("lift", self._last), ("front", 0)):
                contact = contacts[roll_knot(finger, knot)]
                # 45 deg off the normal at most: a guarded approach must meet the handle where it was planned to
                self._leave("lift", finger, contact, f"{finger}_{place}", self._need.lift, 0.7)

    def _leave(self, group: str, finger: str, contact: _Contact, name: str, least: float, cosine: float) -> None:
        """From the contact to a posture off the handle, along the normal or not far from it."""
        way = finger_kinematics(finger).tip(self._v[name])[0] - contact.tip
        along = ca.dot(way, contact.n)
        self._rows.least(group, along * CENTIMETRE, (least + self._extra) * CENTIMETRE)
        self._rows.most(group, along * CENTIMETRE, MOST_LIFT * CENTIMETRE)
        # the tiny term keeps the root smooth at zero length
        self._rows.most(group, (ca.sqrt(ca.dot(way, way) + 1e-8) - along / cosine) * CENTIMETRE, 0.0)
        ends = finger_kinematics(finger).links(self._v[name])[:, 4:6]
        for end in (0, 1):
            offset = ends[:, end] - self._v["c"]
            across = offset - ca.dot(offset, self._u) * self._u
            away = ca.sqrt(ca.dot(across, across)) - self._handle.radius - robot_chain().tips[finger].rho
            self._rows.least(group, away * CENTIMETRE, self._need.cleared * least * CENTIMETRE)
        # the way is straight in joint space, so it could begin inwards
        begins = ca.dot(contact.n, contact.J @ (self._v[name] - self._v[contact.name]))
        self._rows.least(group, (begins - along / 2) * CENTIMETRE, 0.0)

    def _limits(self) -> None:
        limits = robot_chain().limits
        for name, angles in self._v.items():
            finger = finger_of(name)
            if finger is not None:
                low, high = limits[list(finger_joints(finger))].T
                self._rows.least("joints", angles - low, self._margin)
                self._rows.least("joints", high - angles, self._margin)

    def _clear(self, near: Sequence[Nearness], moments: Sequence[Moment]) -> None:
        if near:
            gap = gap_rows(near, moments, self._v, self._handle, self._u)
            bound = np.array([self._need.clearance(point.near) for point in near])
            share = np.array([EXTRA_SHARE[point.near] for point in near])
            self._rows.least("clearance", (gap - bound - share * self._extra) * CENTIMETRE, 0.0)

    def _smoothness(self) -> ca.SX:
        """Small terms that choose among equals: an even roll, joints near their middle, a palm that lies level."""
        v, limits = self._v, robot_chain().limits
        total = 0.05 * ca.sumsqr(v["u"])
        for finger in ROLLING:
            for knot in range(1, self._last):
                bend = v[roll_knot(finger, knot + 1)] - 2 * v[roll_knot(finger, knot)] + v[roll_knot(finger, knot - 1)]
                total += 0.1 * self._last**2 * ca.sumsqr(bend)
            if f"{finger}_mid" in v:
                middle = (v[f"{finger}_lift"] + v[f"{finger}_front"]) / 2
                total += 0.01 * ca.sumsqr(v[f"{finger}_mid"] - middle)
        for name, angles in v.items():
            finger_name = finger_of(name)
            if finger_name is not None:
                low, high = limits[list(finger_joints(finger_name))].T
                total += 0.003 * ca.sumsqr((angles - (low + high) / 2) / (high - low))
        return total

    def _bounds(self, wish: Wish, step: float) -> tuple[Array, Array]:
        low, high = [], []
        for name, size in self._sizes.items():
            reach = {"u": STEP_TILT, "c": STEP_PLACE}.get(name, STEP_ANGLE) * step
            least, most = self._start[name] - reach, self._start[name] + reach
            if name == "stroke":
                least, most = np.full(size, wish.least_stroke), np.full(size, wish.most_stroke)
            elif name == "u":
                least, most = (within_tilt(bound, self._need) for bound in (least, most))
            low.append(least)
            high.append(most)
        margin = self._need.joint_margin
        slacks = len(self._rows.slacks)
        return (
            np.concatenate([*low, [margin, 0.0], np.zeros(slacks)]),
            np.concatenate([*high, [max(margin, MOST_MARGIN), MOST_CLEARANCE], np.full(slacks, np.inf)]),
        )
