"""Sharing the hand's wrench among the fingertips: (15), (16) and the integral that makes a pair squeeze as wanted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp

import numpy as np

from turnscrew.contact.friction import scale_internal, split
from turnscrew.contact.grasp import Grasp, grasp
from turnscrew.control.wanted_forces import WantedForces
from turnscrew.geometry.arrays import Array, Flags, Rows
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import GRIP, Estimate, Goal

PAIRS = ((FINGERS.index("TH"), FINGERS.index("MF")), (FINGERS.index("FF"), FINGERS.index("RF")))
"""Fingers that press against each other."""


@dataclass(frozen=True, slots=True)
class Squeezing:
    """What is remembered of the last tick.

    Attributes:
        missing: (2,) integral of each pair's missing squeeze [N], one for each of `PAIRS`.
        factor: Squeeze over the one without load.
        f_T: (5, 3) last forces, in T [N], which fingers that are locked keep to.
    """

    missing: Array
    factor: float = 1.0
    f_T: Array | None = None


@dataclass(frozen=True)
class Distribution:
    """Contact forces that give the tool its wrench and keep every contact inside its friction cone.

    Attributes:
        friction: Coefficient counted with, below what is expected of skin on a handle: the rest is margin.
        most: Largest squeeze asked for [N], a little more than the 5-8 N that a fingertip stands for long: it is
            reached only at the end of a roll against the highest torques, and more bends the servos' postures away.
        rate: Integral gain of a pair's squeeze [1/s]: it settles in 1/8 s, a fifth of the time a pair is given to
            build up, and stays well below the finger servos' 90 rad/s.
        reach: Largest correction by the integral [N].
        fixed: Squeeze that is asked for at all times [N]; None lets it grow with the load.
        ease: Time in which a squeeze that is no longer asked for fades [s], two strokes: the load of a screw does not
            fall while it is driven in, but readings that err by a half say so, and one squeeze too small costs more
            than many too large.
    """

    friction: float = 0.6
    most: float = 9.0
    rate: float = 8.0
    reach: float = 6.0
    fixed: float | None = None
    ease: float = 2.0

    def init(self) -> Squeezing:
        """No correction, no load."""
        return Squeezing(np.zeros(len(PAIRS)))

    def update(
        self, state: Squeezing, goal: Goal, estimate: Estimate, F_hd: Array, dt: float
    ) -> tuple[Squeezing, WantedForces]:
        """One tick.

        A pair's readings are averaged before they are integrated: integrals of single biased readings would push the
        tool to one side without end.  A finger that has touched before its partner is held to its own.

        Args:
            state: Of the last tick.
            goal: Shares and squeezes.
            estimate: Contacts and forces.
            F_hd: (6,) wanted wrench of the hand in T, force first [N, N.m].
            dt: Time since the last tick [s].

        Returns:
            The new state, and the forces; their margins are not worked out.

        Paper: (15), (16), with F_0 the inward normals times a squeeze (the paper leaves its choice open), and `k_f` of
            IV-C acting on each pair's squeeze.
        """
        held = np.flatnonzero((goal.roles == GRIP) & (goal.share > 0))
        none = WantedForces.none(F_hd)
        if len(held) == 0:
            return self.init(), none
        R = estimate.R_WT
        if goal.locked and state.f_T is not None:
            return state, replace(none, f_W=state.f_T @ R.T)
        grip = grasp(estimate.c_W[held], estimate.p_WT, share=goal.share[held])
        shared = grip.distribute(np.concatenate([R @ F_hd[:3], R @ F_hd[3:]]))
        normals = estimate.n_W[held]
        # all press as the least trusted finger needs
        trusted = float(estimate.grip[held].min())
        lasting = 1.0 + exp(-dt / self.ease) * (state.factor - 1.0)
        squeeze, factor = self._squeeze(goal, grip, shared.f_W, normals, held, trusted, lasting)
        asked = shared.f_W + grip.internal(-squeeze[:, None] * normals)
        wanted = np.zeros(len(FINGERS))
        wanted[held] = split(asked, normals)[0]
        missing = self._integrate(state.missing, goal, estimate, wanted, dt)
        f_W = none.f_W
        f_W[held] = asked + grip.internal(-self._correction(missing, goal)[held][:, None] * normals)
        lost = np.concatenate([R.T @ shared.lost[:3], R.T @ shared.lost[3:]])
        return Squeezing(missing, factor, f_W @ R), WantedForces(f_W, lost, none.margin, none.limited)

    def _squeeze(
        self, goal: Goal, grip: Grasp, carried: Array, n_W: Array, held: Rows, trusted: float, lasting: float
    ) -> tuple[Array, float]:
        """Squeeze of each finger that holds (k,) [N], and what it is over the one without load.

        It is the fixed one, or the least that brings all into their cones, and no less than `lasting` says.

        The cones are those of the share of friction that is trusted, and more is squeezed from the outset.

        What counts is the force that is left of a squeeze in the null space: contacts do not lie opposite each other,
        so it is less than the squeeze, and leans.
        """
        share = goal.share[held]
        if self.fixed is not None:
            return np.asarray(self.fixed * share), 1.0
        squeeze = np.minimum(goal.squeeze[held] / trusted, self.most * share)
        internal = grip.internal(-squeeze[:, None] * n_W)
        most = max(self.most / float((squeeze / share).max()), 1.0)

        def factor(counted: Flags) -> float:
            forces, more, normals = carried[counted], internal[counted], n_W[counted]
            return scale_internal(forces, more, normals, self.friction, trusted, 1.0, most).factor

        whole = share == share.max()
        scale = factor(whole)
        if not whole.all():
            # one that has just touched, without its partner, no squeeze brings into its cone: counted like the others
            # it would make them let go, and counted from some share on it would make their force jump
            scale += float(share.min() / share.max()) * (factor(share > 0.0) - scale)
        scale = max(scale, min(lasting, most))
        return np.asarray(scale * squeeze), scale

    def _integrate(self, state: Array, goal: Goal, estimate: Estimate, wanted: Array, dt: float) -> Array:
        pressing = -(estimate.f_W * estimate.n_W).sum(axis=1)
        state = state.copy()
        for index, pair in enumerate(PAIRS):
            rows = [row for row in pair if goal.share[row] > 0]
            if not rows:
                state[index] = 0.0
                continue
            error = float((wanted - pressing)[rows].mean())
            state[index] = min(max(state[index] + self.rate * error * dt, -self.reach), self.reach)
        return state

    def _correction(self, state: Array, goal: Goal) -> Array:
        correction = np.zeros(len(FINGERS))
        for index, pair in enumerate(PAIRS):
            correction[list(pair)] = state[index]
        return correction * goal.share
