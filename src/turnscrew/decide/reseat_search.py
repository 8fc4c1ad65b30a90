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

SLACK, SLIPPED = 0.2, 0.8
"""Force of the slot's end below which [N], and for how long [s], a tip has slipped over it."""

DRAGGED = 6.0
"""Longest drag [s]: 24 mm of the hand, of which the fingers give 10."""


INSIDE = (Step.DRAG, Step.RIGHT, Step.TURN)
"""Steps in which the corner, at least, is in the slot."""


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
        give_way: How fast the hand gives way to a force beyond that [m/s/N]: fingers are .4 mm/N soft upwards.
        land: Speed downwards [m/s].
        ahead: How far towards the slot's end from its middle the corner comes down [m]: half of what there is.
        aside: How far beside the slot [m]: three times what the camera leaves of doubt in LOOK.
        beyond: How far on the other side it is looked for [m]: the head goes on for 4.5 mm.
        stuck: How far the hand may be ahead of a tip that does not follow [m].
        sweep: Speed on the head [m/s].
        sweeps: After how many sweeps there is no slot.
        dropped: How far the corner falls where there is a slot [m], what is felt of heights errs by a third of it.
        end: Force at which the slot's end is found [N], twice what friction can hold.
        pull: Force with which the blade is held against it afterwards [N].
        held: What must be left of that, on the average, for the tip to be in [N],
        runs: and how far the hand may go on meanwhile [m]: on the head it would run away from the tip by 8 mm.
        soft: How far the hand moves for a newton sideways, in a second [m/s/N]: twice a second what the fingers give.
        rest: Time for which it rests on the head [s].
        righting: Time in which the tool is righted [s].
        yaw: How far it is turned to and fro in the end [rad], a heading's error,
        pace: and how often [1/s].
        lost: How far the hand may go down or up without anything to press on [m].
        bent: Part of a lean that fingers give that encoders tell is 1 of this.
    """

    feel: FeltForce
    width: float
    depth: float
    lean: float = np.radians(10.0)
    press: float = 0.7
    give_way: float = 0.004
    land: float = 0.003
    ahead: float = 0.0015
    aside: float = 0.0022
    beyond: float = 0.0032
    stuck: float = 0.010
    sweep: float = 0.004
    sweeps: int = 3
    dropped: float = 0.00035
    end: float = 1.0
    pull: float = 0.9
    held: float = 0.35
    runs: float = 0.003
    soft: float = 0.012
    righting: float = 2.0
    rest: float = 0.8
    yaw: float = np.radians(6.0)
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
            Step.LAND: self._land, Step.REST: self._rest, Step.SWEEP: self._sweep, Step.DRAG: self._drag,
            Step.RIGHT: self._right, Step.TURN: self._turn,
        }  # fmt: skip
        state = steps[state.step](state, touch, dt)
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
        more = turn = 0.0
        if state.step in INSIDE:
            more = min(max(self.bent * touch.more, -MORE), MORE)
        if state.step is Step.TURN:
            turn = self.yaw * min(self.pace * state.clock, 1.0) * float(np.sin(2.0 * np.pi * self.pace * state.clock))
        return leaning(state.corner, state.heading + turn, state.side, state.lean - more, 0.5 * self.width)

    def _pressed(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) the corner as told, moved up or down so that the tip is pressed as wanted."""
        rate = min(max(self.give_way * (float(touch.force[2]) - self.press), -DOWN), UP)
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
        seen = state.seen + dt if touch.drop > self.dropped else 0.0
        state = changed(state, corner=corner, surface=surface, seen=seen)
        if seen > CAUGHT:
            return state.to(Step.DRAG)
        across = state.way * float((touch.corner - state.slot) @ state.across)
        if across < self.beyond and state.way * float(touch.lag @ state.across) < self.stuck:
            return state
        if state.sweeps + 1 >= self.sweeps:
            return state.failed("no slot where it was looked for")
        return changed(state, way=-state.way, sweeps=state.sweeps + 1)

    def _drag(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = self._pressed(state, touch, dt) + self.sweep * dt * state.along + self._aside(state, touch, dt)
        seen = state.seen + dt if -float(touch.force @ state.along) > self.end else 0.0
        state = changed(state, corner=corner, seen=seen)
        if seen > HELD:
            return state.to(Step.RIGHT)
        adrift = abs(float(corner[2]) - state.rest) > self.lost
        return state.failed("the slot has no end") if adrift or state.clock > DRAGGED else state

    def _right(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        lean = self.lean * max(1.0 - state.clock / self.righting, 0.0)
        loose = -float(touch.force @ state.along) < SLACK
        seen = state.seen + dt if loose else 0.0
        state = changed(state, corner=self._pulled(state, touch, dt), lean=lean, seen=seen)
        if seen > SLIPPED:
            return state.failed("the slot's end has let go")
        if state.clock < 1.1 * self.righting:
            return state
        return changed(state.to(Step.TURN), held=state.corner)

    def _turn(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        state = changed(state, corner=self._pulled(state, touch, dt))
        if state.felt is None or state.clock < 1.0 / self.pace:
            return state
        pulled, way = -float(state.felt.slow @ state.along), float((state.corner - state.held) @ state.along)
        if pulled > self.held and way < self.runs:
            return state.to(Step.DONE)
        return state.failed(f"{pulled:.1f} N hold the tip, and the hand has gone on by {1e3 * way:.0f} mm")

    def _pulled(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) the corner as told, moved so that it is pressed and held against the slot's end as wanted."""
        missing = self.pull + float(touch.force @ state.along)
        step = min(max(self.soft * missing, -self.sweep), self.sweep) * dt
        return self._pressed(state, touch, dt) + step * state.along + self._aside(state, touch, dt)

    def _aside(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) how far the corner as told gives way to a wall of the slot [m]."""
        push = self.soft * float(touch.force @ state.across)
        return np.asarray(min(max(push, -self.sweep), self.sweep) * dt * state.across)
