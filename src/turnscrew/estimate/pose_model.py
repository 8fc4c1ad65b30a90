"""The quadratic program of a step of the real-time solver, compiled: a dual active set in the pose problem's own shape.

    min  d' H d / 2 + slope . d_phi    subject to    low <= (d, J d) <= high

Rows are soft: a price above `LIMIT` is not paid.  With H = L L' and y = L' d it is the least distance to a polyhedron
whose normals are those of the boxes and rows divided by L', and its dual a least squares problem in the prices, each
within bounds of its own: of one sign, those of rows not above the limit.  It is solved as Lawson and Hanson do (Solving
Least Squares Problems, 23).  From prices within their bounds, those of the step before, what is held is priced as if
there were no bounds, as far as the first that is met; then what is most violated is held too.

`held` lists the boxes and rows that are held, in the order of the factor G of their products.  `side` is 1 where one is
held at its upper bound, -1 at its lower one, 0 where it is not held; 2 and -2 where its price is at the limit.
"""

from __future__ import annotations

import numpy as np

from turnscrew.estimate.pose_factor import divided, factored, returned
from turnscrew.geometry.arrays import Array, Rows
from turnscrew.geometry.compiled import compiled

LIMIT = 1.0
"""Most price of a unit of violation: five times the largest multipliers, which are tilts over levers.  It is what the
merit asks for one, so a model of rows that cannot be met leads where the merit falls."""

CLOSE = 1e-10
"""Violation that is let be, well below that of a pose which counts as feasible."""

DEPENDENT = 1e-12
"""Least share of a normal that is its own: one that depends on those held is priced until one of them yields."""

SOLVED, PAID, OVERFLOWN, ENDLESS = 1, 2, 0, -1
"""How it ends: all rows met, some violated at the limit's price, numbers not finite, too many changes."""


