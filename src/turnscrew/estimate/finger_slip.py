"""Does a fingertip slide over the handle?  Its way down the handle that neither rolling nor the tool explains.

A fingertip's material point at the contact moves with the tool's while the finger rolls.  What is left of its motion
along the tool's axis,

    m_i = z . (d_i - dp - dtheta x (c_i - p)),

d_i from the encoders, dtheta and dp from the rolling odometry, is summed up and forgotten in `memory`: the way y_i slid
lately.  Arm and wrist are read wrong for all fingers alike, so one finger is compared with the others:

    slid_i = h_i - y_i,    h_i = sum_{j /= i} y_j / (k - 1 + (sigma / sigma_h)^2),

h_i the hand's own error as the other k - 1 fingers tell it, for an error of variance sigma_h^2 against sigma^2 of a
single finger.  It counts downwards, for a finger slides the way it pushes, and all fingers push the tool onto the
screw: at a tip force of 5 N that is half of what friction has to carry, or more.

Along the axis and not around it: two fingers that hold a handle whose tip is pinned can turn and tilt it so that any
two ways around it are rolling.  Along it they cannot, for the contacts' motion along their normals tells the tilt.  So
a finger that slides around the handle is not felt.  What a camera sees of it is a handle that has turned back against
what the fingers rolled, by an angle z of variance S: a one-sided CUSUM (Page, 1954) over the frames,

    g <- max(0, g + b z / sqrt(S) - b^2 / 2),

the likelihood ratio of a turn by b standard deviations against none.  Which finger has let it turn is not known.

A finger that slides has told that its friction is less than was counted on.  How much less no reading can tell: from
the direction of a force that is known to 30 deg, friction would follow as anything between .3 and 4.  So the share of
its friction that a finger is trusted with is lowered in steps, one for every `threshold` that it slides, and regained
slowly, with `again` not up to where it slid.  Who shares the load lets that finger press more and carry less.  All
fingertips have the same skin, and the handle is the same all around: a finger that comes to the handle is trusted no
more than those that hold it, and none regains more than another.

Paper: no counterpart; (13) is what is tested.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, inf, log, sqrt

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.joints import FINGERS

K = len(FINGERS)


@dataclass(frozen=True, slots=True)
class FingerSlipState:
    """What the detector remembers.

    Attributes:
        way: (5,) way of each fingertip up the handle, as read, forgotten by and by [m].
        held: (5,) for how long each has pressed [s].
        slid: (5,) way that each has slid down the handle lately, not below 0 [m].
        told: (5,) by how many thresholds each has been found to slide since it last held.
        rolled: Way around the handle lately, forgotten likewise [m].
        g: The CUSUM of the handle's turning back.
        around: Way that the handle has been seen to have turned back under the fingers lately [m].
        grip: (5,) share of the friction counted with that each is trusted with, 0 to 1.
        regained: Share up to which trust is regained, 0 to 1.
    """

    way: Array
    held: Array
    slid: Array
    told: Array
    rolled: float
    g: float
    around: float
    grip: Array
    regained: float = 1.0


@dataclass(frozen=True, slots=True)
class FingerSlip:
    """Parameters of the detector.

    Attributes:
        memory: Time in which a way slid is forgotten [s]: creep of a held finger, up to 1 mm/s, stays below .15 mm.
        noise: sigma, of one finger's way [m]: .05 deg of noise at four joints 20 to 80 mm away, half of it smoothed
            away, is .05 mm; in runs it was found to be .03 to .05 mm.
        threshold: Way from which on a finger slides [m]: six times the noise of a difference of two.
        askew: Share of the way around the handle that may seem a slide along it [rad]: what axis and joints are
            believed askew by.  A roll of 2 rad/s turns 5 mm under a finger within `memory`, and a degree of that is a
            quarter of the threshold.
        firm: Force from which on a finger holds [N], a third of the lightest squeeze: one that lets go may slide.
        fresh: Time for which a finger that has just begun to hold is not looked at [s]: its tip settles by .2 mm.
        shift: b, turn that the CUSUM looks for, in standard deviations: less takes more frames than a slip lasts.
        alarm_period: Mean time between false alarms that the CUSUM's limit is made for [s], by Wald's bound.
        frame: Period of the camera's frames [s].
        lowered: What a finger is trusted with, over what it was, for every threshold that it slides by.
        least: Least share: drives and skin stand no more than twice or three times the squeeze.
        regain: Time in which the rest of the trust is regained [s]: the time of three rounds.
        again: Share of the trust at which a finger slid up to which that of all fingers is regained, for friction does
            not come back.
    """

    memory: float = 0.15
    noise: float = 5e-5
    threshold: float = 4e-4
    askew: float = 0.0
    firm: float = 1.5
    fresh: float = 0.1
    shift: float = 4.0
    alarm_period: float = 1200.0
    frame: float = 1.0 / 30.0
    lowered: float = 0.6
    least: float = 0.35
    regain: float = 10.0
    again: float = inf

    def init(self) -> FingerSlipState:
        """Nothing gripped, every finger trusted."""
        none = np.zeros(K)
        return FingerSlipState(none, none, none, none, 0.0, 0.0, 0.0, np.ones(K))

    def update(
        self, state: FingerSlipState, moved: Array, level: Array, hand_sigma: float, rolled: float, dt: float
    ) -> FingerSlipState:
        """Take in one tick.

        Args:
            state: Of the last tick.
            moved: (5,) how far each fingertip has moved up the handle since the last tick; see `tip_motion.astray` [m].
            level: (5,) force of each [N].
            hand_sigma: sigma_h, by how much the hand is read to have moved within `memory` and has not [m].
            rolled: How far the handle has turned under the fingers since the last tick, around it [m].
            dt: Time since the last tick [s].
        """
        keep = exp(-dt / self.memory)
        around = keep * state.around
        path = keep * state.rolled + abs(rolled)
        way, held, slid = _slid(
            state.way, state.held, moved, level, hand_sigma, around, self.askew * path, self.firm, self.fresh,
            self.noise, keep, dt,
        )  # fmt: skip
        told, grip, regained = _trusted(
            slid, held, state.told, state.grip, state.regained, self.threshold, exp(-dt / self.regain), self.lowered,
            self.least, self.again,
        )  # fmt: skip
        return FingerSlipState(way, held, slid, told, path, state.g, around, grip, regained)

    def seen(self, state: FingerSlipState, back: float, variance: float, radius: float) -> FingerSlipState:
        """Take in a camera frame.

        Args:
            state: Before.
            back: Angle by which it shows the handle turned back against what the fingers have rolled [rad].
            variance: Of that [rad2].
            radius: Of the handle [m].
        """
        # a way below the threshold is no slide, however sharp the camera
        sigma = sqrt(variance + (self.threshold / radius) ** 2)
        limit = log(self.alarm_period / self.frame)
        g = min(max(state.g + self.shift * (back / sigma - 0.5 * self.shift), 0.0), 2.0 * limit)
        if g < limit:
            return replace(state, g=g)
        around = max(state.around, radius * back)
        slid = np.where(state.held > self.fresh, np.maximum(state.slid, around), 0.0)
        return replace(state, g=g, around=around, slid=slid)


@compiled
def _slid(
    way: Array, held: Array, moved: Array, level: Array, hand_sigma: float, around: float, askew: float, firm: float,
    fresh: float, noise: float, keep: float, dt: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Ways (5,) of a tick later [m], times for which fingers have held [s], and ways slid [m].

    Of a way, `askew` [m] is what fingers seem to climb or slide when they roll around an axis that is believed askew.
    A finger's own way is what is left of it when the hand's is taken off, as the others tell it.  A finger that joins
    others begins with what they say the hand is read wrong by.
    """
    k, joint, holding, total, known = len(way), 0.0, 0, 0.0, 0
    ways, times, slid = np.zeros(k), np.zeros(k), np.zeros(k)
    moves = hand_sigma * hand_sigma
    for i in range(k):
        if level[i] > firm:
            ways[i], times[i] = keep * way[i] + moved[i], held[i] + dt
            if held[i] > 0.0:
                joint, holding = joint + ways[i], holding + 1
    for i in range(k):
        if times[i] > 0.0 and held[i] == 0.0:
            ways[i] = moves / (holding * moves + noise**2) * joint
        if times[i] > fresh:
            total += ways[i]
            known += 1
    for i in range(k):
        if times[i] > fresh:
            hand = moves / ((known - 1) * moves + noise**2) * (total - ways[i])
            slid[i] = max(hand - ways[i] - askew, 0.0) if known > 1 else 0.0
            slid[i] = max(slid[i], around)
    return ways, times, slid


@compiled
def _trusted(
    slid: Array, held: Array, told: Array, grip: Array, regained: float, threshold: float, keep: float, lowered: float,
    least: float, again: float,
) -> tuple[Array, Array, float]:  # fmt: skip
    """How many thresholds (5,) each finger has been told to have slid by, and the share it is trusted with.

    A finger that does not hold is trusted no more than the least trusted one that does.  And the share up to which
    trust is regained from now on.
    """
    k, holding, ceiling = len(slid), 1.0, regained
    after, trust = np.zeros(k), np.empty(k)
    for i in range(k):
        if slid[i] >= 0.5 * threshold:
            after[i] = max(told[i], np.floor(slid[i] / threshold))
        if after[i] > told[i]:
            ceiling = max(min(ceiling, again * grip[i]), least)
        regaining = regained + (grip[i] - regained) * keep
        trust[i] = max(regaining * lowered ** max(after[i] - told[i], 0.0), least)
        if held[i] > 0.0:
            holding = min(holding, trust[i])
    for i in range(k):
        trust[i] = min(trust[i], ceiling)
        if held[i] == 0.0:
            trust[i] = min(trust[i], holding)
    return after, trust, ceiling
