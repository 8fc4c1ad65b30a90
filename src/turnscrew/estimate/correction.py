"""One correction of the filter: camera and tip first, contacts then, about the pose that the first two gave.

The contacts bend: a handle that leans by 3 deg more meets the finger elsewhere, .9 mm off the tangent.  So their rows
are taken anew where the last step led, until it leads nowhere else: Gauss-Newton on the maximum a posteriori.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from turnscrew.estimate.filter_state import OFFSET_COLUMNS, OFFSETS, SEEN, SIZE, THETA, TIP, FilterState, Prior
from turnscrew.estimate.gated_step import Rows, gated_step, stacked
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.estimate.trail import Seen
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.closest import CONTACT, ON_PATCH, closest_table, sizes_of
from turnscrew.geometry.compiled import compiled
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.surfaces import SurfaceOfRevolution

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

PATIENCE = 10
"""Frames in a row (a third of a second) whose pose the gate may refuse before the camera is believed instead: by
chance that is 1e-60, so the filter has lost the tool."""

STRAIGHT = 0.002
"""Way of handle or fingertip at the contact [m] over which rows count as straight: the gap bends away from its tangent
by way^2 / (2 (R + r)), .08 mm here, a quarter of a contact's noise."""

MAX_STEPS = 5
"""Two are the rule from 3 deg of doubt, one from then on.  More are for a handle that the fingers can slide around."""


_THETA, _TIP, _OFFSETS, _HAND = THETA.start, TIP.start, OFFSETS.start, OFFSETS.stop


@dataclass(frozen=True, slots=True)
class Correction:
    """What a correction did.

    Attributes:
        state: The filter after it.
        vision: Whether a frame was taken in: None without one.
        tip: Whether the tip's constraint passed its gate.
        contacts: Rows of the fingers whose contact passed.
        refused: Frames refused in a row.
        restarted: Whether the pose was given up and taken from the camera.
        steps: How often the contacts were taken anew.
    """

    state: FilterState
    vision: bool | None
    tip: bool
    contacts: tuple[int, ...]
    refused: int
    restarted: bool
    steps: int


class _Held(NamedTuple):
    """Fingertips in contact, k of them.

    Attributes:
        rows: Their rows among all five.
        sizes: (k, 2) of their capsules [m].
        p_WF: (k, 3) centres in W [m].
        R_WF: (k, 3, 3) orientations.
        J: (k, 6, 17) Jacobians by the joints with offset states.
        force: (k,) [N].
    """

    rows: tuple[int, ...]
    sizes: Array
    p_WF: Array
    R_WF: Array
    J: Array
    force: Array


