"""The smallest contact forces that do what they can of a wanted wrench, inside cones and joint torques: a small QP.

    min  |W (G f - F)|^2 + a |f - f_prev|^2 + b |f - (-N_d n)|^2
    s.t. f inside an inner pyramid of each friction cone, by a margin,  N_lo <= f_n <= N_hi,
         tau_lo <= J^T f <= tau_hi, at a price.

The wanted wrench is a target and not a constraint, and the largest forces along the inward normals satisfy every hard
row.  So there always is an answer: what cannot be done is left out, and said.

Paper: stands for (15) and (16).  (15) is the wrench term; the rest is the "proper choice of F_0" that (16) leaves open.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import cos, isfinite, pi
from typing import NamedTuple, TypeAlias

import daqp
import numpy as np
from numpy.typing import NDArray

from turnscrew.contact.friction import margins, polyhedral_cones
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.compiled import compiled

Marks: TypeAlias = NDArray[np.int32]
"""daqp's marks of rows: 0 free, 1 active, 3 active at the lower bound, 8 added where a row is soft."""

SOFT = 8
"""daqp's mark of a row that may be violated at a price."""

PRICE = 1e2
"""Price of a newton metre beyond a drive's torque.  A wanted newton that is not given costs up to 2 |F| = 20 at a tip
force of 10 N, and reaches a joint by some .07 m: a price of 20 / .07 is of the same size, so under overload the wrench
gives way first by what the drive lacks, and neither term outweighs the other beyond the solver's scaling."""

FRESH: Marks = np.zeros(0, dtype=np.int32)
"""Marks of a program that has not been solved before."""

BEYOND = 1e30
"""daqp's infinity."""


class Sharing(StrEnum):
    """How the program ended; every status but `FAILED` carries the optimum."""

    SOLVED = "solved"
    OVERLOADED = "overloaded"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Bounds:
    """What the forces may be.

    Attributes:
        friction: (k,) coefficients counted with.
        margin: (k,) force across its normal that each contact must have to spare [N]; as much of it as its largest
            pressing force has room for.
        least: (k,) least pressing force [N], at least 0.
        most: (k,) largest pressing force [N].
        T: (m, 3k) joint torques of the contact forces, rows of J^T.
        torque_least: (m,) least joint torque that contact forces may ask for [N.m].
        torque_most: (m,) the largest [N.m].
    """

    friction: Array
    margin: Array
    least: Array
    most: Array
    T: Array
    torque_least: Array
    torque_most: Array


@compiled
def wrench_weights(lever: float, radius: float) -> Array:
    """`ForceSharing.weights`, for compiled functions to call."""
    return np.array([1.0, 1.0, 1.0, 1.0 / lever, 1.0 / lever, 1.0 / radius])


class Program(NamedTuple):
    """The program in the solver's form, `min 1/2 f^T H f + slope f` with `low <= rows f <= high`, by `program`.

    Attributes:
        H: (3k, 3k) Hessian.
        slope: (3k,) linear part.
        rows: (sides k + k + m, 3k) faces of the pyramids, pressing forces, joint torques.
        low: Their least values.
        high: Their largest.
        marks: How the solver is to begin with each.
        A: (6, 3k) weighted map from contact forces in W to the wrench.
        wanted: (6,) weighted wrench.
        n_W: (k, 3) handle's outward unit normals, in W.
        friction: (k,) coefficients counted with.
    """

    H: Array
    slope: Array
    rows: Array
    low: Array
    high: Array
    marks: Marks
    A: Array
    wanted: Array
    n_W: Array
    friction: Array


@dataclass(frozen=True, slots=True)
class ContactForces:
    """The answer.

    Attributes:
        f_W: (k, 3) forces of the fingertips on the tool, in W [N].
        lost: (6,) part of the wanted wrench that they do not give, in the frame it was wanted in [N, N.m].
        margin: (k,) `mu f_n - |f_t|`: by how much each force is inside its round cone [N].
        limited: (m,) which joint torques stand at their bounds and hold the forces back.
        overload: (m,) joint torques beyond their bounds [N.m]; next to nothing, since the wrench gives way first.
        status: How the program ended.
        iterations: Of the solver.
        active: (rows,) which rows bind, as the solver marks them: the start of the next solve.
    """

    f_W: Array
    lost: Array
    margin: Array
    limited: Flags
    overload: Array
    status: Sharing
    iterations: int
    active: Marks


