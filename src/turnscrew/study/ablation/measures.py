"""What makes the gait robust, and the loop without one of these measures at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from turnscrew.control.distribution import Distribution
from turnscrew.control.optimal_distribution import OptimalDistribution
from turnscrew.control.wanted_forces import WrenchSharing
from turnscrew.decide.gait_state import FF_RF, TH_MF, GaitState, Phase
from turnscrew.decide.recovery import Decider, DeciderState
from turnscrew.errors import ScenarioError
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.free_tip import HELD, Free
from turnscrew.estimate.handle_contacts import handle_contacts
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.signals import Estimate, Fault, Goal, Measurement
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.wiring import Blocks

FIXED = {"position": 6.5, "torque": 10.0}
"""Squeeze that never changes [N]: by positions about what fingers press with on average when it does, by torques the
least that holds on tuning seeds (`turnscrew study actuation`)."""


@dataclass(frozen=True)
class Unrefined(ToolEstimator):
    """Hands on the camera's last orientation, carried by rolling odometry, with the tip put into the drive as told.

    That is the camera and (1).  Nothing that contacts have taught is used: neither the place of the screw nor offsets
    of joints nor the radius of the handle.  The screw's angle and the tip's wrench are still those of the whole
    estimator, for what is compared is where fingers are sent to.
    """

    def update(
        self, state: EstimatorState, measurement: Measurement, motion: Array, dt: float, free: Free = HELD
    ) -> tuple[EstimatorState, Estimate]:
        """One tick; see `ToolEstimator.update`."""
        state, known = super().update(state, measurement, motion, dt, free)
        R_WT = known.R_WT_seen if np.isfinite(known.R_WT_seen).all() else known.R_WT
        q, p_WS = known.q + known.offset, known.p_WS - state.filter.b_W
        near = handle_contacts(self.handle, 0.0, state.capsules, self.fingertips(q), p_WS, R_WT)
        return state, replace(
            known, q=q, offset=np.zeros(len(q)), p_WT=p_WS, R_WT=R_WT, p_WS=p_WS,
            radius=known.radius - state.filter.radius_error, c_W=near.c_W, n_W=near.n_W, gap=near.gap,
        )  # fmt: skip


@dataclass(frozen=True)
class Unguarded(Decider):
    """Takes a finger that feels for the handle to have met it when it should have, instead of when it does."""

    def update(
        self, state: DeciderState, estimate: Estimate, faults: Sequence[Fault], dt: float
    ) -> tuple[DeciderState, Goal]:
        """One tick; see `Decider.update`."""
        feels, begins = self._feeling(state.gait)
        met = state.gait.clock > begins + self.gait.standoff / self.gait.closing
        believed = np.where(feels, met, estimate.touching)
        return super().update(state, replace(estimate, touching=believed), faults, dt)

    def _feeling(self, gait: GaitState) -> tuple[Flags, float]:
        """Which fingers feel for the handle (5,), and when in this phase they begin to [s]."""
        if gait.phase is Phase.ADD:
            return FF_RF, self.gait.add
        if gait.phase in (Phase.RETURN, Phase.CATCH):
            return TH_MF, gait.aside
        return np.zeros(len(TH_MF), dtype=bool), 0.0


@dataclass(frozen=True)
class Measure:
    """One measure, and the loop without it.

    Attributes:
        name: For tables and the command line.
        meaning: What is done instead, in a few words.
        without: Takes the measure out of the loop's blocks.
        actuations: Robots that have it.
    """

    name: str
    meaning: str
    without: Callable[[Blocks], Blocks]
    actuations: tuple[str, ...] = ("position", "torque")


def _unrefined(blocks: Blocks) -> Blocks:
    return replace(blocks, estimator=Unrefined(**_values(blocks.estimator)))


def _unguarded(blocks: Blocks) -> Blocks:
    return replace(blocks, decider=Unguarded(**_values(blocks.decider)))


def _not_recentred(blocks: Blocks) -> Blocks:
    return replace(blocks, decider=replace(blocks.decider, gait=replace(blocks.decider.gait, recentre=False)))


def _without_integral(blocks: Blocks) -> Blocks:
    sharing = blocks.controller.distribution
    return _sharing(blocks, replace(sharing, rate=0.0) if isinstance(sharing, Distribution) else sharing)


def _fixed(blocks: Blocks) -> Blocks:
    sharing = blocks.controller.distribution
    if isinstance(sharing, OptimalDistribution):
        # torques press as told: nothing is integrated then either
        force = FIXED["torque"]
        return _sharing(blocks, Distribution(sharing.friction, most=force, rate=0.0, fixed=force))
    return _sharing(blocks, replace(sharing, fixed=FIXED["position"]) if isinstance(sharing, Distribution) else sharing)


def _sharing(blocks: Blocks, sharing: WrenchSharing) -> Blocks:
    return replace(blocks, controller=replace(blocks.controller, distribution=sharing))


def _values(block: Any) -> dict[str, Any]:
    return {field.name: getattr(block, field.name) for field in fields(block) if field.init}


ALL = Measure("all measures", "the loop as it is", lambda blocks: blocks)
MEASURES = (
    ALL,
    Measure("refinement", "the camera's orientation, the tip in its drive as told, nothing learned", _unrefined),
    Measure("guarded contacts", "fingers close for as long as the estimate says, not until they touch", _unguarded),
    Measure("re-centring", "the palm stays where it was", _not_recentred),
    Measure("force integral", "pairs press as their biased sensors read", _without_integral, ("position",)),
    Measure("growing squeeze", "the same squeeze at all times: 6.5 N by positions, 10 N by torques", _fixed),
)
"""What is taken away, one at a time; nothing in the first."""


def chosen(names: Sequence[str] | None, scenario: Scenario) -> tuple[Measure, ...]:
    """Measures asked for, all without names, that a scenario's robot has.

    Raises:
        ScenarioError: there is none of that name.
    """
    there = [measure for measure in MEASURES if scenario.robot.actuation in measure.actuations]
    for name in names or ():
        if name not in [measure.name for measure in there]:
            raise ScenarioError(f"--without {name}: unknown; there are {', '.join(each.name for each in there)}")
    return tuple(measure for measure in there if not names or measure.name in names)
