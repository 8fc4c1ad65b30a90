"""The search itself: the blade's lowest corner feels for the slot, and leads the blade in.

A blade that lies flat on the head finds a slot a fifth of a millimetre wider than itself only where all of it is right.
One corner finds it wherever it crosses: the tool leans along its edge, and a corner that is swept across drops in.  It
is drawn along the slot to the closed end, which holds it with a force that friction could not; the tool is righted
there, and the rest of the blade has no other way than in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from turnscrew.decide.felt_force import FeltForce
from turnscrew.decide.reseat_pose import corner_T, leaning, seen_from, toward
from turnscrew.decide.reseat_state import Felt, ReseatState, Step
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.signals import Estimate
from turnscrew.values import changed

Z = np.array([0.0, 0.0, 1.0])

FOLLOW, SPEED, TURNING = 8.0, 0.03, 0.3
"""Rate at which the arm follows the pose that it is told [1/s], a quarter of its servos'; its limits [m/s, rad/s]."""

DOWN, UP = 0.003, 0.006
"""How fast the hand goes after a head that is not felt, and gives way to one that is [m/s]."""

NEAR = 0.0015
"""How far from where the head should be something may be felt that counts as it [m]: three sigmas of the camera's."""

DEEPER, HIGHER = 0.001, 0.001
"""How far the corner as told may go below and above where it rested, while it is swept [m]."""

MORE = 0.17
"""The largest lean that is made up for [rad], as much as the tool leans itself."""

TOUCHED, CAUGHT, HELD = 0.02, 0.05, 0.1
"""How long the head, a drop, the slot's end must be felt [s]: noise that fingers tell lasts a tick or two."""

GIVING = 0.012
"""How fast the hand gives way to a wall while the tip is to stay [m/s]: it is 6 mm ahead of one that is stopped."""

DRAGGED = 10.0
"""Longest drag [s]: 24 mm of the hand, of which the fingers give 10, and twice to and fro about the axis."""


ASTRAY = 0.01
"""Distance from the slot's centre at which the tip has no business [m]: a search keeps within 5 mm, and what the camera
tells of a tool that is pushed about errs by up to 4 mm."""

INSIDE = (Step.ALIGN, Step.DRAG, Step.RIGHT)
"""Steps in which the corner, at least, is in the slot, and the hand follows a tool that is pulled over."""

SLACK = (Step.RIGHT, Step.PRESS)
"""Steps in which the hand pulls little."""


class Touch(NamedTuple):
    """What is felt in a tick.

    Attributes:
        pose: The tool's if nothing pushed it: p_WT (3,) in W [m], R_WT (3, 3).
        corner: (3,) where its lowest corner is, as the fingers have given way, in W [m].
        lag: (3,) how far the corner would be from there if nothing pushed it [m].
        force: (3,) what pushes the tip, in W [N].
        drop: How far the corner is below the head [m].
        more: By how much the tool leans more along its edge than it would [rad].
    """

    pose: tuple[Array, Array]
    corner: Array
    lag: Array
    force: Array
    drop: float
    more: float


