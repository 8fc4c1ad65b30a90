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

from turnscrew.decide.reseat_pose import corner_T, leaning, seen_from, toward
from turnscrew.decide.reseat_sizes import SearchSizes
from turnscrew.decide.reseat_state import Felt, ReseatState, Step
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3
from turnscrew.signals import Estimate
from turnscrew.values import changed

Z = np.array([0.0, 0.0, 1.0])

SPEED, TURNING = 0.03, 0.3
"""Largest speeds at which the arm follows the pose that it is told [m/s, rad/s]."""

DOWN, UP = 0.006, 0.006
"""How fast the hand goes after a head that is not felt, and gives way to one that is [m/s]."""

INSIDE_UP = 0.002
"""The same once the corner is in the slot [m/s]: a wall that is felt for .1 s must not lift it out, bent fingers take
the hand up by a millimetre in a second."""

NEAR = 0.0025
"""How far from where the head should be something may be felt that counts as it [m]: the camera errs by .5 mm, and by
1.5 deg, which are another .5 mm of the corner's height."""

NEARER = (0.0, 1.0)
"""Shares of `SearchSizes.nearer` by which sweeps of an attempt, in turn, are nearer to the slot's middle."""

DEEPER, HIGHER = 0.001, 0.001
"""How far the corner as told may go below and above where it rested, while it is swept [m]."""

MORE = 0.17
"""The largest lean that is made up for [rad], as much as the tool leans itself."""

TOUCHED, CAUGHT, HELD = 0.02, 0.25, 0.1
"""How long the head, a drop, the slot's end must be felt [s]: noise of forces lasts a tick or two, of heights .1 s, and
a hand that goes up and down on the head feels a drop for half of that time."""

SHARPNESS = 4
"""Power of a depth with which it counts where the blade is parallel: it sinks twice as far there as 5 deg aside."""

GIVING = 0.012
"""How fast the hand gives way to a wall while the tip is to stay [m/s]: it is 6 mm ahead of one that is stopped."""

DRAGGED = 10.0
"""Longest drag [s]: 24 mm of the hand, of which the fingers give 10, and twice to and fro about the axis."""

LATELY = 1.5
"""Over what time the height of a tip that should be in is averaged [s]: bent fingers tell it wrong by .5 mm."""

ON_THE_HEAD = "the tip is held, but lies on the head"

ASTRAY = 0.01
"""Distance from the slot's centre at which the tip has no business [m]: a search keeps within 5 mm, and what the camera
tells of a tool that is pushed about errs by up to 4 mm."""

INSIDE = (Step.ALIGN, Step.DRAG, Step.RIGHT)
"""Steps in which the corner, at least, is in the slot, and the hand follows a tool that is pulled over."""

SLACK = (Step.RIGHT, Step.PRESS)
"""Steps in which the hand pulls little."""

FIRM = (Step.DRAG, *SLACK)
"""Steps in which it presses more."""


class Touch(NamedTuple):
    """What is felt in a tick.

    Attributes:
        pose: The tool's if nothing pushed it: p_WT (3,) in W [m], R_WT (3, 3).
        corner: (3,) where its lowest corner is, as the fingers have given way, in W [m]: true to a tenth of a
            millimetre in height, but a tip that is held back sideways also turns in the fingers, by millimetres.
        seen: (3,) where the camera has it [m], which errs by a millimetre.
        lag: (3,) how far the corner would be from there if nothing pushed it [m].
        force: (3,) what pushes the tip, in W [N].
        drop: How far the corner is below the head [m].
        more: By how much the tool leans more along its edge than it would [rad].
        yaw: By how much it is turned farther about the vertical than it would be [rad]: walls hold it back.
    """

    pose: tuple[Array, Array]
    corner: Array
    seen: Array
    lag: Array
    force: Array
    drop: float
    more: float
    yaw: float


