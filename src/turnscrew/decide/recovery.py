"""What is done about trouble: a table of fault and phase, and the gait with it in force.

The watch names what keeps a run from going on as it is; this block decides whether there is a way on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from turnscrew.decide.gait import Gait
from turnscrew.decide.gait_state import GaitState, Phase
from turnscrew.decide.reseat import Reseat
from turnscrew.decide.reseat_state import ReseatState, Step
from turnscrew.decide.reseat_walk import handed_over
from turnscrew.signals import TIP_LAG, Estimate, Fault, FaultKind, Goal
from turnscrew.values import changed


class Action(StrEnum):
    """What can be done, and what it means."""

    WAIT = "wait"
    """Turn no further until the trouble is over; a hand-over under way is finished."""
    CATCH = "catch"
    """Thumb and middle finger feel for the handle that one of them has lost, and hand it over to the others."""
    AIM = "aim again"
    """Thumb and middle finger go back a little, and aim anew at where the handle is believed to be now."""
    BACK = "turn back"
    """Thumb and middle finger turn the handle back a little, out of the way of the others."""
    RESEAT = "reseat"
    """Gather all four fingers on the handle, and search for the drive with the tip until it sits in it again."""
    STOP = "stop"
    """Hold the tool still as it is held, and end the run."""


ROLL_LAG = 17
"""Ticks from the loss of a tip in a roll until it is answered: it is named after 7 to 20 in 20 knocks, mostly after 15.
The angle believed so long before was off by 10 deg at most, the one at which the tip was last sure to be in by up to
70: at full pace force and camera begin to doubt a roll before anything is lost."""

LATE = 100
"""Ticks without a sure tip after which its loss is named late: six times what it takes in most knocks, and three times
the longest doubt before a loss.  Where the screw was believed to be shortly before is then no better guess."""

OUT = (FaultKind.CAM_OUT, FaultKind.TIP_SLIP)
"""What is named where the tip is not, or is not believed to be, in its drive.  A mere slip does not end a run."""

ROLLING_PAIR = (Phase.SETTLE, Phase.ROLL, Phase.ADD)

POLICY: Mapping[FaultKind, Mapping[Phase, Action]] = MappingProxyType(
    {
        FaultKind.VISION_LOST: dict.fromkeys(Phase, Action.WAIT),
        FaultKind.CONTACT_LOST: dict.fromkeys(ROLLING_PAIR, Action.CATCH),
        **{kind: dict.fromkeys(Phase, Action.RESEAT) for kind in OUT},
        FaultKind.STALLED: {Phase.ADD: Action.BACK, Phase.RETURN: Action.AIM},
    }
)
"""What is done about a fault that would end the run, by the phase in which it is named; all else is `STOP`."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """Something that was done.

    Attributes:
        time: When it began [s].
        kind: Of the fault.
        phase: Of the gait.
        cycle: Rounds until then, those that did not count included.
        action: What was done.
    """

    time: float
    kind: FaultKind
    phase: Phase
    cycle: int
    action: Action


@dataclass(frozen=True, slots=True)
class DeciderState:
    """Where gait and recovery are.

    Attributes:
        gait: Of the gait.
        goal: The last one, which a stop holds to.
        action: What is being done; None while the gait goes on by itself.
        clock: Since that began [s].
        made: All that was done, in its order.
        fault: What the run is being stopped for, or is if the search for the drive comes to nothing.
        reseat: Of the last search for the drive.
        sure: Angles of the screw [rad], and rounds made, in the last ticks in which its tip was taken to be in it.
        unsure: Ticks since then.
        lately: Angles of the screw in the last ticks [rad], and whether the hand was rolling.
    """

    gait: GaitState
    goal: Goal | None = None
    action: Action | None = None
    clock: float = 0.0
    made: tuple[Recovery, ...] = ()
    fault: Fault | None = None
    reseat: ReseatState | None = None
    sure: tuple[tuple[float, int], ...] = ()
    unsure: int = 0
    lately: tuple[tuple[float, bool], ...] = ()


@dataclass(frozen=True)
class Decider:
    """The gait, and what is done when it cannot go on.

    Attributes:
        gait: The gait.
        reseat: Searches for a drive that the tip has left; None where that ends the run.
        tries: How often the same trouble is answered between two rounds: a third time it would hardly go otherwise.
        patience: Longest time that is waited [s].
        stop: Time for which a run that ends holds the tool still [s]: a hand comes to rest in a fifth of it.
    """

    gait: Gait
    reseat: Reseat | None = None
    tries: int = 2
    patience: float = 30.0
    stop: float = 0.5

    def init(self) -> DeciderState:
        """The gait's start."""
        return DeciderState(self.gait.init())

    def over(self, state: DeciderState) -> Fault | None:
        """The fault that ends the run, once the tool has been held still."""
        return state.fault if state.action is Action.STOP and state.clock >= self.stop else None

    def update(
        self, state: DeciderState, estimate: Estimate, faults: Sequence[Fault], dt: float
    ) -> tuple[DeciderState, Goal]:
        """One tick.

        Args:
            state: Of the last tick.
            estimate: What is believed.
            faults: Named at the last tick.
            dt: Time since then [s].
        """
        fault = next((fault for fault in faults if fault.ends and not _is_past(state, fault)), None)
        state = changed(state, clock=state.clock + dt)
        state = changed(state, unsure=state.unsure + 1)
        if estimate.tip_sure:
            state = changed(state, sure=(*state.sure, (estimate.theta, state.gait.round))[-TIP_LAG:], unsure=0)
        lately = (*state.lately, (estimate.theta, state.gait.phase is Phase.ROLL))[-ROLL_LAG:]
        state = changed(state, lately=lately)
        if fault is not None:
            state = self._answer(state, fault, estimate)
        elif state.action is Action.WAIT:
            state = changed(state, action=None)
        if state.action is Action.STOP and state.goal is not None:
            return state, state.goal
        if state.action is Action.RESEAT and self.reseat is not None and state.reseat is not None:
            return self._reseated(state, *self.reseat.update(state.reseat, estimate, dt), estimate)
        gait, goal = self.gait.update(state.gait, estimate, dt, still=state.action is Action.WAIT)
        if state.action in (Action.CATCH, Action.AIM, Action.BACK) and gait.phase is not state.gait.phase:
            state = changed(state, action=None)
        goal = changed(goal, action="" if state.action is None else str(state.action), recoveries=len(state.made))
        return changed(state, gait=gait, goal=goal), goal

    def _answer(self, state: DeciderState, fault: Fault, estimate: Estimate) -> DeciderState:
        """Begins what is to be done about a fault, unless that is being done."""
        phase = state.gait.phase
        if state.action is Action.RESEAT and fault.kind in OUT:
            return state
        action = Action.STOP if fault.hopeless else POLICY.get(fault.kind, {}).get(phase, Action.STOP)
        if state.action is Action.STOP or (action is state.action is Action.WAIT and state.clock < self.patience):
            return state
        if state.action is Action.RESEAT or (action is Action.RESEAT and self.reseat is None):
            # something else has gone wrong in a search, or there is nobody who searches
            action = Action.STOP
        if action is not Action.WAIT and self._tried(state, fault.kind) >= self.tries:
            action = Action.STOP
        elif action is state.action is Action.WAIT:
            # for longer than there is patience
            action = Action.STOP
        if action is Action.STOP:
            goal = stilled(state.goal)
            if goal is not None and fault.kind in OUT:
                # there is nothing to press on, and what presses on nothing swings away
                goal = changed(goal, tip_force=0.0)
            return changed(state, action=action, clock=0.0, fault=fault, goal=goal)
        if action is Action.RESEAT and self.reseat is not None:
            made = (*state.made, Recovery(fault.time, fault.kind, phase, state.gait.cycle, action))
            # what has been counted since the tip may have been out was no round
            theta, rounds = state.sure[0] if state.sure else (estimate.theta, state.gait.round)
            gait = changed(state.gait, round=rounds)
            then, rolling = state.lately[0]
            likely = (theta, then) if state.unsure > LATE else (then, theta)
            reseat = self.reseat.init(gait, estimate, likely if rolling else (theta,))
            return changed(state, gait=gait, action=action, clock=0.0, made=made, reseat=reseat, fault=fault)
        gait = {
            Action.WAIT: lambda: state.gait,
            Action.CATCH: lambda: self.gait.catching(state.gait, estimate),
            Action.AIM: lambda: self.gait.aiming(state.gait, estimate),
            Action.BACK: lambda: self.gait.backing(state.gait),
        }[action]()
        made = (*state.made, Recovery(fault.time, fault.kind, phase, state.gait.cycle, action))
        return changed(state, gait=gait, action=action, clock=0.0, made=made)

    def _reseated(
        self, state: DeciderState, reseat: ReseatState, goal: Goal, estimate: Estimate
    ) -> tuple[DeciderState, Goal]:
        """The state after a tick of the search for the drive, which may have ended."""
        goal = changed(goal, action=str(state.action), recoveries=len(state.made), round=state.gait.round)
        state = changed(state, reseat=reseat, goal=goal)
        if reseat.step is Step.DONE:
            # the hand, which the search has moved, comes back over the screw; a round begins anew with a hand-over
            gait = changed(handed_over(self.gait, state.gait, Phase.SETTLE), theta=estimate.theta)
            state = changed(state, action=None, fault=None, gait=gait)
        elif reseat.step is Step.FAILED:
            state = changed(state, action=Action.STOP, clock=0.0, goal=stilled(goal))
        return state, goal

    def _tried(self, state: DeciderState, kind: FaultKind) -> int:
        """How often this trouble has been answered since the last round ended."""
        return sum(done.kind is kind and done.cycle == state.gait.cycle for done in state.made)


def stilled(goal: Goal | None) -> Goal | None:
    """The same grasp, with nothing moving any more."""
    if goal is None:
        return None
    return changed(
        goal,
        turn_rate=0.0,
        approach=np.zeros_like(goal.approach),
        V_palm=np.zeros(6),
        V_tool=np.zeros(6),
        action=str(Action.STOP),
    )


def _is_past(state: DeciderState, fault: Fault) -> bool:
    """Whether a phase that stalled has ended meanwhile: faults are of the last tick; one that lasts is named again."""
    return fault.kind is FaultKind.STALLED and state.goal is not None and state.gait.phase != state.goal.phase
