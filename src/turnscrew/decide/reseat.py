"""Bringing a tip that has left its drive back into it: gather the tool, take it over the slot, feel for the slot.

The camera sees the tool to 4 mm and 2.5 deg a frame, and to half a millimetre when it has looked for two seconds; where
the slot is the robot has learned while the tip was in it.  The slot's heading is another matter: a thread that locks
itself leaves it where it was when the tip was lost, a spring turns it back to where it began.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from turnscrew.decide.gait_state import FF_RF, TH_MF, GaitState
from turnscrew.decide.reseat_gather import STILL, Gathering, Motion
from turnscrew.decide.reseat_pose import leaning, seen_from, toward
from turnscrew.decide.reseat_search import Search
from turnscrew.decide.reseat_state import CARRIED, FOUR, LOCKED, ReseatState, Step
from turnscrew.decide.reseat_walk import AirWalk
from turnscrew.decide.thread_guess import springs_back
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.euler import yaw
from turnscrew.robot.inverse_kinematics import place_palm, rotation_vector
from turnscrew.robot.joints import FINGERS, finger_joints
from turnscrew.robot.model import RobotModel
from turnscrew.signals import FREE, GRIP, REACH, Estimate, Goal
from turnscrew.values import changed

Moved = tuple[ReseatState, Motion]

ROOM = 0.05
"""What arm and wrist keep from their limits over the slot [rad]: the search moves them by 3 deg."""

LEVEL = np.radians(1.5)
"""Lean in the hand that counts as upright [rad], three sigmas of what the camera leaves of doubt."""

PLACED = 0.003
"""How far the handle may be from its place in the hand [m]: three sigmas of the camera, half of `STANDOFF`."""

SLID = 0.006
"""How far it may be from there if four fingers hold it already [m], `STANDOFF`."""

TURNED = np.radians(2.0)
"""What may be left of a turn of hand or tool in the air [rad]: the arm does the rest."""

WALKED = 40.0
"""Longest walk [s]: three strokes at the usual pace take 15."""

FAR = 0.005
"""Error of the tool's pose over the slot with which no slot is found [m], as `reseat_pose.toward` measures it."""

AIMS = 3
"""How often fingers are sent for the handle in an attempt: the first time the camera may still err by a centimetre."""

RENEWED = 2
"""After how many attempts forefinger and ring finger take the handle anew: a search may have twisted it in the hand."""

CRAMPED = 0.02
"""What is left to a joint's limit when a finger cannot give way any more [rad]: there its soft stop begins
(`actuate.stops`)."""

FIRST = 0.1
"""Share of the load that a finger takes when it has just touched, as in the gait."""