@dataclass(frozen=True)
class ForceSharing:
    """Weights of the program.

    Attributes:
        lever: A newton across the tool's axis is worth a newton metre over this [m]: half the contacts' height, so that
            a torque that leans the tool counts twice as much as the side force at the tip that would balance it.
        follow: Price of a change since the last tick: what is asked of the contacts moves on within some ticks.
        rest: Price of forces other than the wanted squeeze; it costs half a percent of the wrench.
        sides: Faces of a pyramid.
        pivots: Most changes of the active set; from a warm start a handful is usual.
    """

    lever: float = 0.06
    follow: float = 0.02
    rest: float = 0.01
    sides: int = 8
    pivots: int = 200

    def weights(self, radius: float) -> Array:
        """(6,) what a unit of force and torque in T counts: 1, 1/lever about x and y, 1/radius about the axis."""
        return wrench_weights(self.lever, radius)

    def share(
        self, A: Array, wanted: Array, n_W: Array, squeeze: Array, f_prev: Array, bounds: Bounds, active: Marks | None
    ) -> ContactForces:
        """Solves the program.

        Args:
            A: (6, 3k) weighted map from contact forces in W to the wrench, `W diag(R^T, R^T) G`.
            wanted: (6,) weighted wrench, `W F_hd`.
            n_W: (k, 3) handle's outward unit normals, in W.
            squeeze: (k,) pressing forces that are wanted where the wrench leaves a choice, N_d [N].
            f_prev: (k, 3) forces of the last tick, in W [N].
            bounds: Cones, pressing forces and joint torques.
            active: Of the last answer for the same contacts; None for a fresh start.

        Returns:
            The answer; its `lost` is weighted, as `wanted` is.
        """
        parts = program(
            A, wanted, n_W, squeeze, f_prev, self.follow, self.rest, self.sides, bounds.friction, bounds.margin,
            bounds.least, bounds.most, bounds.T, bounds.torque_least, bounds.torque_most,
            FRESH if active is None else active,
        )  # fmt: skip
        return self.solve(Program(*parts))

    def solve(self, posed: Program) -> ContactForces:
        """Solves a program that stands already."""
        f, _, flag, info = daqp.solve(
            posed.H, posed.slope, posed.rows, posed.high, posed.low, posed.marks, w_soft=PRICE, iter_limit=self.pivots
        )
        finite, f_W, lost, margin, limited, overload, marks = _outcome(
            f, info["lam"], posed.A, posed.wanted, posed.n_W, posed.friction, posed.rows, posed.low, posed.high,
            self.sides,
        )  # fmt: skip
        if flag < 1 or not finite:
            return self._nothing(posed)
        status = Sharing.OVERLOADED if limited.any() else Sharing.SOLVED
        return ContactForces(f_W, lost, margin, limited, overload, status, int(info["iterations"]), marks)

    def _nothing(self, posed: Program) -> ContactForces:
        """The largest forces along the normals, which satisfy every hard row."""
        k = len(posed.n_W)
        most = posed.high[self.sides * k : (self.sides + 1) * k]
        f_W = -most[:, None] * posed.n_W
        none = np.zeros(len(posed.rows) - (self.sides + 1) * k)
        return ContactForces(
            f_W, posed.wanted - posed.A @ f_W.ravel(), posed.friction * most, none > 0.0, none, Sharing.FAILED,
            self.pivots, np.zeros_like(posed.marks),
        )  # fmt: skip


@compiled
def program(
    A: Array,
    wanted: Array,
    n_W: Array,
    squeeze: Array,
    f_prev: Array,
    follow: float,
    rest: float,
    sides: int,
    friction: Array,
    margin: Array,
    least: Array,
    most: Array,
    T: Array,
    torque_least: Array,
    torque_most: Array,
    active: Marks,
) -> tuple[Array, Array, Array, Array, Array, Marks, Array, Array, Array, Array]:
    """What `Program` holds; arguments as for `ForceSharing.share`, `active` empty for a fresh start."""
    k, m = len(n_W), len(T)
    H = np.dot(A.T, A)
    slope = np.dot(-wanted, A)
    for i in range(3 * k):
        H[i, i] += follow + rest
        slope[i] -= follow * f_prev[i // 3, i % 3] - rest * squeeze[i // 3] * n_W[i // 3, i % 3]
    cones = k * sides
    rows = np.zeros((cones + k + m, 3 * k))
    low, high = np.full(len(rows), -BEYOND), np.empty(len(rows))
    pyramids = polyhedral_cones(n_W, friction, sides)
    for i in range(k):
        at = slice(3 * i, 3 * i + 3)
        rows[i * sides : (i + 1) * sides, at] = pyramids[i]
        high[i * sides : (i + 1) * sides] = -min(margin[i], 0.9 * cos(pi / sides) * friction[i] * most[i])
        rows[cones + i, at] = -n_W[i]
        low[cones + i], high[cones + i] = least[i], most[i]
    rows[cones + k :], low[cones + k :], high[cones + k :] = T, torque_least, torque_most
    marks = np.zeros(len(rows), dtype=np.int32)
    marks[cones + k :] = SOFT
    if len(active) == len(rows):
        marks |= active
    return H, slope, rows, low, high, marks, A, wanted, n_W, friction


@compiled
def _outcome(
    f: Array, prices: Array, A: Array, wanted: Array, n_W: Array, friction: Array, rows: Array, low: Array, high: Array,
    sides: int,
) -> tuple[bool, Array, Array, Array, Flags, Array, Marks]:  # fmt: skip
    """Whether there are numbers; forces, lost wrench, margins, drives at bounds, torques beyond them, and marks."""
    k = len(n_W)
    torques = (sides + 1) * k
    torque = np.dot(rows[torques:], f)
    overload = np.maximum(np.maximum(torque - high[torques:], low[torques:] - torque), 0.0)
    marks = np.zeros(len(prices), dtype=np.int32)
    for i in range(len(prices)):
        # a row that binds at its upper bound is marked 1, at its lower 3
        if prices[i] != 0.0:
            marks[i] = 1 if prices[i] > 0.0 else 3
    f_W = f.copy().reshape(k, 3)
    limited, lost = marks[torques:] != 0, wanted - np.dot(A, f)
    return isfinite(f.sum()), f_W, lost, margins(f_W, n_W, friction), limited, overload, marks
