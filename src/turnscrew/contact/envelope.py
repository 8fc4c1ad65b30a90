"""The largest steady torque that a grasp can put on a screw, and what it is held back by: a linear program.

    max  tau
    s.t. A f + F_s + F_g = 0,  F_s = (s_x, s_y, f_z, t_x, t_y, tau),
         f inside an inner pyramid of each friction cone,  f_n <= N,
         |rest + J^T f| <= rating for every drive,  |s| <= side,  |t_x|, |t_y| <= lean.

The hand may choose the contact forces f; the screw's drive supplies side forces s and torques t within bounds.  The
program's prices tell how much more torque a larger limit would give, so they name the limit that binds.

Paper: the statics of (7), (15) and (18), the tool at rest; it asks nowhere how much torque a grasp has to give.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import cos, pi

import numpy as np
from scipy.optimize import OptimizeResult, linprog

from turnscrew.contact.friction import polyhedral_cones
from turnscrew.geometry.arrays import Array

SIDES = 48
"""Faces of a pyramid: an inner one gives away up to 1 - cos(pi / 48) = .2 % of the friction."""


class Verdict(StrEnum):
    """How the program ended."""

    SOLVED = "solved"
    HELPLESS = "helpless"
    """No forces hold the tool and press its tip as wanted, even without torque."""
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Drives:
    """Joint torques of contact forces: `|rest + T f| <= rating`.

    Attributes:
        T: (m, 3k) rows of J^T, contact forces stacked in W.
        rest: (m,) torques without contact forces: gravity [N.m].
        rating: (m,) largest torque of each drive [N.m].
    """

    T: Array
    rest: Array
    rating: Array


@dataclass(frozen=True, slots=True)
class Drive:
    """What the screw's drive does for the tip, and what the tip asks of it.

    Attributes:
        thrust: Force of the screw on the tip along z of T [N].
        side: Largest force along x and y of T each [N].
        lean: (2,) largest torque about x and y of T [N.m].
    """

    thrust: float
    side: float
    lean: Array


@dataclass(frozen=True, slots=True)
class Hold:
    """A grasp at rest, as far as forces go.

    Attributes:
        A: (6, 3k) map from contact forces in W to their wrench on the tool at its tip, in T: `diag(R^T, R^T) G`.
        n_W: (k, 3) handle's outward unit normals, in W.
        load: (6,) wrench of everything but fingers and screw on the tool at its tip, in T: its weight [N, N.m].
        friction: Coulomb coefficient of the contacts.
        most: (k,) largest pressing force of each finger [N].
        drives: Joint torques.
        drive: What the screw's drive supplies.
    """

    A: Array
    n_W: Array
    load: Array
    friction: float
    most: Array
    drives: Drives
    drive: Drive


@dataclass(frozen=True, slots=True)
class Gains:
    """What each limit is worth: growth of the torque with the limit's logarithm, `d tau / d ln limit` [N.m].

    One per cent more of a limit gives a hundredth of its gain more torque; a limit that does not bind has 0.

    Attributes:
        friction: (k,) of each contact's coefficient.
        squeeze: (k,) of each contact's largest pressing force.
        drives: (m,) of each drive's rating.
        side: Of the side force that the screw's drive supplies.
        lean: Of the torques about x and y that it supplies.
    """

    friction: Array
    squeeze: Array
    drives: Array
    side: float
    lean: float


@dataclass(frozen=True, slots=True)
class Steady:
    """The answer.

    Attributes:
        torque: Largest torque [N.m]; 0 where the verdict is not "solved".
        ceiling: The same with circumscribed pyramids: round cones give something in between [N.m].
        f_W: (k, 3) forces of the fingertips on the tool that give `torque`, in W [N].
        F_s: (6,) wrench of the screw on the tool's tip then, in T, force first [N, N.m].
        gains: What each limit is worth.
        verdict: How the program ended.
        iterations: Of the solver.
    """

    torque: float
    ceiling: float
    f_W: Array
    F_s: Array
    gains: Gains
    verdict: Verdict
    iterations: int


@dataclass(frozen=True, slots=True)
class Sure:
    """Contact forces with the largest least margin.

    Attributes:
        f_W: (k, 3) forces of the fingertips on the tool, in W [N].
        F_s: (6,) wrench of the screw on the tool's tip then, in T, force first [N, N.m].
        margin: Least `mu f_n - |f_t|` over the contacts [N]; negative where the torque asks for more than friction.
        verdict: How the program ended; "helpless" where drives or squeeze cannot give the torque with any friction.
    """

    f_W: Array
    F_s: Array
    margin: float
    verdict: Verdict


def largest_torque(hold: Hold, sides: int = SIDES) -> Steady:
    """Solves the program.

    Args:
        hold: The grasp.
        sides: Faces of a pyramid.
    """
    inner = _solve(hold, hold.friction, sides)
    k, m = len(hold.n_W), len(hold.drives.rating)
    if inner.status != SOLVED:
        none = Gains(np.zeros(k), np.zeros(k), np.zeros(m), 0.0, 0.0)
        return Steady(0.0, 0.0, np.zeros((k, 3)), np.zeros(6), none, _verdict(inner), int(inner.nit))
    outer = _solve(hold, hold.friction / cos(pi / sides), sides)
    x = inner.x[3 * k :]
    return Steady(
        torque=float(x[4]),
        ceiling=float(outer.x[3 * k + 4]),
        f_W=inner.x[: 3 * k].reshape(k, 3),
        F_s=_at_tip(x, hold.drive),
        gains=_gains(inner, hold, sides),
        verdict=Verdict.SOLVED,
        iterations=int(inner.nit),
    )


def surest_forces(hold: Hold, torque: float, sides: int = SIDES) -> Sure:
    """Contact forces that give a torque as far inside their cones as they can all be.

    The same program with tau given and the least margin to be made large: the cones' rows become `a f + e <= 0`.

    Args:
        hold: The grasp.
        torque: On the screw [N.m].
        sides: Faces of a pyramid.
    """
    k = len(hold.n_W)
    found = _solve(hold, hold.friction, sides, torque)
    if found.status != SOLVED:
        return Sure(np.zeros((k, 3)), np.zeros(6), 0.0, _verdict(found))
    f_W, x = found.x[: 3 * k].reshape(k, 3), found.x[3 * k :]
    return Sure(f_W, _at_tip(x, hold.drive), float(x[-1]), Verdict.SOLVED)


SOLVED, INFEASIBLE = 0, 2
"""scipy's marks."""