@dataclass(frozen=True)
class Reseat:
    """The search for the drive, step by step.

    Attributes:
        robot: Kinematics.
        gathering: Takes the tool with four fingers.
        walk: Turns it in the air.
        search: Feels for the slot.
        squeeze: Normal force of each finger [N], as in the gait.
        speed: Largest speed of the tip in the air [m/s],
        turning: and of the orientation [rad/s].
        near: How near the tool comes before the camera looks [m].
        reachable: Error of the palm from which on the arm cannot bring the tool to a heading [m].
        take: Time in which a touching finger takes its share of the load, or gives it up [s].
        closing: Speed of a finger that feels for the handle [m/s], as in the gait.
        still, aim, level, approach, look, feel: Longest times of these steps [s].
        settled: Shortest time of those that end when the tool is where it should be [s].
    """

    robot: RobotModel
    gathering: Gathering
    walk: AirWalk
    search: Search
    squeeze: float = 4.0
    speed: float = 0.03
    turning: float = 0.3
    near: float = 0.0015
    reachable: float = 0.001
    take: float = 0.3
    closing: float = 0.015
    still: float = 1.0
    settled: float = 0.5
    aim: float = 0.6
    feel: float = 2.5
    level: float = 3.0
    approach: float = 6.0
    look: float = 2.5

    def init(self, gait: GaitState, estimate: Estimate, lost: tuple[float, ...]) -> ReseatState:
        """The tip has been lost.

        Args:
            gait: Where the gait was.
            estimate: Who touches, and where the joints are.
            lost: Angles at which the screw may have been then, the likeliest first [rad].
        """
        guess = springs_back(gait.falls)
        held = gait.gripping & estimate.touching
        if held.sum() < 2:
            # a knock may take the tool out of all fingers for a moment: those that go on pressing find it again
            held = gait.gripping
        return ReseatState(Step.STILL, 0.0, held, gait, lost, *guess, estimate.q, estimate.q)

    def update(self, state: ReseatState, estimate: Estimate, dt: float) -> tuple[ReseatState, Goal]:
        """One tick.

        Args:
            state: Of the last tick.
            estimate: What is believed.
            dt: Time since then [s].
        """
        state = changed(state, clock=state.clock + dt, taken=state.taken + dt)
        if state.step is Step.WALK:
            return self._walk(state, estimate, dt)
        steps: dict[Step, Callable[[ReseatState, Estimate, float], Moved]] = {
            Step.STILL: self._still, Step.LIFT: self._lift, Step.RELEASE: self._release, Step.AIM: self._aim,
            Step.FEEL: self._feel, Step.LEVEL: self._level, Step.HOVER: self._hover, Step.LOOK: self._look,
        }  # fmt: skip
        done = steps.get(state.step, self._search)
        before = state
        state, motion = done(state, estimate, dt)
        return state, self._goal(before, state, estimate, motion)

    def _above(self, estimate: Estimate) -> float:
        """Height of the tip over the head [m]."""
        return float(estimate.p_WT[2] - estimate.p_WS[2]) - self.search.depth

    def _still(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        return (state.to(Step.LIFT) if state.clock > self.still else state), STILL

    def _lift(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        motion = self.gathering.lifting(state, estimate, self._above(estimate))
        if self._above(estimate) < self.gathering.height or state.clock < self.settled:
            return state, motion
        if np.linalg.norm(rotation_vector(self.gathering.back(estimate))) > TURNED and state.clock < self.level:
            return state, motion
        # a search that failed may have taken the handle out of a finger
        held = state.gripping & estimate.touching
        state = changed(state, gripping=held) if held.sum() > 1 else state
        off = float(np.linalg.norm(self.gathering.off(state, estimate)))
        if state.gripping[FOUR].all():
            # a grasp in which the tool has slid, or with which attempts have failed, is taken anew
            renewed = state.attempt % RENEWED == 0 if state.attempt else off > SLID
            if not renewed:
                return state.to(Step.LEVEL), motion
            return state.to(Step.RELEASE), motion
        return (self._aimed(state, estimate) if off < PLACED or state.clock > self.level else state), motion

    def _release(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        over = state.clock > self.take
        return (changed(state.to(Step.LIFT), gripping=TH_MF.copy()) if over else state), STILL

    def _aimed(self, state: ReseatState, estimate: Estimate) -> ReseatState:
        """The state with those of the four that do not hold sent for the handle."""
        target = self.gathering.before_handle(state, estimate)
        return changed(state.to(Step.AIM), q_from=estimate.q, q_target=target, aims=state.aims + 1)

    def _aim(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        return (state.to(Step.FEEL) if state.clock > self.aim else state), STILL

    def _feel(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        joined = FOUR & ~state.gripping & estimate.touching
        taken = 0.0 if joined.any() else state.taken
        state = changed(state, gripping=state.gripping | joined, taken=taken)
        if state.clock > self.feel and state.aims < AIMS and not state.gripping[FOUR].all():
            # the handle is not where it was taken to be, and by now the camera has seen more of it
            return self._aimed(state, estimate), STILL
        over = bool(state.gripping[FOUR].all()) or state.clock > self.feel
        return (state.to(Step.LEVEL) if over else state), STILL

    def _level(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        if state.clock < self.take:
            return state, STILL
        motion = self.gathering.righting(state, estimate)
        upright = np.linalg.norm(self.gathering.lean(estimate)) < LEVEL and state.clock > self.settled
        if not upright and state.clock < self.level:
            return state, motion
        error, chosen = self._choose(state, estimate)
        if state.walked or (error < self.reachable and not state.blocked and not self._cramped(state, estimate)):
            return chosen.to(Step.HOVER), motion
        if not (state.gripping & estimate.touching)[FOUR].all():
            # it would let go of the tool
            return state.failed("fewer than four fingers have found the tool"), motion
        return self.walk.begin(state.to(Step.WALK), estimate), motion

    def _cramped(self, state: ReseatState, estimate: Estimate) -> bool:
        """Whether a joint of a finger that holds the tool has come near its limit: thumb and middle finger go back."""
        joints = [joint for row in np.flatnonzero(state.gripping) for joint in finger_joints(FINGERS[row])]
        q, (low, high) = estimate.q[joints], self.robot.limits[joints].T
        return bool(np.minimum(q - low, high - q).min() < CRAMPED)

    def _walk(self, state: ReseatState, estimate: Estimate, dt: float) -> tuple[ReseatState, Goal]:
        state, goal, whole = self.walk.update(state, estimate, dt)
        goal = changed(goal, phase=f"reseat {goal.phase}", tip_free=True, theta=state.theta, tip_moves=True)
        reached = not state.blocked and whole and self._choose(state, estimate)[0] < self.reachable
        if whole and (state.left < TURNED or reached):
            state = changed(state.to(Step.LEVEL), walked=True, blocked=False, taken=0.0, q_target=estimate.q)
        elif state.clock > WALKED:
            state = state.failed("the fingers cannot turn the tool in the air")
        return state, goal

    def _choose(self, state: ReseatState, estimate: Estimate) -> tuple[float, ReseatState]:
        """Which corner is to be lowest, and the slot's heading; also the palm's error there [m]."""
        now, heading = yaw(estimate.R_WT), self.walk.start - state.theta
        heading += np.pi * round((now - heading) / np.pi)
        p, R = self.robot.palm(estimate.q)
        found = []
        for side in (1.0, -1.0):
            one = changed(state, side=side, heading=heading)
            p_WT, R_WT = self._over(one, estimate, 0.0)
            turn = R_WT @ estimate.R_WT.T
            palm = p_WT + turn @ (p - estimate.p_WT), turn @ R
            reached = place_palm(self.robot, *palm, estimate.q, np.random.default_rng(0), ROOM, starts=1)
            found.append((reached.residual, one))
        return min(found, key=lambda pair: pair[0])

    def _over(self, state: ReseatState, estimate: Estimate, above: float) -> tuple[Array, Array]:
        """Pose of the leaning tool over the slot."""
        search, corner = self.search, self.search.over(state, estimate, above)
        return leaning(corner, state.heading, state.side, search.lean, 0.5 * search.width)

    def _carry(self, state: ReseatState, estimate: Estimate, above: float, rate: float) -> tuple[Motion, float]:
        """The arm brings the tool over the slot; also how far it is [m]."""
        now, wanted = (estimate.p_WT, estimate.R_WT), self._over(state, estimate, above)
        V, off = toward(now, wanted, rate, self.speed, self.turning)
        palm, _ = self.robot.palm(estimate.q)
        return Motion(seen_from(V, estimate.p_WT, palm), np.zeros(6)), off

    def _hover(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        motion, off = self._carry(state, estimate, self.search.hover + 0.003, 2.0)
        if state.clock > self.approach and off > FAR:
            failed = state.failed(f"the arm stops {1e3 * off:.0f} mm from where the tool should be")
            return changed(failed, blocked=True), motion
        there = off < self.near and state.clock > self.settled
        return (state.to(Step.LOOK) if there or state.clock > self.approach else state), motion

    def _look(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        motion, _ = self._carry(state, estimate, self.search.hover, 1.0)
        # locked fingers take a second to come to rest
        since = state.clock - 1.0
        q = estimate.q + estimate.offset
        mean = q if since < dt else state.q_from + dt / since * (q - state.q_from)
        state = changed(state, q_from=mean)
        if state.clock < self.look:
            return state, motion
        corner = self.search.over(state, estimate, self.search.hover)
        return self.search.begin(state, estimate, corner, mean), motion

    def _search(self, state: ReseatState, estimate: Estimate, dt: float) -> Moved:
        state, V_palm = self.search.update(state, estimate, dt)
        return state, Motion(V_palm, np.zeros(6))

    def _goal(self, before: ReseatState, state: ReseatState, estimate: Estimate, motion: Motion) -> Goal:
        feeling = before.step is Step.FEEL
        reaching = FOUR & ~state.gripping & feeling
        roles = np.where(state.gripping, GRIP, np.where(reaching, REACH, FREE))
        share = np.where(state.gripping, min(FIRST + (1.0 - FIRST) * state.taken / self.take, 1.0), 0.0)
        if before.step is Step.RELEASE:
            # fingers that let go at once leave the thumb pressing on the middle finger with what all four have held
            share[FF_RF] *= max(1.0 - before.clock / self.take, 0.0)
        blend = min(before.clock / (0.8 * self.aim), 1.0) if before.step is Step.AIM else 1.0
        p, _ = self.robot.palm(estimate.q)
        step = before.step
        return Goal(
            phase=f"reseat {step}", round=0, vain=0, roles=roles, share=share,
            squeeze=share * self.squeeze, approach=np.where(reaching[:, None], -self.closing * estimate.n_W, 0.0),
            q_free=(1.0 - blend) * state.q_from + blend * state.q_target, q_guide=estimate.q, turn_rate=0.0,
            tip_force=0.0, V_palm=motion.palm, V_tool=seen_from(motion.palm, p, estimate.p_WT) + motion.tool,
            tip_free=True, theta=state.theta, locked=step in LOCKED, tip_moves=step not in CARRIED,
        )  # fmt: skip
