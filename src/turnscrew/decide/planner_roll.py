"""The roll between the planner's knots, by integrating rolling without slip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from turnscrew.decide.plan import ROLLING, Course, Handle
from turnscrew.decide.planner_kinematics import finger_kinematics
from turnscrew.decide.planner_round import KNOTS, Unknowns, axis, roll_knot
from turnscrew.geometry.arrays import Array
from turnscrew.robot.chain import robot_chain

ROWS_BETWEEN = 4
"""Postures kept from knot to knot: 3 deg apart, between which straight lines in joint space leave the handle by less
than 10 um."""

STEPS_BETWEEN = 20
"""Midpoint steps from row to row: 0.15 deg each, an error of 0.1 um."""


@dataclass(frozen=True, slots=True)
class _Tool:
    handle: Handle
    c: Array
    u: Array


def dense_roll(handle: Handle, unknowns: Unknowns, course: Course = Course.ROUND) -> dict[str, Array]:
    """Postures of TH and MF, (K, n), evenly spaced in the handle's yaw [rad].

    Both start from the middle knot and roll both ways, so that the planner's own error falls on the ends by halves.
    MF's three joints leave no choice; TH's other two follow the planner's knots.

    Args:
        handle: What is held.
        unknowns: As planned.
        course: What was planned.
    """
    tool = _Tool(handle, unknowns["c"], np.array(axis(unknowns["u"], np.sqrt)))
    middle = ROWS_BETWEEN * (KNOTS[course] - 1) // 2
    stroke = float(unknowns["stroke"][0])
    rows = {}
    for finger in ROLLING:
        knots = np.array([unknowns[roll_knot(finger, knot)] for knot in range(KNOTS[course])])
        guide = CubicSpline(np.linspace(0.0, 1.0, KNOTS[course]), knots)
        halves = [_half(finger, tool, guide, stroke, middle, end) for end in (0.0, 1.0)]
        rows[finger] = np.array([*halves[0][:0:-1], *halves[1]])
    return rows


def _half(finger: str, tool: _Tool, guide: CubicSpline, stroke: float, middle: int, end: float) -> list[Array]:
    """Rows from the middle of the roll to one end, `middle` of them apart, the middle first."""
    ds = (end - 0.5) / (middle * STEPS_BETWEEN)
    q = _onto(finger, tool, np.asarray(guide(0.5)))
    rows, s = [q], 0.5
    for _ in range(middle):
        for _ in range(STEPS_BETWEEN):
            half = q + ds / 2 * _rate(finger, tool, guide, stroke, s, q)
            q = q + ds * _rate(finger, tool, guide, stroke, s + ds / 2, half)
            s += ds
        q = _onto(finger, tool, q)
        rows.append(q)
    return rows


def contact(finger: str, handle: Handle, c: Array, u: Array, q: Array) -> tuple[float, Array, Array]:
    """Contact of a fingertip's half ball with the handle.

    Args:
        finger: Which.
        handle: What is touched.
        c: (3,) middle of the handle in H [m].
        u: (3,) its axis.
        q: (n,) driven joints [rad].

    Returns:
        Gap [m]; the handle's outward normal (3,); the Jacobian (3, n) of the finger's material point there [m/rad].
    """
    tip, _, J_p, J_w = (np.array(value) for value in finger_kinematics(finger).tip(q))
    offset = tip[:, 0] - c
    radial = offset - (offset @ u) * u
    reach = float(np.sqrt(radial @ radial))
    n = radial / reach
    rho = robot_chain().tips[finger].rho
    return reach - handle.radius - rho, n, J_p - rho * np.cross(J_w.T, n).T


def _rate(finger: str, tool: _Tool, guide: CubicSpline, stroke: float, s: float, q: Array) -> Array:
    """Joint rates over the roll's fraction: no slip at the contact, else as the guide."""
    _, n, J = contact(finger, tool.handle, tool.c, tool.u, q)
    surface = -stroke * tool.handle.radius * np.cross(tool.u, n)
    wanted = guide(s, 1) + (guide(s) - q)
    return np.asarray(wanted + J.T @ np.linalg.solve(J @ J.T, surface - J @ wanted))


def _onto(finger: str, tool: _Tool, q: Array) -> Array:
    """Nearest posture that touches: Newton on the gap, which starts at microns, along its own gradient."""
    for _ in range(4):
        gap, n, J = contact(finger, tool.handle, tool.c, tool.u, q)
        slope = J.T @ n
        q = q - gap * slope / (slope @ slope)
    return q
