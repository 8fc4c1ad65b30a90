"""How far, how fast and how firmly the blade's corner searches for its slot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.decide.felt_force import FeltForce


@dataclass(frozen=True)
class SearchSizes:
    """Sizes, speeds and forces of the search.

    Attributes:
        feel: What the locked fingers tell.
        width: Of the blade [m].
        depth: Of the slot [m].
        lean: Of the tool [rad]: a corner that is 2 mm inside sinks by .9 mm before the edge meets the other end.
        press: Force on the head [N]: friction then holds less than .5 N, and a corner drops in at once.
        firm: The same while the corner is drawn along the slot, and the tool righted [N]: what fingers tell meanwhile
            errs by half a newton, and a corner that nothing presses climbs out over the slot's end.
        give_way: How fast the hand gives way to a force beyond that [m/s/N]: fingers are .4 mm/N soft upwards, and what
            is felt and done comes .1 s late, so that at half as much again the hand hops on the head.
        hover: Height over the head from which the tip comes down [m],
        land: and its speed then [m/s].
        ahead: How far towards the slot's end from its middle the corner comes down [m]: half of what there is,
        nearer: and by how much less at most in further sweeps [m]: so a slot is found that is believed 2 mm from where
            it is, as after a knock in the first two seconds, or by a hand that leaves its line by a millimetre.
        aside: How far beside the slot [m]: three times what the camera leaves of doubt in LOOK.
        beyond: How far on the other side it is looked for [m]: the head goes on for 4.5 mm.
        doubt: How far beside the slot a corner may be seen that is in it [m]: twice what the camera leaves of doubt
            while the tip is pushed.
        stop: Force across the slot that only its wall can give [N]: friction holds .9 N where it is greatest, and what
            is felt errs by half a newton.
        stuck: How far the hand may be ahead of a tip that does not follow [m]: fingers give 15 mm/N sideways.
        sweep: Speed on the head [m/s]: .27 mm from tap to tap, for a slot that is .2 mm wider than the blade.
        steer: Rate at which it is kept from walking off along the slot [1/s]: the camera tells that to .5 mm in 2 s.
        tapped: How far the hand goes up and down meanwhile [m], so that the tip is not pressed at all for a moment, and
            comes after: half of that leaves it a share of its load, friction holds it 2 to 8 mm behind, and then it
            snaps across the slot without falling in,
        tapping: and how often [1/s].
        haul: Largest speed of the hand sideways once the corner is in [m/s].
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
        parallel: How far it sinks at least somewhere about the slot's heading, whatever is felt wrong [m].
        past: How far beyond where it begins to sink so far the slot's heading is [rad].
        end: Force at which the slot's end is found [N]; a friction of .7 holds .8 N,
        most: and where the hand stops pulling [N].
        pull: Force with which the blade is held against it while it is righted [N]: fingers that are bent by more tell
            heights and forces so wrong that the hand lifts the blade out.
        hold: The same in the end, to see whether it is in [N]: on the head, friction holds half of that.
        tightening: Time in which the hand pulls so far [s], and then as long again.
        held: What must be left of that, on the average, for the tip to be in [N],
        runs: and how far the hand may go on meanwhile [m], 4 mm where fingers creep: on the head it would run away
            from the tip by 10 mm.
        deep: How far below the head the tip must be then and later, on the average [m]: of the slot's 1.3 mm .8 to 1.1
            are felt of a tip that is in, .2 at most of one on the head that is pressed by enough for friction to hold.
        slacken: Time in which the hand goes back until then [s].
        pressing: Time for which the blade is pressed in the end [s]: a pull lifts it by some tenths of a millimetre.
        soft: How far the hand moves for a newton sideways, in a second [m/s/N]: twice a second what the fingers give.
        drift: How far to either side of the slot's line it may give way at most [m]: fingers give 15 mm/N, so a wall
            that is felt wrongly bends them by no more than .3 N.
        rest: Time for which it rests on the head [s].
        righting: Time in which the tool is righted [s].
        yaw: How far it is turned to and fro in the end [rad], a heading's error,
        pace: and how often [1/s].
        astray: How far beside the slot a corner may be seen that is in it [m], four times what the camera leaves of
            doubt meanwhile,
        ahead_seen: and how far beyond its end, for the estimate runs ahead with a hand that pulls by 4 mm [m].
        beside: How far from its place a tip that is in may be seen in the end, on either axis [m].
        lost: How far the hand may go down or up without anything to press on [m].
        bent: The lean that fingers give way to, over what encoders tell of it.
        follow: Rate at which the arm follows the pose that it is told [1/s]: a fifth of its servos' loop, a third
            of the one with torques.
    """

    feel: FeltForce
    width: float
    depth: float
    lean: float = np.radians(10.0)
    press: float = 0.7
    firm: float = 1.2
    give_way: float = 0.0025
    hover: float = 0.005
    land: float = 0.003
    ahead: float = 0.0015
    nearer: float = 0.0026
    aside: float = 0.0022
    beyond: float = 0.0032
    doubt: float = 0.002
    stop: float = 1.4
    stuck: float = 0.020
    sweep: float = 0.0008
    steer: float = 0.5
    tapped: float = 0.0003
    tapping: float = 3.0
    haul: float = 0.004
    sweeps: int = 2
    dropped: float = 0.00035
    around: float = np.radians(7.0)
    ease: float = 1.0
    scan: float = 0.15
    sunk: float = 0.00075
    parallel: float = 0.0006
    past: float = np.radians(2.0)
    end: float = 1.0
    most: float = 1.8
    pull: float = 0.3
    hold: float = 1.2
    tightening: float = 2.5
    held: float = 0.7
    runs: float = 0.006
    deep: float = 0.0005
    slacken: float = 1.5
    pressing: float = 1.0
    soft: float = 0.012
    drift: float = 0.004
    righting: float = 3.0
    rest: float = 0.8
    yaw: float = np.radians(3.0)
    pace: float = 0.5
    astray: float = 0.004
    ahead_seen: float = 0.007
    beside: float = 0.003
    lost: float = 0.006
    bent: float = 1.3
    follow: float = 8.0
