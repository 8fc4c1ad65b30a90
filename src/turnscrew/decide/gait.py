"""The finger gait: which finger does what, phase by phase (Section IV-D, Fig. 3 and Section V-B, Fig. 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.decide.gait_state import FEELING, FF_RF, HELD_BY_TH_MF, NEXT, TH_MF, GaitState, Phase
from turnscrew.decide.placing import Placing, knuckle_way
from turnscrew.decide.plan import ROLLING, SUPPORTING, Course, GaitPlan
from turnscrew.decide.stroke_budget import StrokeBudget
from turnscrew.decide.thread_guess import springs_back
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import FREE, GRIP, REACH, Estimate, Goal
from turnscrew.values import changed

FIRST_SHARE = 0.1
"""Share of the load that a finger takes when it has just touched: .4 N of squeeze, what it touched with."""

REST = 0.12
"""Time after a roll's end when the handle has come to rest [s], and nobody else touches it: that takes .29 s at 2.75
times the usual pace."""


@dataclass(frozen=True)
class Gait:
    """The gait's timing and forces.

    Attributes:
        plan: Postures of one round.
        placing: Corrects them by the estimate.
        speed: Turning speed of the handle during the roll [rad/s].
        squeeze: Normal force of each rolling finger without load [N]: with friction 1, the 2.1 N of thrust
            that each carries for 5 N on the tip leave `sqrt(4^2 - 2.1^2)` = 3.4 N to the torque, .12 N.m at 18 mm.
        support_squeeze: The same for the supporting pair, which carries no torque [N].
        tip_force: Wanted force on the tip [N], found by trial: less lets the blade ride up, more costs friction.
        ramp: Time of the turning speed's rise and fall [s]: a tenth of a stroke.
        settle: Time for the first grip to build up [s]; it lasts longer while the hand is not yet over the screw,
        settle_most: but not for ever [s]: in 3 s the palm comes 18 mm, six times the calibration's usual error.
        centred: How far from there the palm may be when the first roll begins [m]: what a plan's joint margins leave
            for a handle that stands elsewhere, besides pressing (`Requirements.joint_margin`).
        held: Time for which the end of a long stroke is held before it counts [s].
        add: Time in which FF and RF come before the handle [s].
        take: Time in which a touching pair takes its share of the load, or gives it up [s].
        leave: Time in which a pair lifts off [s].
        relocate: Time of TH's and MF's way back [s].
        standoff: Distance from the handle at which feeling begins [m]: fingers then met the handle after 3.0 +- .5 mm
            (80 touches, torques, standard variation), so it is six times what the estimate errs by.
        near: How close a finger's joints are to have come to there before it feels [rad], 3 mm at its tip,
        slow: and how slow they are to be [rad/s], three times what feeling itself takes.  A finger that feels while it
            is still on its way touches short of its place, 6 mm with the thumb, and each roll then ends with the middle
            finger that much farther on, in the way of the ring finger.
        closing: Speed of feeling [m/s]: at .14 N a mm/s of impact it touches with 2 N.
        stop: Distance from a joint's limit at which a roll ends early [rad], beside what its joints go on by in
        braking: that time at the speed that they have [s]: from 110 deg/s they came to rest after 2.8 deg,
        begun: once the handle has turned by so much [rad]: until then joints still move by what went before.
        support_speed: Turning speed of the handle between FF and RF while TH and MF go back [rad/s]: the paper lets
            them roll, too.
        least_turn: A round that turns the screw by less does not count and is made again [rad]: 20 deg, and what the
            estimate may err by.
        firmer: By how much of itself the squeeze grows after each round that has not turned the screw, and the turning
            slows down: the handle has slid in the fingers, or the blade has left its slot.
        back: Angle by which the handle is turned back to clear the way for other fingers [rad]: the middle finger's tip
            goes back by 4 mm, twice what plans keep between it and the ring finger,
        back_speed: and how fast [rad/s].
        recentre: Whether the arm keeps the hand over the screw, during the first grip and the rolls.
        budget: How far to roll where the thread gets tighter; None for full strokes.
    """

    plan: GaitPlan
    placing: Placing
    speed: float
    squeeze: float = 4.0
    support_squeeze: float = 4.0
    tip_force: float = 5.0
    ramp: float = 0.1
    settle: float = 0.6
    settle_most: float = 3.0
    centred: float = 0.002
    held: float = 0.5
    add: float = 0.3
    take: float = 0.2
    leave: float = 0.25
    relocate: float = 0.4
    standoff: float = 0.003
    near: float = 0.04
    slow: float = 1.0
    closing: float = 0.015
    stop: float = 0.02
    braking: float = 0.03
    begun: float = np.radians(5.0)
    support_speed: float = 0.0
    least_turn: float = np.radians(22.0)
    firmer: float = 0.5
    back: float = np.radians(12.0)
    back_speed: float = 0.5
    recentre: bool = True
    budget: StrokeBudget | None = None

    def faster(self, factor: float) -> Gait:
        """The same gait with its times divided by a factor, but for what touches: feeling gains 1.7 times at most.

        At 25 mm/s a fingertip touches with 3.5 N, a little less than it then grips with.
        """
        names = ("ramp", "settle", "add", "take", "leave", "relocate")
        times = {name: getattr(self, name) / factor for name in names}
        return changed(
            self, **times, closing=self.closing * min(factor, 1.7), support_speed=self.support_speed * factor
        )

    @property
    def passed_on(self) -> float:
        """Angle by which FF and RF turn the handle while TH and MF go back [rad]."""
        return self.support_speed * (self.relocate - self.ramp)

    @property
    def feeling(self) -> float:
        """Time in which fingers should have come before the handle and felt it, where it is estimated to be [s]."""
        return self.add + self.standoff / self.closing

    def init(self) -> GaitState:
        """Thumb and middle finger hold the tool at the roll's start."""
        q = self.plan.rolling(0.0)
        return GaitState(Phase.SETTLE, 0, 0.0, 0.0, TH_MF.copy(), q, q, stroke=self.plan.stroke)

    def update(self, state: GaitState, estimate: Estimate, dt: float, *, still: bool = False) -> tuple[GaitState, Goal]:
        """One tick: the goal of the present phase, and the next phase once this one is over.

        Args:
            state: Of the last tick.
            estimate: What is believed.
            dt: Time since the last tick [s].
            still: Whether the handle is not to be turned.
        """
        if state.clock == 0.0:
            state = self._enter(state, estimate)
        turning = 0.0 if still else self._turning(state)
        rolled = state.rolled + turning * dt
        state = changed(state, clock=state.clock + dt, rolled=rolled)
        state = changed(state, near=self._near(state, estimate))
        state = changed(state, gripping=self._gripping(state, estimate))
        goal = self._goal(state, estimate, turning)
        over = self._is_over(state, estimate)
        state = self._resisted(state, estimate, over)
        if over:
            if state.phase in (Phase.REMOVE, Phase.HOLD):
                state = self._counted(state, estimate.theta)
            state = changed(state, phase=self._following(state, estimate), clock=0.0, aside=0.0, near=False)
        return state, goal

    def aiming(self, state: GaitState, estimate: Estimate) -> GaitState:
        """The state with thumb and middle finger, which feel for the handle in vain, sent back to aim anew."""
        target = self.placing.before_handle(self.plan.returning(1.0), ROLLING, estimate, self.standoff)
        return changed(state, clock=0.0, q_target=target, aside=self.add, near=False)

    def backing(self, state: GaitState) -> GaitState:
        """The state with the handle turned back a little, and the fingers that were to be added out of the way."""
        away = self.plan.rolling(self._progress(state))
        return changed(state, phase=Phase.BACK, clock=0.0, gripping=state.gripping & TH_MF, q_target=away)

    def catching(self, state: GaitState, estimate: Estimate) -> GaitState:
        """The state with thumb and middle finger sent for the handle that they should hold, the others away."""
        gripping = state.gripping & estimate.touching & TH_MF
        away = self.plan.rolling(self._progress(state))
        return changed(state, phase=Phase.CATCH, clock=0.0, gripping=gripping, q_target=away)

    def _resisted(self, state: GaitState, estimate: Estimate, over: bool) -> GaitState:
        """The state with how the screw resists at a stroke's end: while it turns, at rest, and when it is passed on."""
        torque = float(estimate.F_s[5])
        if state.phase is Phase.ROLL and over:
            return changed(state, ends=(*state.ends, (estimate.theta, torque)), at_rest=np.nan)
        if state.phase is Phase.ADD and over:
            return changed(state, falls=(*state.falls, state.at_rest - torque))
        if state.phase is Phase.ADD and state.clock > REST and np.isnan(state.at_rest):
            return changed(state, at_rest=torque, rests=(*state.rests, (estimate.theta, torque)))
        return state

    def _counted(self, state: GaitState, theta: float) -> GaitState:
        """The state after a round, if it was one: without a roll it was a hand-over alone."""
        if state.rolled == 0.0:
            return state
        if theta - state.theta < self.least_turn:
            return changed(state, theta=theta, cycle=state.cycle + 1, vain=state.vain + 1)
        return changed(state, theta=theta, cycle=state.cycle + 1, vain=0, round=state.round + 1)

    def _following(self, state: GaitState, estimate: Estimate) -> Phase:
        if state.phase is Phase.ROLL and self.plan.course is Course.STROKE:
            return Phase.HOLD
        if state.phase is Phase.SETTLE and state.gripping[FF_RF].any():
            return Phase.REMOVE if _pushed_off(state, estimate) else Phase.SUPPORT
        return NEXT[state.phase]

    def _enter(self, state: GaitState, estimate: Estimate) -> GaitState:
        """Start of a phase: remember where the fingers are, and aim at where the handle is."""
        phase = state.phase
        if phase is Phase.ADD:
            target = self.placing.before_handle(self.plan.adding(1.0), SUPPORTING, estimate, self.standoff)
        elif phase is Phase.RELOCATE:
            target = self.placing.before_handle(self.plan.returning(1.0), ROLLING, estimate, self.standoff)
        elif phase is Phase.LEAVE:
            # from where a short stroke has ended they lift off alike
            target = self.plan.leaving(1.0) + self.plan.rolling(self._progress(state)) - self.plan.rolling(1.0)
        else:
            target = self.plan.rolling(0.0) if phase is Phase.REMOVE else state.q_target
        if phase is Phase.ROLL:
            return changed(state, q_from=estimate.q, q_target=target, rolled=0.0, stroke=self._stroke(state))
        return changed(state, q_from=estimate.q, q_target=target)

    def _stroke(self, state: GaitState) -> float:
        """How far to roll now [rad]."""
        full = self.plan.stroke
        spring = state.rests if springs_back(state.falls).spring else ()
        return full if self.budget is None else self.budget.stroke(full, state.round, state.ends, spring)

    def _progress(self, state: GaitState) -> float:
        """Share of the plan's roll that has been rolled."""
        return state.rolled / self.plan.stroke

    def _turning(self, state: GaitState) -> float:
        """Trapezoid over the stroke: up in `ramp`, full speed, down in `ramp` to a twentieth [rad/s].

        Over the way back, likewise, down to nothing.
        """
        if state.phase is Phase.RELOCATE:
            return self.support_speed * min(state.clock / self.ramp, (self.relocate - state.clock) / self.ramp, 1.0)
        if state.phase is Phase.BACK:
            return -self.back_speed
        if state.phase is not Phase.ROLL:
            return 0.0
        left = max(state.stroke - state.rolled, 0.0)
        fall = np.sqrt(2 * left / (self.speed * self.ramp)) + 0.05
        return self.speed / self._effort(state) * float(min(state.clock / self.ramp + 0.05, fall, 1.0))

    def _effort(self, state: GaitState) -> float:
        """How much firmer, and slower, than at first."""
        return 1.0 + self.firmer * state.vain

    def _gripping(self, state: GaitState, estimate: Estimate) -> Flags:
        """Who carries the tool: a finger joins when it has felt the handle, and leaves when its share is gone."""
        phase, clock = state.phase, state.clock
        if phase in FEELING and state.near:
            return np.asarray(state.gripping | (FEELING[phase] & estimate.touching))
        if clock > self.take and phase is Phase.LEAVE:
            return np.asarray(state.gripping & ~TH_MF)
        if clock > self.take and phase is Phase.REMOVE:
            return np.asarray(state.gripping & ~FF_RF)
        return state.gripping

    def _share(self, state: GaitState) -> Array:
        """Share of each finger in the load (5,), 0 to 1."""
        share = np.ones(len(FINGERS))
        ramp = min(state.clock / self.take, 1.0)
        phase = state.phase
        rising, falling = FIRST_SHARE + (1 - FIRST_SHARE) * ramp, 1.0 - ramp
        share[FF_RF] = {Phase.ADD: FIRST_SHARE, Phase.SUPPORT: rising, Phase.REMOVE: falling}.get(phase, 1.0)
        feeling, taking = (Phase.RETURN, Phase.CATCH), (Phase.REGRIP, Phase.GRASP)
        share[TH_MF] = FIRST_SHARE if phase in feeling else rising if phase in taking else 1.0
        if phase is Phase.LEAVE:
            share[TH_MF] = falling
        return np.where(state.gripping, share, 0.0)

    def _reaching(self, state: GaitState) -> Flags:
        if state.phase in FEELING and state.near:
            return np.asarray(FEELING[state.phase] & ~state.gripping)
        return np.zeros(len(FINGERS), dtype=bool)

    def _near(self, state: GaitState, estimate: Estimate) -> bool:
        """Whether the fingers that are to feel for the handle have come before it; one that is to catch it is there.

        One that something keeps away from there does so all the same, after as long as feeling takes.
        """
        since = state.clock - (self.add if state.phase is Phase.ADD else state.aside)
        if state.phase not in FEELING or since <= 0.0:
            return False
        if state.near or state.phase is Phase.CATCH or since > self.standoff / self.closing:
            return True
        feeling = [FINGERS[row] for row in np.flatnonzero(FEELING[state.phase])]
        left, speed = self.placing.left(estimate, state.q_target, feeling)
        return left <= self.near and speed <= self.slow

    def _free_posture(self, state: GaitState) -> Array:
        """The plan's path through this phase, bent to begin where the fingers were and to end where they must."""
        start, length = {
            Phase.ADD: (0.0, self.add), Phase.LEAVE: (self.take, self.leave), Phase.RELOCATE: (0.0, self.relocate),
            Phase.REMOVE: (self.take, self.leave),
        }.get(state.phase, (0.0, 0.0))  # fmt: skip
        if length == 0.0:
            return state.q_target
        s = smooth((state.clock - start) / length)
        path = {
            Phase.ADD: self.plan.adding, Phase.LEAVE: self.plan.leaving, Phase.RELOCATE: self.plan.relocating,
            Phase.REMOVE: self._removing,
        }[state.phase]  # fmt: skip
        return np.asarray(path(s) + (1 - s) * (state.q_from - path(0.0)) + s * (state.q_target - path(1.0)))

    def _removing(self, s: float) -> Array:
        return self.plan.adding(1.0 - s, rolled=0.0)

    def _goal(self, state: GaitState, estimate: Estimate, turning: float) -> Goal:
        reaching = self._reaching(state)
        roles = np.where(state.gripping, GRIP, np.where(reaching, REACH, FREE))
        share = self._share(state)
        moves_arm = self.recentre and state.phase in (Phase.SETTLE, Phase.ROLL)
        progress = self._progress(state) if state.phase in HELD_BY_TH_MF else 0.0
        return Goal(
            phase=state.phase,
            round=state.round,
            vain=state.vain,
            roles=roles,
            share=share,
            squeeze=share * self._effort(state) * np.where(FF_RF, self.support_squeeze, self.squeeze),
            approach=np.where(reaching[:, None], -self.closing * estimate.n_W, 0.0),
            q_free=self._free_posture(state),
            q_guide=self.plan.rolling(progress),
            turn_rate=-turning,
            tip_force=self.tip_force,
            V_palm=self.placing.palm_twist(estimate) if moves_arm else np.zeros(6),
        )

    def _is_over(self, state: GaitState, estimate: Estimate) -> bool:
        clock, phase = state.clock, state.phase
        if phase is Phase.ROLL:
            at_limit = self.placing.meets_limit(estimate.q, estimate.v, ROLLING, self.stop, self.braking)
            return state.rolled >= state.stroke or (at_limit and state.rolled > self.begun)
        if phase is Phase.SETTLE:
            waited = clock >= self.settle_most or _pushed_off(state, estimate)
            return clock >= self.settle and (waited or self._is_centred(estimate))
        if phase in (Phase.ADD, Phase.RETURN):
            return bool(state.gripping[TH_MF | FF_RF].all())
        if phase is Phase.CATCH:
            return bool(state.gripping[TH_MF].all())
        duration = {
            Phase.SUPPORT: self.take, Phase.LEAVE: self.take + self.leave,
            Phase.RELOCATE: self.relocate, Phase.REGRIP: self.take, Phase.REMOVE: self.take + self.leave,
            Phase.HOLD: self.held, Phase.GRASP: self.take, Phase.BACK: self.back / self.back_speed,
        }[phase]  # fmt: skip
        return clock >= duration

    def _is_centred(self, estimate: Estimate) -> bool:
        return not self.recentre or knuckle_way(self.placing.palm_error(estimate)) <= self.centred


def _pushed_off(state: GaitState, estimate: Estimate) -> bool:
    """Whether FF or RF, which are to hold the tool, touch it no more with their tips.

    In a grasp that a search has left, the handle may lie against their other links: pressing on, they push the tool out
    of the hand.  They are to let go of it, and come anew after a roll.
    """
    return bool((state.gripping & ~estimate.touching)[FF_RF].any())


def smooth(s: float) -> float:
    """Minimum-jerk blend of 0 to 1, flat at both ends (Flash and Hogan, 1985)."""
    s = min(max(s, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)
