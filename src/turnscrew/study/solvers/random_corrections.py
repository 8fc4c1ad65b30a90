"""Corrections of the filter drawn at random: beliefs from its prior, readings with its noise, the truth of both.

What the filter makes of them tells whether its covariance is honest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from turnscrew.decide.plan import GaitPlan
from turnscrew.estimate.filter_state import OFFSET_COLUMNS, FilterState, Prior
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.estimate.trail import Pose, Seen
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.closest import closest_points
from turnscrew.geometry.profiles import Capsule, Cylinder
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.robot.joints import FINGERS, JOINTS
from turnscrew.robot.model import Fingertips, RobotModel

POSITION = 0.005
"""Noise of the camera per axis [m], of a poor single marker;"""

ROTATION = np.deg2rad(3.0)
"""and about each axis [rad]."""

SQUEEZE = 5.0
"""Force of a fingertip that holds [N]."""

ADDED = ("TH", "MF", "FF", "RF")
"""The fingers in the order in which they take hold."""


@dataclass(frozen=True)
class Grip:
    """Robot and tool as they are.

    Attributes:
        q: (28,) joint angles [rad].
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        force: (5,) of each fingertip [N]; those that press hold the handle.
        handle: Its patch.
    """

    q: Array
    p_WT: Array
    R_WT: Array
    force: Array
    handle: Cylinder


@dataclass(frozen=True)
class Instance:
    """One correction to make.

    Attributes:
        handle: As it is believed to be.
        state: The filter's belief, drawn from the prior.
        seen: The camera's frame.
        p_WS: (3,) where the drive's bottom centre was said to be, in W [m].
        tips: Fingertips as read.
        touching: (5,) flags.
        force: (5,) forces of the fingertips [N].
        grip: The truth.
        b_W: (3,) true place of the screw, less where it was said to be [m].
        radius_error: What the handle is truly thicker than believed [m].
        offset: (28,) true encoder offsets [rad].
    """

    handle: Cylinder
    state: FilterState
    seen: Seen
    p_WS: Array
    tips: Fingertips
    touching: Flags
    force: Array
    grip: Grip
    b_W: Array
    radius_error: float
    offset: Array

    def missed(self, state: FilterState) -> Array:
        """(27,) errors that a state still has: true less estimated."""
        return np.concatenate(
            [
                log_so3(self.grip.R_WT @ state.R_WT.T),
                self.grip.p_WT - state.p_WT,
                self.b_W - state.b_W,
                [self.radius_error - state.radius_error],
                self.offset[OFFSET_COLUMNS] - state.offset,
            ]
        )


def planned_grip(plan: GaitPlan, k: int) -> Grip:
    """The first k of `ADDED` on the handle as planned: two fingers amid the roll, more at its end."""
    q = plan.adding(0.0, 0.5) if k == 2 else plan.adding(1.0)
    force = np.array([SQUEEZE if finger in ADDED[:k] else 0.0 for finger in FINGERS])
    half = 0.5 * plan.handle.length
    handle = Cylinder(plan.radius, plan.handle.middle - half, plan.handle.middle + half)
    return Grip(q, plan.p_WS, plan.R_WT, force, handle)


def drawn_corrections(
    grip: Grip, robot: RobotModel, rng: Generator, filter_: ToolFilter, prior: Prior, n: int
) -> Iterator[Instance]:
    """Beliefs drawn from the prior, readings with the filter's noise; `POSITION` and `ROTATION` for the camera."""
    tips = robot.fingertips(grip.q)
    held = np.flatnonzero(grip.force).tolist()
    normals, sunk, sigma = _indented(grip, tips, held, filter_)
    for _ in range(n):
        offset = np.zeros(len(JOINTS))
        offset[OFFSET_COLUMNS] = rng.normal(0.0, prior.offset, len(OFFSET_COLUMNS))
        b, radius_error = rng.normal(size=3) * prior.screw, float(rng.normal() * prior.radius)
        read = robot.fingertips(grip.q + offset)
        p_WF = read.p_WF + rng.normal(0.0, prior.hand, 3)
        p_WF[held] += normals * (sunk + rng.normal(size=len(held)) * sigma)[:, None]
        believed = exp_so3(rng.normal(0.0, prior.rotation, 3)).T @ grip.R_WT
        pose = Pose(grip.p_WT + rng.normal(0.0, POSITION, 3), exp_so3(rng.normal(0.0, ROTATION, 3)) @ grip.R_WT)
        yield Instance(
            handle=replace(grip.handle, radius=grip.handle.radius - radius_error),
            state=prior.state(grip.p_WT - rng.normal(0.0, prior.tip, 3), believed, grip.q + offset),
            seen=Seen(pose, np.diag([POSITION**2] * 3 + [ROTATION**2] * 3)),
            p_WS=grip.p_WT - b + rng.normal(0.0, filter_.tip, 3),
            tips=replace(read, p_WF=p_WF),
            touching=grip.force > 0.0,
            force=grip.force,
            grip=grip,
            b_W=b,
            radius_error=radius_error,
            offset=offset,
        )


def _indented(grip: Grip, tips: Fingertips, held: list[int], filter_: ToolFilter) -> tuple[Array, Array, Array]:
    """Of the fingers that hold: normals (k, 3), ways (k,) to where their force sinks them, and that way's noise [m]."""
    depth = filter_.indentation * grip.force[held]
    normals, sunk, sigma = np.empty((len(held), 3)), np.empty(len(held)), np.empty(len(held))
    for row, i in enumerate(held):
        capsule = Capsule(float(tips.rho[i]), float(tips.length[i]))
        point = closest_points(grip.handle, capsule, grip.p_WT, grip.R_WT, tips.p_WF[i], tips.R_WF[i])
        moves = np.concatenate([point.n_W, np.cross(point.tip_W - tips.p_WF[i], point.n_W)]) @ tips.J[i]
        parts = (filter_.contact, filter_.indentation_error * depth[row], *(filter_.encoder * moves[OFFSET_COLUMNS]))
        normals[row], sunk[row], sigma[row] = point.n_W, -point.gap - depth[row], np.linalg.norm(parts)
    return normals, sunk, sigma