def _at_tip(x: Array, drive: Drive) -> Array:
    """Wrench (6,) of the screw on the tip from s_x, s_y, t_x, t_y, tau."""
    return np.array([x[0], x[1], drive.thrust, x[2], x[3], x[4]])


def _verdict(found: OptimizeResult) -> Verdict:
    return {SOLVED: Verdict.SOLVED, INFEASIBLE: Verdict.HELPLESS}.get(found.status, Verdict.FAILED)


def _solve(hold: Hold, friction: float, sides: int, torque: float | None = None) -> OptimizeResult:
    """Unknowns: contact forces, s_x, s_y, t_x, t_y, tau; with a given torque also the margin, which is then wanted."""
    k = len(hold.n_W)
    rows, bounds = _rows(hold, friction, sides)
    more = 5 if torque is None else 6
    rows = np.hstack([rows, np.zeros((len(rows), more))])
    supplied = np.zeros((6, more))
    supplied[[0, 1, 3, 4, 5], range(5)] = 1.0
    balance = -hold.load
    balance[2] -= hold.drive.thrust
    lean = hold.drive.lean.tolist()
    box: list[tuple[float | None, float | None]] = [(None, None)] * (3 * k)
    box += [(-s, s) for s in (hold.drive.side, hold.drive.side, *lean)]
    box += [(0.0, None)] if torque is None else [(torque, torque), (None, None)]
    if torque is not None:
        rows[: k * sides, -1] = 1.0
    wanted = np.append(np.zeros(3 * k + more - 1), -1.0)
    return linprog(wanted, rows, bounds, np.hstack([hold.A, supplied]), balance, box, method="highs")


def _rows(hold: Hold, friction: float, sides: int) -> tuple[Array, Array]:
    """`rows @ f <= bounds`: pyramids, pressing forces, drives at their upper and at their lower bounds."""
    n_W, drives = hold.n_W, hold.drives
    k, m = len(n_W), len(drives.rating)
    cones = k * sides
    rows, bounds = np.zeros((cones + k + 2 * m, 3 * k)), np.zeros(cones + k + 2 * m)
    pyramids = polyhedral_cones(n_W, np.full(k, friction), sides)
    for i in range(k):
        rows[i * sides : (i + 1) * sides, 3 * i : 3 * i + 3] = pyramids[i]
        rows[cones + i, 3 * i : 3 * i + 3] = -n_W[i]
    bounds[cones : cones + k] = hold.most
    rows[cones + k : cones + k + m], bounds[cones + k : cones + k + m] = drives.T, drives.rating - drives.rest
    rows[cones + k + m :], bounds[cones + k + m :] = -drives.T, drives.rating + drives.rest
    return rows, bounds


def _gains(found: OptimizeResult, hold: Hold, sides: int) -> Gains:
    """A row `a(mu) f <= b` gains what its price says of `b`, and by `mu` what that moves the row: `mu cos f_n`."""
    k, m = len(hold.n_W), len(hold.drives.rating)
    prices = -found.ineqlin.marginals
    pressing = -(found.x[: 3 * k].reshape(k, 3) * hold.n_W).sum(axis=1)
    cones = prices[: k * sides].reshape(k, sides).sum(axis=1)
    high, low = prices[k * sides + k : -m], prices[-m:]
    # a box's ends both move when it grows
    tip = (found.lower.marginals - found.upper.marginals)[3 * k : 3 * k + 4]
    return Gains(
        friction=cones * hold.friction * cos(pi / sides) * pressing,
        squeeze=prices[k * sides : k * sides + k] * hold.most,
        drives=(high + low) * hold.drives.rating,
        side=float(tip[:2].sum() * hold.drive.side),
        lean=float(tip[2:] @ hold.drive.lean),
    )
