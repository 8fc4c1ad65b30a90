"""A cell with the tool held by thumb and middle finger, for tests of the plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from turnscrew.decide.plans import plan_for
from turnscrew.geometry.rotations import cross
from turnscrew.plant.cell import Cell, CellDescription
from turnscrew.plant.contact import Friction
from turnscrew.plant.screw import Screw
from turnscrew.plant.thread import Thread
from turnscrew.plant.tool import Tool
from turnscrew.robot.joints import COUPLED, DRIVEN, FINGERS, INDEX
from turnscrew.robot.model import RobotModel
from turnscrew.robot.servos import STIFFNESSES

SELF_LOCKING = Thread("self-locking", 0.02, 0.02, 10.0, 1.0)
PLAN = plan_for(0.018)


def cell(thread: Thread = SELF_LOCKING, **changes: object) -> Cell:
    """A cell at the start of the default plan, the tool upright in the slot."""
    description = CellDescription(
        Tool(radius=0.018, length=0.1, middle=0.125, mass=0.08), Screw(), thread, Friction(1.0, 0.3), PLAN.p_WS, 0.0
    )
    lift = np.array([0.0, 0.0, 1e-4])
    return Cell(replace(description, **changes), PLAN.rolling(0.0), PLAN.p_WS + lift, np.eye(3))


def pressing(robot: RobotModel, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Commands (24,) with which TH and MF press on the handle: inward by force[0], down by force[1] each [N]."""
    tips = robot.fingertips(q)
    torque = robot.gravity(q)
    for finger in ("TH", "MF"):
        row = FINGERS.index(finger)
        inward = (PLAN.p_WS - tips.p_WF[row]) * [1, 1, 0]
        inward /= np.linalg.norm(inward)
        arm = tips.rho[row] * inward
        J = tips.J[row, :3] + np.array([cross(column, arm) for column in tips.J[row, 3:].T]).T
        torque = torque + J.T @ (force[0] * inward - [0, 0, force[1]])
    for follower, leader in COUPLED.items():
        torque[INDEX[leader]] += torque[INDEX[follower]]
    driven = [INDEX[name] for name in DRIVEN]
    return q[driven] + torque[driven] / STIFFNESSES