@dataclass(frozen=True, slots=True)
class Corrector:
    """The filter with what it needs to know of tool and start."""

    handle: SurfaceOfRevolution
    filter: ToolFilter = field(default_factory=ToolFilter)
    prior: Prior = field(default_factory=Prior)

    def apply(
        self,
        state: FilterState,
        seen: Seen | None,
        p_WS: Array,
        tips: Fingertips,
        capsules: tuple[Capsule, ...],
        touching: Flags,
        force: Array,
        refused: int,
        tip_free: bool = False,
    ) -> Correction:
        """Correct.

        Args:
            state: Predicted.
            seen: Camera frame brought to now, if one came.
            p_WS: (3,) where the drive's bottom centre was said to be, in W [m].
            tips: Fingertips with the learned offsets removed.
            capsules: Their patches.
            touching: (5,) flags.
            force: (5,) forces of the fingertips [N].
            refused: Frames refused in a row so far.
            tip_free: Whether the tip is known to be out of its drive, of which it tells nothing then.
        """
        f = self.filter
        if seen is not None and f.common > 0.0:
            state = f.lasting(state, seen.P)
        blocks = ([] if seen is None else [f.vision_rows(state, seen)]) + (
            [] if tip_free else [f.tip_rows(state, p_WS)]
        )
        accepted: tuple[bool, ...] = ()
        if blocks:
            state, verdict = f.update(state, blocks[0] if len(blocks) == 1 else stacked(*blocks))
            accepted = verdict.accepted
        vision = None if seen is None else accepted[0]
        refused = refused if vision is None else 0 if vision else refused + 1
        restarted = seen is not None and refused >= PATIENCE
        if restarted and seen is not None:
            state, refused = self._restart(state, seen), 0
        state, held, steps = self._contacts(state, tips, capsules, touching, force)
        return Correction(state, vision, not tip_free and accepted[-1], held, refused, restarted, steps)

    def _contacts(
        self, state: FilterState, tips: Fingertips, capsules: tuple[Capsule, ...], touching: Flags, force: Array
    ) -> tuple[FilterState, tuple[int, ...], int]:
        """Takes in the contacts of some fingers; also which were believed, and in how many steps."""
        sizes = sizes_of(capsules)
        points = closest_table(self.handle, sizes, state.p_WT, state.R_WT, tips.p_WF, tips.R_WF)
        which = np.flatnonzero(touching & (points[:, ON_PATCH] > 0.0))
        if not len(which):
            return state, (), 0
        points = points[which]
        held = _Held(
            tuple(which.tolist()),
            sizes[which],
            tips.p_WF[which],
            tips.R_WF[which],
            tips.J[which].take(OFFSET_COLUMNS, axis=2),
            force[which],
        )
        error, here, spread, p_WF, steps = np.zeros(SIZE), state, state.P, held.p_WF, 0
        while True:
            rows = self.filter.contact_rows(here, spread, points, p_WF, held.J, held.force)
            step = gated_step(state.P, Rows(rows.H, rows.z + rows.H @ error, rows.R, rows.blocks))
            steps += 1
            here = state.corrected(step.error, step.P)
            # how far the contacts may slide, once they have told of each other; the weights must come to rest
            spread = step.P if steps == 1 else spread
            if steps == MAX_STEPS or _way(step.error, error, here.p_WT, points) < STRAIGHT:
                break
            error = step.error
            p_WF, R_WF = _moved(held.p_WF, held.R_WF, held.J, error[OFFSETS])
            points = closest_table(self.handle, held.sizes, here.p_WT, here.R_WT, p_WF, R_WF)
        believed = tuple(i for i, good in zip(held.rows, step.verdict.accepted, strict=True) if good)
        return here, believed, steps

    def _restart(self, state: FilterState, seen: Seen) -> FilterState:
        """The camera's pose with the prior's doubt; the constants, which did not change, are kept."""
        P = state.P.copy()
        for given_up in (slice(0, TIP.stop), SEEN):
            P[given_up], P[:, given_up] = 0.0, 0.0
        sigma = np.zeros(SIZE)
        sigma[THETA], sigma[TIP] = self.prior.rotation, self.prior.tip
        P += np.diag(sigma**2)
        P[SEEN, SEEN] += self.filter.common * seen.P
        return replace(state, p_WT=seen.pose.p_WT, R_WT=seen.pose.R_WT, seen_W=np.zeros(6), P=P)


@compiled
def _way(error: Array, then: Array, p_WT: Array, points: Array) -> float:
    """How far a change of the errors (37,) moves handle or fingertips at the contacts, at most [m]."""
    lever, turn, shift, bend = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        lever += (points[0, CONTACT + i] - p_WT[i]) ** 2
        turn += (error[_THETA + i] - then[_THETA + i]) ** 2
        shift += (error[_TIP + i] - then[_TIP + i]) ** 2
    for i in range(_OFFSETS, _HAND):
        bend += (error[i] - then[i]) ** 2
    # all contacts are about as high; no joint of the hand is farther than .1 m from its fingertip
    return sqrt(turn * lever) + sqrt(shift) + 0.1 * sqrt(bend)


@compiled
def _moved(p_WF: Array, R_WF: Array, J: Array, offset: Array) -> tuple[Array, Array]:
    """Fingertips (k, 3) and (k, 3, 3) after `offset` (17,) more has been taken off the readings [rad]."""
    p, R = p_WF.copy(), R_WF.copy()
    for i in range(len(p)):
        turn = np.zeros(3)
        for k in range(len(offset)):
            for j in range(3):
                p[i, j] -= J[i, j, k] * offset[k]
                turn[j] -= J[i, 3 + j, k] * offset[k]
        # one step is .02 rad at most, whose square is 4 micrometres at 20 mm
        for j in range(3):
            R[i, 0, j] += turn[1] * R_WF[i, 2, j] - turn[2] * R_WF[i, 1, j]
            R[i, 1, j] += turn[2] * R_WF[i, 0, j] - turn[0] * R_WF[i, 2, j]
            R[i, 2, j] += turn[0] * R_WF[i, 1, j] - turn[1] * R_WF[i, 0, j]
    return p, R
