"""One correction of the filter: camera and tip first, contacts then, about the pose that the first two gave."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.estimate.filter_state import SIZE, THETA, TIP, FilterState, Prior
from turnscrew.estimate.handle_contacts import handle_contacts
from turnscrew.estimate.tool_filter import ToolFilter, stacked
from turnscrew.estimate.trail import Pose
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.profiles import Capsule
from turnscrew.geometry.surfaces import SurfaceOfRevolution

if TYPE_CHECKING:
    from turnscrew.robot.model import Fingertips

PATIENCE = 10
"""Frames in a row (a third of a second) whose pose the gate may refuse before the camera is believed instead: by
chance that is 1e-60, so the filter has lost the tool."""


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
    """

    state: FilterState
    vision: bool | None
    tip: bool
    contacts: tuple[int, ...]
    refused: int
    restarted: bool


@dataclass(frozen=True, slots=True)
class Corrector:
    """The filter with what it needs to know of tool and start."""

    handle: SurfaceOfRevolution
    filter: ToolFilter = field(default_factory=ToolFilter)
    prior: Prior = field(default_factory=Prior)

    def apply(
        self,
        state: FilterState,
        seen: Pose | None,
        p_WS: Array,
        tips: Fingertips,
        capsules: tuple[Capsule, ...],
        touching: Flags,
        refused: int,
    ) -> Correction:
        """Correct.

        Args:
            state: Predicted.
            seen: Camera pose brought to now, if a frame came.
            p_WS: (3,) where the drive's bottom centre was said to be, in W [m].
            tips: Fingertips with the learned offsets removed.
            capsules: Their patches.
            touching: (5,) flags.
            refused: Frames refused in a row so far.
        """
        f = self.filter
        rows = f.tip_rows(state, p_WS)
        if seen is not None:
            rows = stacked(f.vision_rows(state, seen.p_WT, seen.R_WT), rows)
        state, verdict = f.update(state, rows)
        vision = None if seen is None else all(verdict.accepted[:2])
        refused = refused if vision is None else 0 if vision else refused + 1
        restarted = seen is not None and refused >= PATIENCE
        if restarted and seen is not None:
            state, refused = self._restart(state, seen), 0
        state, held = self._contacts(state, tips, capsules, touching)
        return Correction(state, vision, verdict.accepted[-1], held, refused, restarted)

    def _contacts(
        self, state: FilterState, tips: Fingertips, capsules: tuple[Capsule, ...], touching: Flags
    ) -> tuple[FilterState, tuple[int, ...]]:
        found = handle_contacts(self.handle, state.radius_error, capsules, tips, state.p_WT, state.R_WT)
        held = [i for i in np.flatnonzero(touching).tolist() if found.points[i].on_patch]
        if not held:
            return state, ()
        rows = self.filter.contact_rows(
            state, [found.points[i] for i in held], [tips.p_WF[i] for i in held], [tips.J[i] for i in held]
        )
        state, verdict = self.filter.update(state, rows)
        return state, tuple(i for i, good in zip(held, verdict.accepted, strict=True) if good)

    def _restart(self, state: FilterState, seen: Pose) -> FilterState:
        """The camera's pose with the prior's doubt; the constants, which did not change, are kept."""
        P = state.P.copy()
        P[: TIP.stop], P[:, : TIP.stop] = 0.0, 0.0
        sigma = np.zeros(SIZE)
        sigma[THETA], sigma[TIP] = self.prior.rotation, self.prior.tip
        P += np.diag(sigma**2)
        return FilterState(seen.p_WT, seen.R_WT, state.b_W, state.radius_error, state.offset, P)
