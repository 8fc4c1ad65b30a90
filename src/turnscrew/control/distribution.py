"""Sharing the hand's wrench among the fingertips: (15), (16) and the integral that makes a pair squeeze as wanted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from turnscrew.contact.grasp import grasp
from turnscrew.control.wanted_forces import WantedForces
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import FINGERS
from turnscrew.signals import GRIP, Estimate, Goal

PAIRS = ((FINGERS.index("TH"), FINGERS.index("MF")), (FINGERS.index("FF"), FINGERS.index("RF")))
"""Fingers that press against each other."""


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
    """

    friction: float = 0.6
    most: float = 9.0
    rate: float = 8.0
    reach: float = 6.0

    def init(self) -> Array:
        """No correction: (2,) one for each of `PAIRS` [N]."""
        return np.zeros(len(PAIRS))

    def update(
        self, state: Array, goal: Goal, estimate: Estimate, F_hd: Array, dt: float
    ) -> tuple[Array, WantedForces]:
        """One tick.

        A pair's readings are averaged before they are integrated: integrals of single biased readings would push the
        tool to one side without end.  A finger that has touched before its partner is held to its own.

        Args:
            state: (2,) integral of each pair's missing squeeze [N].
            goal: Shares and squeezes.
            estimate: Contacts and forces.
            F_hd: (6,) wanted wrench of the hand in T, force first [N, N.m].
            dt: Time since the last tick [s].

        Returns:
            The new state, and the forces; their margins are not worked out.

        Paper: (15), (16), with F_0 the inward normals times a squeeze that grows with the load the friction has to
            carry (the paper leaves the choice of F_0 open), and `k_f` of IV-C acting on each pair's squeeze.
        """
        held = np.flatnonzero((goal.roles == GRIP) & (goal.share > 0))
        none = WantedForces.none(F_hd)
        if len(held) == 0:
            return np.zeros(len(PAIRS)), none
        R = estimate.R_WT
        grip = grasp(estimate.c_W[held], estimate.p_WT, share=goal.share[held])
        shared = grip.distribute(np.concatenate([R @ F_hd[:3], R @ F_hd[3:]]))
        carried = shared.f_W
        normals = estimate.n_W[held]
        load = np.linalg.norm(carried - (carried * normals).sum(axis=1)[:, None] * normals, axis=1)
        squeeze = np.minimum(np.maximum(goal.squeeze[held], load / self.friction), self.most)
        wanted = np.zeros(len(FINGERS))
        wanted[held] = squeeze
        state = self._integrate(state, goal, estimate, wanted, dt)
        pressed = squeeze + self._correction(state, goal)[held]
        f_W = none.f_W
        f_W[held] = carried + grip.internal(-pressed[:, None] * normals)
        lost = np.concatenate([R.T @ shared.lost[:3], R.T @ shared.lost[3:]])
        return state, WantedForces(f_W, lost, none.margin, none.limited)

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
