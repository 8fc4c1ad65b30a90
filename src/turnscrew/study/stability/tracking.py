"""What the estimator does at a tick between two camera frames, with the numbers that a swing changes as its state.

The blocks are the estimator's own: the joints' smoother and the odometry.  Two things rest.  The
filter's corrections: they come with camera frames, at a third of the ticks' rate, and say what the odometry says
already.  And the wrench of the tip: it passes three low-passes of 20 to 50 ms, and what it holds is mostly how the
fingertips' friction has come to rest, which no small motion changes in proportion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.handle_contacts import HandleContacts, capsules_of, handle_contacts
from turnscrew.estimate.joint_smoothing import JointState
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.robot.model import Fingertips
from turnscrew.signals import Estimate


@dataclass(frozen=True, slots=True)
class Tracked:
    """What is remembered from tick to tick.

    Attributes:
        joints: Smoothed joints.
        q: (28,) joint angles at the last tick [rad].
        p_WT: (3,) tip in W [m].
        turn: (3,) rotation vector in W from where the tool rested [rad].
    """

    joints: JointState
    q: Array
    p_WT: Array
    turn: Array


@dataclass(frozen=True)
class Tracking:
    """The estimator between frames.

    Attributes:
        estimator: As the loop has it.
        rest: Its state where the grasp rests.
        known: Its estimate there, whose slow parts stay.
        dt: Of a tick [s].
    """

    estimator: ToolEstimator
    rest: EstimatorState
    known: Estimate
    dt: float

    def init(self) -> Tracked:
        """At rest."""
        rest = self.rest
        return Tracked(rest.joints, rest.joints.q - self.known.offset, rest.filter.p_WT, np.zeros(3))

    def update(self, state: Tracked, reading: Array, speeds: Array) -> tuple[Tracked, Estimate]:
        """One tick.

        Args:
            state: Of the last.
            reading: (28,) encoder angles, filtered [rad].
            speeds: (28,) [rad/s].
        """
        estimator, R_then = self.estimator, exp_so3(state.turn) @ self.rest.filter.R_WT
        still = np.zeros(len(reading))
        joints, q, v = estimator.joints.update(state.joints, reading, speeds, still, self.dt)
        q = q - self.known.offset
        before, tips = estimator.fingertips(state.q), estimator.fingertips(q)
        touch = self.rest.touch
        weight = np.where(touch.touching, touch.level, 0.0)
        then = self._contacts(before, state.p_WT, R_then)
        rolled = estimator.odometry.increment(before, tips, then.tip_W, weight, state.p_WT, R_then)
        dtheta = rolled.slowed(self.rest.filter.slide, R_then[:, 2]).dtheta
        spin = float(R_then[:, 2] @ dtheta)
        p_WT = state.p_WT + estimator.wrench.advance(spin) * R_then[:, 2]
        R_WT = exp_so3(dtheta) @ R_then
        contacts = self._contacts(tips, p_WT, R_WT)
        turn = log_so3(R_WT @ self.rest.filter.R_WT.T)
        estimate = replace(
            self.known, q=q, v=v, p_WT=p_WT, R_WT=R_WT, c_W=contacts.c_W, n_W=contacts.n_W, gap=contacts.gap
        )
        return Tracked(joints, q, p_WT, turn), estimate

    def _contacts(self, tips: Fingertips, p_WT: Array, R_WT: Array) -> HandleContacts:
        error = self.rest.filter.radius_error
        return handle_contacts(self.estimator.handle, error, capsules_of(tips), tips, p_WT, R_WT)