@compiled
def normals(L: Array, J: Array, slope: Array, M: Array, at: Rows) -> None:
    """The boxes' and rows' normals, and last the slope, divided by L'.

    Args:
        L: (n, n) factor of the Hessian, n = 6 + 4k.
        J: (6k, n).
        slope: (3,) by phi.
        M: (7 + 10k, 10) to be filled in.
        at: (7 + 10k,) to be filled in with where the contact of each begins.
    """
    n, last = J.shape[1], len(M) - 1
    for i in range(len(M)):
        for j in range(10):
            M[i, j] = 0.0
        at[i] = 6
        if i == last:
            for j in range(3):
                M[i, 3 + j] = slope[j]
        elif i < 6:
            M[i, i] = 1.0
        elif i < n:
            at[i] = i - (i - 6) % 4
            M[i, 6 + i - at[i]] = 1.0
        else:
            at[i] = 6 + 4 * ((i - n) // 6)
            for j in range(6):
                M[i, j] = J[i - n, j]
            for j in range(4):
                M[i, 6 + j] = J[i - n, at[i] + j]
        divided(L, M, i, at[i])


@compiled
def against(M: Array, i: int, at: int, y: Array) -> float:
    """The product of normal i and y (n,)."""
    place = M[i, 0] * y[0] + M[i, 1] * y[1] + M[i, 2] * y[2]
    turn = M[i, 3] * y[3] + M[i, 4] * y[4] + M[i, 5] * y[5]
    own = (M[i, 6] * y[at] + M[i, 7] * y[at + 1]) + (M[i, 8] * y[at + 2] + M[i, 9] * y[at + 3])
    total: float = place + turn + own
    return total


@compiled
def product(M: Array, at: Rows, i: int, j: int) -> float:
    """The product of two normals."""
    place = M[i, 0] * M[j, 0] + M[i, 1] * M[j, 1] + M[i, 2] * M[j, 2]
    turn = M[i, 3] * M[j, 3] + M[i, 4] * M[j, 4] + M[i, 5] * M[j, 5]
    own = (M[i, 6] * M[j, 6] + M[i, 7] * M[j, 7]) + (M[i, 8] * M[j, 8] + M[i, 9] * M[j, 9])
    total: float = place + turn + own if at[i] == at[j] else place + turn
    return total


@compiled
def moved(y: Array, M: Array, i: int, at: int, by: float) -> None:
    """Moves y (n,) along normal i."""
    for j in range(6):
        y[j] += by * M[i, j]
    for j in range(4):
        y[at + j] += by * M[i, 6 + j]


@compiled
def held_factor(M: Array, at: Rows, held: Rows, first: int, count: int, G: Array) -> None:
    """Fills in the Cholesky factor of the products of what is held, from its row `first` on."""
    for r in range(first, count):
        i = held[r]
        for s in range(r + 1):
            j = held[s]
            rest = product(M, at, i, j)
            least = DEPENDENT * rest
            for m in range(s):
                rest -= G[r, m] * G[s, m]
            G[r, s] = rest / G[s, s] if s < r else np.sqrt(max(rest, least))


@compiled
def held_before(M: Array, at: Rows, prices: Array, held: Rows, side: Rows, G: Array) -> int:
    """Takes hold of what has a price to begin with: how much that is."""
    count = 0
    for i in range(len(prices)):
        if prices[i] != 0.0:
            side[i] = 1 if prices[i] > 0.0 else -1
            held[count] = i
            held_factor(M, at, held, count, count + 1, G)
            count += 1
    return count


@compiled
def held_solved(G: Array, count: int, x: Array) -> None:
    """Solves with that factor, in place."""
    for r in range(count):
        rest = x[r]
        for s in range(r):
            rest -= G[r, s] * x[s]
        x[r] = rest / G[r, r]
    for r in range(count - 1, -1, -1):
        x[r] /= G[r, r]
        for s in range(r):
            x[s] -= G[r, s] * x[r]


@compiled
def repriced(held: Rows, side: Rows, count: int, n: int, x: Array, prices: Array) -> int:
    """Moves the prices of what is held to x, as far as the first bound of a price: whose that is, -1 where none."""
    share, stop = 1.0, -1
    for r in range(count):
        i = held[r]
        price, wanted, reach = side[i] * prices[i], side[i] * x[r], 1.0
        if wanted < 0.0:
            reach = price / (price - wanted)
        elif i >= n and wanted > LIMIT:
            reach = (LIMIT - price) / (wanted - price)
        if reach < share:
            share, stop = reach, r
    for r in range(count):
        prices[held[r]] += share * (x[r] - prices[held[r]])
    return stop


@compiled
def settled(
    M: Array, at: Rows, low: Array, high: Array, base: Array, held: Rows, side: Rows, first: int, count: int,
    prices: Array, G: Array, x: Array,
) -> int:  # fmt: skip
    """Prices what is held and lets go of what meets a bound of its price, until nothing does: how many are held."""
    n = len(base)
    while count > 0:
        held_factor(M, at, held, first, count, G)
        for r in range(count):
            i = held[r]
            x[r] = against(M, i, at[i], base) - (high[i] if side[i] > 0 else low[i])
        held_solved(G, count, x)
        stop = repriced(held, side, count, n, x, prices)
        if stop < 0:
            return count
        i = held[stop]
        if side[i] * x[stop] < 0.0:
            side[i], prices[i] = 0, 0.0
        else:
            prices[i] = side[i] * LIMIT
            side[i] *= 2
            moved(base, M, i, at[i], -prices[i])
        first, count = stop, count - 1
        for r in range(stop, count):
            held[r] = held[r + 1]
    return count


@compiled
def most_violated(M: Array, at: Rows, low: Array, high: Array, y: Array, side: Rows) -> int:
    """What is farthest outside its bounds in y, or inside and paid for; -1 where nothing is."""
    worst, which = 0.0, -1
    for i in range(len(side)):
        if side[i] == 1 or side[i] == -1:
            continue
        value = against(M, i, at[i], y)
        over, under = value - high[i], low[i] - value
        outside = max(over, under) if side[i] == 0 else -over if side[i] > 0 else -under
        if outside > CLOSE:
            distance = outside * outside / product(M, at, i, i)
            if distance > worst:
                worst, which = distance, i
    return which


@compiled
def step_model(H: Array, slope: Array, J: Array, low: Array, high: Array, changes: int, d: Array, prices: Array) -> int:
    """Solves the quadratic program.

    Args:
        H: (n, n) positive definite, an arrow as `factored` has it; n = 6 + 4k.
        slope: (3,) by phi.
        J: (6k, n) whose rows are about position, rotation and their own contact.
        low: (n + 6k,) of d and J d.
        high: (n + 6k,) of d and J d.
        changes: Most rows to be taken hold of.
        d: (n,) to be filled in.
        prices: (n + 6k,) to begin with, positive at upper bounds; those of the solution come back.

    Returns:
        How it ended.
    """
    n, m = len(H), len(low)
    L, M, G = np.empty((n, n)), np.empty((m + 1, 10)), np.empty((m, m))
    at, held, side = np.empty(m + 1, np.int64), np.empty(m, np.int64), np.zeros(m, np.int64)
    base, y, x = np.zeros(n), np.empty(n), np.empty(m)
    factored(H, L)
    normals(L, J, slope, M, at)
    moved(base, M, m, at[m], -1.0)
    first = count = held_before(M, at, prices, held, side, G)
    for _ in range(changes):
        count = settled(M, at, low, high, base, held, side, first, count, prices, G, x)
        for j in range(n):
            y[j] = base[j]
        for r in range(count):
            moved(y, M, held[r], at[held[r]], -prices[held[r]])
        i = most_violated(M, at, low, high, y, side)
        if i < 0:
            returned(L, y, d)
            return ended(d, M, side)
        if side[i] == 0:
            side[i] = 1 if against(M, i, at[i], y) > high[i] else -1
        else:
            moved(base, M, i, at[i], prices[i])
            side[i] //= 2
        held[count] = i
        first, count = count, count + 1
    return ENDLESS


@compiled
def ended(d: Array, M: Array, side: Rows) -> int:
    """What there is to say of a solution."""
    # squares are not finite where a number is not
    total = 0.0
    for value in d:
        total += value * value
    for value in M.reshape(-1):
        total += value * value
    if not np.isfinite(total):
        return OVERFLOWN
    for one in side:
        if one == 2 or one == -2:
            return PAID
    return SOLVED
