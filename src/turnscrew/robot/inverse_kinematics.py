"""Inverse kinematics of the arm (a palm pose) and of a finger (a fingertip point), by damped least squares.

Levenberg-Marquardt on the weighted error e(q) inside the joint ranges: a joint at its bound that the step would push
further out is left out of that step (projection onto the active set), `(J^T J + lambda I) dq = J^T e`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.robot.joints import ARM, COUPLED, FINGERS, INDEX, WRIST, finger_joints
from turnscrew.robot.model import RobotModel, driven_jacobian

PALM_LENGTH = 0.1
"""Length that turns a palm's orientation error into metres [m/rad]: the distance from the wrist to the knuckles, so
that a radian of error weighs what it moves the fingers' roots by."""

TOLERANCE = 1e-6
"""Weighted error below which a target counts as reached [m]: a thousandth of what the drives resolve."""

MOST_ITERATIONS = 100
FIRST_DAMPING = 1e-4
"""Relative to the mean of J^T J's diagonal; divided or multiplied by the factors below as steps succeed or fail."""
EASE, STIFFEN = 0.2, 8.0
MOST_DAMPING = 1e6


class Reach(StrEnum):
    """How an inverse-kinematics problem ended."""

    SOLVED = "solved"
    AT_LIMITS = "at limits"
    STALLED = "stalled"


@dataclass(frozen=True, slots=True)
class Solution:
    """Joint angles nearest to a target.

    Attributes:
        q: (28,) joint angles [rad]; joints that were not asked to move keep their values.
        status: `SOLVED`; `AT_LIMITS` when joint ranges keep the target out of reach; otherwise `STALLED`.
        residual: Norm of the remaining weighted error [m].
        iterations: Steps tried, over all starts.
    """

    q: Array
    status: Reach
    residual: float
    iterations: int


Errors = Callable[[Array], tuple[Array, Array]]
"""Of joint angles (28,): the weighted error e (m,) and the derivative of -e by all joints, J (m, 28)."""


def rotation_vector(R: Array) -> Array:
    """Axis times angle (3,) [rad] of a rotation R (3, 3), the angle in [0, pi]."""
    axial = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.sqrt(axial @ axial)), 0.5 * (np.trace(R) - 1.0)
    angle = float(np.arctan2(sine, cosine))
    if sine > 1e-6:
        return axial * (angle / sine)
    if cosine > 0.0:
        return axial
    # half a turn: the axis is the column of (R + I) that is farthest from zero
    column = (R + np.eye(3))[:, int(np.argmax(np.diag(R)))]
    return angle * column / np.sqrt(column @ column)


def place_palm(
    robot: RobotModel, p_WH: Array, R_WH: Array, q: Array, rng: np.random.Generator,
    margin: float = 0.0, starts: int = 20,
) -> Solution:  # fmt: skip
    """Moves the arm's four joints and the wrist's two so that the palm takes a pose.

    Args:
        robot: Kinematics and joint ranges.
        p_WH: (3,) wanted origin of the palm frame in W [m].
        R_WH: (3, 3) wanted orientation.
        q: (28,) first start; also the posture of all other joints [rad].
        rng: Draws the further starts, uniformly in the joint ranges.
        margin: Distance kept from every joint limit [rad].
        starts: Most starts that are tried before the best answer is returned.
    """

    def errors(posture: Array) -> tuple[Array, Array]:
        p, R = robot.palm(posture)
        J = robot.palm_jacobian(posture)
        J[3:] *= PALM_LENGTH
        return np.concatenate([p_WH - p, PALM_LENGTH * rotation_vector(R_WH @ R.T)]), J

    joints = np.array([INDEX[name] for name in (*ARM, *WRIST)])
    return _several_starts(errors, q, joints, robot.limits[joints] + [margin, -margin], rng, starts)


def place_fingertip(
    robot: RobotModel, finger: str, p_WF: Array, q: Array, rng: np.random.Generator,
    margin: float = 0.0, starts: int = 5,
) -> Solution:  # fmt: skip
    """Moves one finger's joints so that its fingertip frame's origin takes a place; J1 follows J2.

    Args:
        robot: Kinematics and joint ranges.
        finger: One of `FINGERS`.
        p_WF: (3,) wanted place of the distal half ball's centre in W [m].
        q: (28,) first start; also the posture of all other joints [rad].
        rng: Draws the further starts, uniformly in the joint ranges.
        margin: Distance kept from every joint limit [rad].
        starts: Most starts that are tried before the best answer is returned.
    """
    row = FINGERS.index(finger)

    def errors(posture: Array) -> tuple[Array, Array]:
        tips = robot.fingertips(posture)
        return p_WF - tips.p_WF[row], driven_jacobian(tips.J[row, :3])

    joints = np.array(finger_joints(finger))
    return _several_starts(errors, q, joints, robot.limits[joints] + [margin, -margin], rng, starts)


def _several_starts(
    errors: Errors, q: Array, joints: Array, bounds: Array, rng: np.random.Generator, starts: int
) -> Solution:
    best = _descend(errors, _begin(q, joints, q[joints], bounds), joints, bounds)
    spent = best.iterations
    for _ in range(starts - 1):
        if best.status is Reach.SOLVED:
            break
        drawn = rng.uniform(bounds[:, 0], bounds[:, 1])
        found = _descend(errors, _begin(q, joints, drawn, bounds), joints, bounds)
        spent += found.iterations
        best = found if found.residual < best.residual else best
    return Solution(best.q, best.status, best.residual, spent)


def _begin(q: Array, joints: Array, angles: Array, bounds: Array) -> Array:
    posture = q.copy()
    posture[joints] = np.clip(angles, bounds[:, 0], bounds[:, 1])
    return _coupled(posture)


def _coupled(q: Array) -> Array:
    for follower, leader in COUPLED.items():
        q[INDEX[follower]] = q[INDEX[leader]]
    return q


def _descend(errors: Errors, q: Array, joints: Array, bounds: Array) -> Solution:
    damping, identity = FIRST_DAMPING, np.eye(len(joints))
    e, J = errors(q)
    size = float(e @ e)
    held: Flags = np.zeros(len(joints), dtype=bool)
    iteration = 0
    while iteration < MOST_ITERATIONS and size > TOLERANCE**2 and damping < MOST_DAMPING:
        iteration += 1
        gradient, square = J[:, joints].T @ e, J[:, joints].T @ J[:, joints]
        held = _held(q[joints], gradient, bounds)
        square[held], square[:, held], gradient[held] = 0.0, 0.0, 0.0
        square += damping * np.trace(square) / len(joints) * identity + 1e-12 * identity
        trial = q.copy()
        trial[joints] = np.clip(q[joints] + np.linalg.solve(square, gradient), bounds[:, 0], bounds[:, 1])
        trial = _coupled(trial)
        e_trial, J_trial = errors(trial)
        gain = size - float(e_trial @ e_trial)
        if gain > 0.0:
            q, e, J, size, damping = trial, e_trial, J_trial, size - gain, damping * EASE
        else:
            damping *= STIFFEN
        if 0.0 <= gain < 1e-10 * size:
            break
    status = Reach.SOLVED if size <= TOLERANCE**2 else Reach.AT_LIMITS if held.any() else Reach.STALLED
    return Solution(q, status, float(np.sqrt(size)), iteration)


def _held(angles: Array, gradient: Array, bounds: Array) -> Flags:
    at_low = (angles <= bounds[:, 0]) & (gradient < 0.0)
    at_high = (angles >= bounds[:, 1]) & (gradient > 0.0)
    return at_low | at_high