@dataclass(frozen=True)
class Search:
    """Sizes, speeds and forces of the search.

    Attributes:
        feel: What the locked fingers tell.
        width: Of the blade [m].
        depth: Of the slot [m].
        lean: Of the tool [rad]: a corner that is 2 mm inside sinks by .9 mm before the edge meets the other end.
        press: Force on the head [N]: friction then holds less than .5 N, and a corner drops in at once.
        firm: The same while the tool is righted [N]: what fingers tell meanwhile errs by half a newton.
        give_way: How fast the hand gives way to a force beyond that [m/s/N]: fingers are .4 mm/N soft upwards.
        land: Speed downwards [m/s].
        ahead: How far towards the slot's end from its middle the corner comes down [m]: half of what there is.
        aside: How far beside the slot [m]: three times what the camera leaves of doubt in LOOK.
        beyond: How far on the other side it is looked for [m]: the head goes on for 4.5 mm.
        stuck: How far the hand may be ahead of a tip that does not follow [m].
        sweep: Speed on the head [m/s].
        sweeps: After how many sweeps there is no slot.
        dropped: How far the corner falls where there is a slot [m], what is felt of heights errs by a third of it.
        around: How far the tool is turned to either side to find the slot's heading [rad]: a tool that winds up in the
            fingers, and turns on while its loss goes unnoticed, leaves 8 deg of doubt; from 3 deg on the blade sinks.
        ease: Time before that in which the hand gives way to a wall that has stopped it [s]: a blade that is pushed
            against one leaves the slot as it turns, and bent fingers tell the height wrong.
        scan: How fast [rad/s]: .1 s of feeling is a degree.
        sunk: How far the corner sinks where the blade is parallel to the slot [m].  A blade that leans by 10 deg, and
            is turned from the slot by a, gets in as far as .2 mm of play let it, .035 mm / tan a: .4 mm at 5 deg,
            .67 mm at 3 deg, and .8 mm before it meets the slot's other end; .1 to .2 mm more are felt.
        past: How far beyond where it begins to sink so far the slot's heading is [rad].
        end: Force at which the slot's end is found [N], twice what friction can hold,
        most: and where the hand stops pulling [N].
        pull: Force with which the blade is held against it while it is righted [N]: fingers that are bent by more tell
            heights and forces so wrong that the hand lifts the blade out.
        hold: The same in the end, to see whether it is in [N]: on the head, friction holds half of that.
        tightening: Time in which the hand pulls so far [s], and then as long again.
        held: What must be left of that, on the average, for the tip to be in [N],
        runs: and how far the hand may go on meanwhile [m], 4 mm where fingers creep: on the head it would run away
            from the tip by 10 mm.
        slacken: Time in which the hand goes back until then [s].
        pressing: Time for which the blade is pressed in the end [s]: a pull lifts it by some tenths of a millimetre.
        soft: How far the hand moves for a newton sideways, in a second [m/s/N]: twice a second what the fingers give.
        rest: Time for which it rests on the head [s].
        righting: Time in which the tool is righted [s].
        yaw: How far it is turned to and fro in the end [rad], a heading's error,
        pace: and how often [1/s].
        lost: How far the hand may go down or up without anything to press on [m].
        bent: The lean that fingers give way to, over what encoders tell of it.
    """

    feel: FeltForce
    width: float
    depth: float
    lean: float = np.radians(10.0)
    press: float = 0.7
    firm: float = 1.2
    give_way: float = 0.004
    land: float = 0.003
    ahead: float = 0.0015
    aside: float = 0.0022
    beyond: float = 0.0032
    stuck: float = 0.010
    sweep: float = 0.004
    sweeps: int = 3
    dropped: float = 0.00035
    around: float = np.radians(7.0)
    ease: float = 1.0
    scan: float = 0.15
    sunk: float = 0.00075
    past: float = np.radians(2.0)
    end: float = 1.0
    most: float = 1.8
    pull: float = 0.3
    hold: float = 1.2
    tightening: float = 2.5
    held: float = 0.7
    runs: float = 0.006
    slacken: float = 1.5
    pressing: float = 1.0
    soft: float = 0.012
    righting: float = 3.0
    rest: float = 0.8
    yaw: float = np.radians(5.0)
    pace: float = 0.5
    lost: float = 0.006
    bent: float = 1.3

    def over(self, state: ReseatState, estimate: Estimate, above: float) -> Array:
        """(3,) where the lowest corner is to be before it comes down, in W [m].

        Args:
            state: Which corner, and the slot's heading.
            estimate: Where the slot is.
            above: Height over the head [m].
        """
        return estimate.p_WS + self.ahead * state.along - self.aside * state.across + (self.depth + above) * Z

    def begin(self, state: ReseatState, estimate: Estimate, corner: Array, q: Array) -> ReseatState:
        """The state when the hand is over the slot and comes down.

        Args:
            state: In LOOK.
            estimate: The tool's pose, and where the slot is.
            corner: (3,) where the lowest corner is to be now, in W [m].
            q: (28,) encoder angles of the locked fingers, averaged [rad].
        """
        felt = self.feel.init(q, estimate)
        return changed(
            state.to(Step.LAND), felt=felt, corner=corner, lean=self.lean, slot=estimate.p_WS, way=1.0,
            sweeps=0,
        )  # fmt: skip

    def update(self, state: ReseatState, estimate: Estimate, dt: float) -> tuple[ReseatState, Array]:
        """One tick.

        Args:
            state: In LAND or later.
            estimate: Joint angles, contacts.
            dt: Time since the last tick [s].

        Returns:
            The new state, and the palm's twist (6,) in W, linear first [m/s, rad/s].
        """
        if state.felt is None:
            return state, np.zeros(6)
        felt = self.feel.update(state.felt, estimate, state.gripping, dt)
        state = changed(state, felt=felt)
        touch = self._touch(state, felt, estimate)
        before = state.corner
        steps: dict[Step, Callable[[ReseatState, Touch, float], ReseatState]] = {
            Step.LAND: self._land, Step.REST: self._rest, Step.SWEEP: self._sweep,
            Step.ALIGN: self._align, Step.DRAG: self._drag, Step.RIGHT: self._right, Step.TURN: self._turn,
            Step.PRESS: self._press,
        }  # fmt: skip
        state = steps[state.step](state, touch, dt)
        away = float(np.hypot(*(estimate.p_WT - estimate.p_WS)[:2]))
        if away > ASTRAY:
            return state.failed(f"the camera has the tip {1e3 * away:.0f} mm away"), np.zeros(6)
        wanted = self._told(state, touch)
        V, _ = toward(touch.pose, wanted, FOLLOW, SPEED, TURNING)
        V[:3] += (state.corner - before) / dt
        return state, seen_from(V, touch.pose[0], self.feel.robot.palm(estimate.q)[0])

    def _touch(self, state: ReseatState, felt: Felt, estimate: Estimate) -> Touch:
        """What is felt now."""
        p, R = self.feel.unpushed(felt, estimate)
        corner = corner_T(state.side, 0.5 * self.width)
        there = p + felt.give[:3] + exp_so3(felt.give[3:]) @ R @ corner
        more = state.side * float(felt.give[3:] @ state.across)
        lag = p + R @ corner - there
        return Touch((p, R), there, lag, felt.force, state.surface - float(there[2]), more)

    def _told(self, state: ReseatState, touch: Touch) -> tuple[Array, Array]:
        """Pose of the tool if nothing pushed it; once the corner is in, less the lean by which it is pulled over."""
        more, turn = 0.0, state.turn
        if state.step in INSIDE:
            more = self._more(touch)
        if state.step in (Step.DRAG, Step.RIGHT, Step.TURN):
            turn = self.yaw * self._swing(state)
        return leaning(state.corner, state.heading + turn, state.side, state.lean - more, 0.5 * self.width)

    def _more(self, touch: Touch) -> float:
        """The lean by which the tool is pulled over [rad]."""
        return min(max(self.bent * touch.more, -MORE), MORE)

    def _pressed(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) the corner as told, moved up or down so that the tip is pressed as wanted."""
        press = self.firm if state.step in SLACK else self.press
        rate = min(max(self.give_way * (float(touch.force[2]) - press), -DOWN), UP)
        return state.corner + rate * dt * Z

    def _land(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = state.corner - self.land * dt * Z
        seen = state.seen + dt if float(touch.force[2]) > 0.6 * self.press else 0.0
        state = changed(state, corner=corner, seen=seen)
        above = float(touch.corner[2] - state.slot[2]) - self.depth
        if seen > TOUCHED:
            near = abs(above) < NEAR
            return state.to(Step.REST) if near else state.failed(f"felt {1e3 * above:.1f} mm over the head")
        return state.failed("no head below") if above < -2.0 * NEAR else state

    def _rest(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        share = 1.0 if state.clock < 0.3 else dt / 0.1
        surface = state.surface + share * (float(touch.corner[2]) - state.surface)
        state = changed(state, corner=self._pressed(state, touch, dt), surface=surface)
        if state.clock < self.rest or state.felt is None:
            return state
        return changed(state.to(Step.SWEEP), rest=float(state.corner[2]), felt=state.felt.levelled())

    def _sweep(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = self._pressed(state, touch, dt) + state.way * self.sweep * dt * state.across
        # a force that is read wrong must not lift the tip off, nor press it into a slot's rim
        corner[2] = min(max(corner[2], state.rest - DEEPER), state.rest + HIGHER)
        surface = state.surface
        if touch.drop < 0.5 * self.dropped:
            surface += dt / 0.4 * (float(touch.corner[2]) - surface)
        # a blade that is turned by 8 deg sinks too little to be felt, but does not get on
        stopped = -state.way * float(touch.force @ state.across) > self.end
        seen = state.seen + dt if touch.drop > self.dropped or stopped else 0.0
        state = changed(state, corner=corner, surface=surface, seen=seen)
        if seen > CAUGHT:
            return changed(state.to(Step.ALIGN), turn=0.0, sunk=0.0, sunk_at=0.0)
        across = state.way * float((touch.corner - state.slot) @ state.across)
        if across < self.beyond and state.way * float(touch.lag @ state.across) < self.stuck:
            return state
        if state.sweeps + 1 >= self.sweeps:
            return state.failed("no slot where it was looked for")
        return changed(state, way=-state.way, sweeps=state.sweeps + 1)

    def _align(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = self._pressed(state, touch, dt) + self._aside(state, touch, dt)
        state = changed(state, corner=corner)
        if state.clock < self.ease:
            return state
        # a blade that is turned the wrong way first may come out, and the next attempt begins the other way
        first = 1.0 if state.attempt % 2 == 0 else -1.0
        way = first if state.clock - self.ease < self.around / self.scan else -first
        state = changed(state, turn=state.turn + way * self.scan * dt)
        if touch.drop > state.sunk:
            state = changed(state, sunk=touch.drop, sunk_at=state.turn)
        seen = state.seen + dt if touch.drop > self.sunk else 0.0
        state = changed(state, seen=seen)
        if seen > HELD:
            return state.found(state.turn + way * self.past).to(Step.DRAG)
        if first * state.turn > -self.around:
            return state
        if state.sunk < 0.5 * self.dropped:
            return state.failed("what stopped the corner is no slot")
        return changed(state.to(Step.DRAG), heading=state.heading + state.sunk_at, turn=0.0)

    def _drag(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        pulled = -float(touch.force @ state.along)
        rate = min(max(self.soft * (self.most - pulled), 0.0), self.sweep)
        corner = self._pressed(state, touch, dt) + rate * dt * state.along + self._aside(state, touch, dt)
        # what is felt swings with the tool
        found = state.felt is not None and -float(state.felt.slow @ state.along) > self.end
        state = changed(state, corner=corner, seen=state.seen + dt if found else 0.0)
        # a blade that is jammed between the slot's walls comes free in half a swing
        if state.seen > 0.5 / self.pace:
            return state.to(Step.RIGHT)
        adrift = abs(float(corner[2]) - state.rest) > self.lost
        return state.failed("the slot has no end") if adrift or state.clock > DRAGGED else state

    def _right(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        since = max(state.clock - self.slacken, 0.0)
        lean = self.lean * max(1.0 - since / self.righting, 0.0)
        state = changed(state, corner=self._pulled(state, touch, dt), lean=lean)
        if since < 1.1 * self.righting:
            return state
        return changed(state.to(Step.TURN), held=self._hand(state, touch), lean=-self._more(touch))

    def _turn(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        state = changed(state, corner=self._level(state, touch, dt))
        if state.clock < self.tightening:
            return changed(state, held=self._hand(state, touch))
        if state.felt is None or state.clock < 2.0 * self.tightening:
            return state
        pulled = -float(state.felt.slow @ state.along)
        way = float((self._hand(state, touch) - state.held) @ state.along)
        if pulled > self.held and way < self.runs:
            return state.to(Step.PRESS)
        return state.failed(f"{pulled:.1f} N hold the tip, and the hand has gone on by {1e3 * way:.0f} mm")

    def _press(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        slack = state.clock > self.slacken
        corner = self._pulled(state, touch, dt) if slack else self._level(state, touch, dt)
        state = changed(state, corner=corner)
        return state.to(Step.DONE) if state.clock > self.slacken + self.pressing else state

    def _level(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) the corner as told, pulled at as wanted.

        Fingers that are bent along the slot tell heights wrong: the hand stays at its own, or it lifts the blade out.
        """
        corner = self._pulled(state, touch, dt)
        corner[2] = state.corner[2]
        return corner

    def _hand(self, state: ReseatState, touch: Touch) -> Array:
        """(3,) where the corner would be if nothing pushed it, as the hand is now, in W [m]."""
        p, R = touch.pose
        return p + R @ corner_T(state.side, 0.5 * self.width)

    def _swing(self, state: ReseatState) -> float:
        """To and fro, -1 to 1."""
        return float(np.sin(2.0 * np.pi * self.pace * state.clock))

    def _pulled(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) the corner as told, moved so that it is pressed and held against the slot's end as wanted."""
        missing = (self.pull if state.step in SLACK else self.hold) + float(touch.force @ state.along)
        step = min(max(self.soft * missing, -self.sweep), self.sweep) * dt
        return self._pressed(state, touch, dt) + step * state.along + self._aside(state, touch, dt)

    def _aside(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) how far the corner as told gives way to a wall of the slot [m]."""
        push = self.soft * float(touch.force @ state.across)
        most = GIVING if state.step is Step.ALIGN else self.sweep
        return np.asarray(min(max(push, -most), most) * dt * state.across)