@dataclass(frozen=True)
class Search(SearchSizes):
    """The search, once the tip comes down, with its sizes, speeds and forces."""

    def over(self, state: ReseatState, estimate: Estimate, above: float) -> Array:
        """(3,) where the lowest corner is to be before it comes down, in W [m].

        Args:
            state: Which corner, and the slot's heading.
            estimate: Where the slot is.
            above: Height over the head [m].
        """
        return estimate.p_WS + self._ahead(state) * state.along - self.aside * state.across + (self.depth + above) * Z

    def _ahead(self, state: ReseatState) -> float:
        """How far from the slot's middle, towards its end, the corner is to sweep [m].

        What is believed of the slot errs by the same each time: further sweeps are made elsewhere.
        """
        return self.ahead - self.nearer * NEARER[state.sweeps % len(NEARER)]

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
            state.to(Step.LAND), felt=felt, corner=corner, lean=self.lean, slot=estimate.p_WS,
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
        V, _ = toward(touch.pose, wanted, self.follow, SPEED, TURNING)
        V[:3] += (state.corner - before) / dt + self._tap(state, np.cos) * 2.0 * np.pi * self.tapping
        return state, seen_from(V, touch.pose[0], self.feel.robot.palm(estimate.q)[0])

    def _touch(self, state: ReseatState, felt: Felt, estimate: Estimate) -> Touch:
        """What is felt now."""
        p, R = self.feel.unpushed(felt, estimate)
        corner = corner_T(state.side, 0.5 * self.width)
        there = p + felt.give[:3] + exp_so3(felt.give[3:]) @ R @ corner
        more = state.side * float(felt.give[3:] @ state.across)
        seen = estimate.p_WT + estimate.R_WT @ corner
        lag = p + R @ corner - seen
        return Touch((p, R), there, seen, lag, felt.force, state.surface - float(there[2]), more, float(felt.give[5]))

    def _told(self, state: ReseatState, touch: Touch) -> tuple[Array, Array]:
        """Pose of the tool if nothing pushed it; once the corner is in, less the lean by which it is pulled over."""
        more, turn = 0.0, state.turn
        if state.step in INSIDE:
            # little by little, for a corner that is not in after all would slip away
            more = self._more(touch) * (min(state.clock / self.ease, 1.0) if state.step is Step.ALIGN else 1.0)
        if state.step in (Step.DRAG, Step.RIGHT, Step.TURN):
            turn = self.yaw * self._swing(state)
        corner = state.corner + self._tap(state, np.sin)
        return leaning(corner, state.heading + turn, state.side, state.lean - more, 0.5 * self.width)

    def _tap(self, state: ReseatState, wave: Callable[[float], float]) -> Array:
        """(3,) how far the hand is up and down, or with a cosine how fast over 2 pi times how often [m]."""
        tapped = self.tapped if state.step is Step.SWEEP else 0.0
        return tapped * wave(2.0 * np.pi * self.tapping * state.clock) * Z

    def _more(self, touch: Touch) -> float:
        """The lean by which the tool is pulled over [rad]."""
        return min(max(self.bent * touch.more, -MORE), MORE)

    def _pressed(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) the corner as told, moved up or down so that the tip is pressed as wanted."""
        press = self.firm if state.step in FIRM else self.press
        up = INSIDE_UP if state.step in INSIDE else UP
        rate = min(max(self.give_way * (float(touch.force[2]) - press), -DOWN), up)
        return state.corner + rate * dt * Z

    def _land(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = state.corner - self.land * dt * Z
        seen = state.seen + dt if float(touch.force[2]) > 0.6 * self.press else 0.0
        state = changed(state, corner=corner, seen=seen)
        above = float(touch.corner[2] - state.slot[2]) - self.depth
        if above < -NEAR:
            return state.failed("no head below")
        if seen < TOUCHED or state.felt is None:
            return state
        # high over the head there is nothing: fingers are still coming to rest
        return state.to(Step.REST) if above < NEAR else changed(state, felt=state.felt.zeroed(), seen=0.0)

    def _rest(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        if self._left(state, touch):
            return state.failed("the tip has come down elsewhere")
        share = 1.0 if state.clock < 0.3 else dt / 0.1
        surface = state.surface + share * (float(touch.corner[2]) - state.surface)
        state = changed(state, corner=self._pressed(state, touch, dt), surface=surface)
        if state.clock < self.rest or state.felt is None:
            return state
        return changed(state.to(Step.SWEEP), rest=float(state.corner[2]), felt=state.felt.levelled())

    def _sweep(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = self._pressed(state, touch, dt) + self._led(state, touch) * dt
        # a force that is read wrong must not lift the tip off, nor press it into a slot's rim
        corner[2] = min(max(corner[2], state.rest - DEEPER), state.rest + HIGHER)
        surface = state.surface
        if touch.drop < 0.5 * self.dropped:
            surface += dt / 0.4 * (float(touch.corner[2]) - surface)
        # a blade that is turned by 8 deg sinks too little to be felt, but does not get on
        stopped = -float(touch.force @ state.across) > self.stop
        across = float((touch.seen - state.slot) @ state.across)
        # a corner that is seen elsewhere swings, or sticks
        caught = (touch.drop > self.dropped or stopped) and abs(across) < self.doubt
        # a hand that goes up and down feels less in between
        seen = state.seen + dt if caught else max(state.seen - dt, 0.0)
        state = changed(state, corner=corner, surface=surface, seen=seen)
        if seen > CAUGHT:
            return changed(state.to(Step.ALIGN), turn=0.0, sunk=0.0, sunk_at=0.0, weight=0.0)
        if across < self.beyond and float(touch.lag @ state.across) < self.stuck:
            return state
        if state.sweeps + 1 >= self.sweeps:
            return state.failed("no slot where it was looked for", other=True)
        # fingers that have been bent so far rest elsewhere, and tell forces wrong: from where nothing pushes once more
        return changed(state.to(Step.HOVER), sweeps=state.sweeps + 1)

    def _led(self, state: ReseatState, touch: Touch) -> Array:
        """(3,) speed of the corner as told while it sweeps [m/s].

        Tapped on by fingers that give way, a leaning tool walks off along its edge.  How far it has come across the
        camera tells too late: a hand that answers that pulls the tip over the slot.
        """
        astray = float((touch.seen - state.slot) @ state.along) - self._ahead(state)
        back = min(max(self.steer * astray, -self.sweep), self.sweep)
        return np.asarray(self.sweep * state.across - back * state.along)

    def _align(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        corner = self._pressed(state, touch, dt) + self._aside(state, touch, dt)
        state = changed(state, corner=corner)
        if self._left(state, touch):
            return state.failed("what stopped the corner has let it go")
        if state.clock < self.ease:
            return state
        # a blade that is turned the wrong way first may come out, and the next attempt begins the other way
        first = 1.0 if state.attempt % 2 == 0 else -1.0
        back = state.clock - self.ease >= self.around / self.scan
        way = -first if back else first
        state = changed(state, turn=state.turn + way * self.scan * dt, sunk=max(state.sunk, touch.drop))
        at = state.turn + touch.yaw
        if back:
            # what is felt of depths errs by as much as they differ: the mean of all, the deepest counting most
            weight = max(touch.drop / self.sunk, 0.0) ** SHARPNESS
            total = state.weight + weight
            mean = state.sunk_at + weight / max(total, 1e-9) * (at - state.sunk_at)
            state = changed(state, weight=total, sunk_at=mean)
        seen = state.seen + dt if touch.drop > self.sunk else 0.0
        state = changed(state, seen=seen)
        if seen > HELD:
            # a blade that has sunk before it was turned is as parallel as can be told
            begun = abs(state.turn) > 2.0 * self.scan * HELD
            return state.found(at + way * self.past if begun else 0.0).to(Step.DRAG)
        if first * state.turn > -self.around:
            return state
        if state.sunk < 0.5 * self.dropped:
            return state.failed("what stopped the corner is no slot")
        # nearer to the slot's middle the blade's edge meets the other end sooner
        less = NEARER[state.sweeps % len(NEARER)] * self.nearer * float(np.tan(self.lean))
        if not state.sure and state.sunk < max(self.parallel - less, self.dropped):
            return state.failed("the slot has another heading", other=True)
        return changed(state.to(Step.DRAG), heading=state.heading + state.sunk_at, turn=0.0)

    def _drag(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        pulled = -float(touch.force @ state.along)
        rate = min(max(self.soft * (self.most - pulled), 0.0), self.haul)
        corner = self._pressed(state, touch, dt) + rate * dt * state.along + self._aside(state, touch, dt)
        # what is felt swings with the tool
        found = state.felt is not None and -float(state.felt.slow @ state.along) > self.end
        state = changed(state, corner=corner, seen=state.seen + dt if found else 0.0)
        # a blade that is jammed between the slot's walls comes free in half a swing
        if state.seen > 0.5 / self.pace:
            return state.to(Step.RIGHT)
        adrift = abs(float(corner[2]) - state.rest) > self.lost or self._left(state, touch)
        return state.failed("the slot has no end") if adrift or state.clock > DRAGGED else state

    def _left(self, state: ReseatState, touch: Touch) -> bool:
        """Whether the corner is where no slot is."""
        way = touch.seen - state.slot
        beyond = float(way @ state.along) - 0.5 * self.width
        return beyond > self.ahead_seen or abs(float(way @ state.across)) > self.astray

    def _right(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        since = max(state.clock - self.slacken, 0.0)
        lean = self.lean * max(1.0 - since / self.righting, 0.0)
        if self._left(state, touch):
            return state.failed("the tip has left the slot")
        state = changed(state, corner=self._pulled(state, touch, dt), lean=lean)
        if since < 1.1 * self.righting:
            return state
        return changed(state.to(Step.TURN), held=self._hand(state, touch), lean=-self._more(touch), down=0.0)

    def _turn(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        state = changed(state, corner=self._level(state, touch, dt), down=self._down(state, touch, dt))
        if state.felt is None or state.clock < self.tightening:
            return changed(state, held=self._hand(state, touch))
        pulled = -float(state.felt.slow @ state.along)
        way = float((self._hand(state, touch) - state.held) @ state.along)
        runs = way > self.runs or self._left(state, touch)
        if not runs and state.clock < 2.0 * self.tightening:
            return state
        if state.down < self.deep:
            return state.failed(ON_THE_HEAD)
        if pulled > self.held and not runs:
            return state.to(Step.PRESS)
        return state.failed(f"{pulled:.1f} N hold the tip, and the hand has gone on by {1e3 * way:.0f} mm")

    def _press(self, state: ReseatState, touch: Touch, dt: float) -> ReseatState:
        slack = state.clock > self.slacken
        corner = self._pulled(state, touch, dt) if slack else self._level(state, touch, dt)
        state = changed(state, corner=corner, down=self._down(state, touch, dt))
        if state.clock < self.slacken + self.pressing:
            return state
        if state.down < self.deep:
            return state.failed(ON_THE_HEAD)
        off = touch.seen - state.slot - 0.5 * self.width * state.along
        beside = max(abs(float(off @ state.along)), abs(float(off @ state.across)))
        return state.to(Step.DONE) if beside < self.beside else state.failed("the tip is seen beside the drive")

    def _down(self, state: ReseatState, touch: Touch, dt: float) -> float:
        """How far the corner has been below the head lately [m]."""
        return state.down + dt / LATELY * (touch.drop - state.down)

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
        step = min(max(self.soft * missing, -self.haul), self.haul) * dt
        return self._pressed(state, touch, dt) + step * state.along + self._aside(state, touch, dt)

    def _aside(self, state: ReseatState, touch: Touch, dt: float) -> Array:
        """(3,) how far the corner as told gives way to a wall of the slot [m]."""
        push = self.soft * float(touch.force @ state.across)
        most = GIVING if state.step is Step.ALIGN else self.haul
        step, beside = min(max(push, -most), most) * dt, float((state.corner - state.slot) @ state.across)
        # what is felt of a wall that is not there must not lead the hand ever farther away
        step = min(step, max(self.drift - beside, 0.0)) if step > 0.0 else max(step, min(-self.drift - beside, 0.0))
        return np.asarray(step * state.across)
