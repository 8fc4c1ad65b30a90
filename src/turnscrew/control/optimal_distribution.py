"""Sharing the hand's wrench by optimisation: the least squeeze that holds, within what the drives can give."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, hypot

import numpy as np

from turnscrew.contact.force_sharing import FRESH, ForceSharing, Marks, Program, Sharing, program, wrench_weights
from turnscrew.contact.grasp import weighted_grasp_matrix
from turnscrew.control.wanted_forces import WantedForces
from turnscrew.geometry.arrays import Array, Flags, Rows
from turnscrew.geometry.compiled import compiled
from turnscrew.robot.joints import ARM, FINGERS
from turnscrew.robot.model import RobotModel
from turnscrew.robot.motors import DRIVE_LIMITS
from turnscrew.signals import GRIP, Estimate, Goal
from turnscrew.values import changed

FINGER_COUNT = len(FINGERS)
ARM_DRIVES = len(ARM)
"""Drives of the arm, the first ones: contact forces may exhaust the hand's, and the arm's have fifty times what a
fingertip asks of them."""

FIRST = 0.1
"""Share up to which a finger counts as one that has just touched."""


SPEND, REGAIN = 0.05, 0.5
"""Times in which the whole margin is given up and taken back [s]: at once for a hand, and without a ripple in force."""

QUIET = 0.1
"""Rate of leaning that means nothing [rad/s]: three times what the encoders' noise makes."""


@dataclass(frozen=True, slots=True)
class Shared:
    """What is remembered of the last tick.

    Attributes:
        f_W: (5, 3) forces [N].
        held: Which fingers shared.
        active: Rows that bound.
        alarm: Squeeze added because the tool has leaned fast [N].
        spare: Share of the contacts' margin that the drives have torque for, 0 to 1.
        age: Time since the first grip [s].
    """

    f_W: Array
    held: tuple[int, ...]
    active: Marks | None
    alarm: float = 0.0
    spare: float = 1.0
    age: float = 0.0


@dataclass(frozen=True)
class OptimalDistribution:
    """Contact forces by `ForceSharing`, with bounds that bring fingers in and out without a jump.

    Attributes:
        robot: Kinematics, gravity and drives.
        friction: Coefficient counted with, below what is expected of skin on a handle: the rest is margin.
        expected: Coefficient that is expected, by which is told what a contact has to spare.
        margin: Force across its normal that a contact with its whole share must have to spare [N]: a push of 3 N on the
            handle is half a newton to two newtons for each of two fingers, by its direction.
        doubt: Share of that friction that is not counted with at first: what is left is the friction of the greasiest
            handle there is (.35, of .51 that are usually counted with).  It belongs to the margin, and goes with it,
        settled: and fades in this time [s], while the estimate learns from fingers that slide: eighteen fast rounds.
        most: Largest pressing force of a finger with its whole share [N]; Shadow's fingertips stand 5-8 N for long and
            more for a moment.
        least: Least pressing force of a finger with its whole share [N]: an accidental touch does not lift it off.
        first: The same with a tenth of its share [N]: twice what it touches with.
        firm: Share from which on a finger may use all its friction: one that still carries across its normal while it
            hardly presses any more slides off at the end, and shakes the tool.
        reflex: Squeeze added for a tool that is pushed over, by how fast it leans [N.s/rad]: the fingers' own damping
            of 20 N.s/m, 125 mm above the tip, resists with 2.5 N a rad/s across the contacts, which asks for that over
            the friction counted with.
        calm: Time in which such squeeze fades again [s], longer than a push.
        most_reflex: Its limit [N].
        torque: Share of a drive's torque that contact forces may use: what is left moves the finger.
        sharing: Weights of the program.
    """

    robot: RobotModel
    friction: float = 0.6
    expected: float = 1.0
    margin: float = 1.0
    doubt: float = 0.3
    settled: float = 30.0
    most: float = 12.0
    least: float = 1.0
    first: float = 1.0
    firm: float = 0.5
    reflex: float = 6.0
    calm: float = 0.3
    most_reflex: float = 6.0
    torque: float = 0.9
    sharing: ForceSharing = field(default_factory=ForceSharing)
    _room: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_room", self.torque * DRIVE_LIMITS)

    def init(self) -> Shared:
        """Nothing asked for yet."""
        return Shared(np.zeros((len(FINGERS), 3)), (), None)

    def update(
        self, state: Shared, goal: Goal, estimate: Estimate, F_hd: Array, dt: float
    ) -> tuple[Shared, WantedForces]:
        """One tick.

        Args:
            state: Of the last tick.
            goal: Shares and squeezes.
            estimate: Joint angles and contacts.
            F_hd: (6,) wanted wrench of the hand in T, force first [N, N.m].
            dt: Time since the last tick [s].

        Returns:
            The new state, and the forces with their margins.

        Paper: in place of (15) and (16); the error integral of IV-C is not needed where torques press as told.
        """
        fingers = enumerate(zip(goal.roles.tolist(), goal.share.tolist(), strict=True))
        held = tuple(row for row, (role, share) in fingers if role == GRIP and share > 0.0)
        if not held:
            return changed(self.init(), age=state.age), WantedForces.none(F_hd)
        rows = np.array(held)
        alarm = self._alarm(state, estimate, dt)
        active = state.active if state.held == held and state.active is not None else FRESH
        solved = self.sharing.solve(self._posed(state, goal, estimate, F_hd, rows, alarm, active))
        # drives at their limits take the margin first; only when that is spent do they hold back the wrench
        full = solved.status is Sharing.OVERLOADED
        spare = state.spare - dt / SPEND if full else state.spare + dt / REGAIN
        spare = min(max(spare, 0.0), 1.0)
        # nothing is about to slide that is near the end of what is counted on alone
        trusted = estimate.grip[rows] * np.minimum(goal.share[rows] / self.firm, 1.0)
        unused = (self.expected - self._counted(state)) * trusted
        margins = solved.margin - unused * (solved.f_W * estimate.n_W[rows]).sum(axis=1)
        f_W, margin, lost, limited = _spread(
            rows, solved.f_W, margins, solved.lost, solved.limited, spare == 0.0, self.sharing.lever,
            estimate.radius,
        )  # fmt: skip
        after = Shared(f_W, held, solved.active, alarm, spare, state.age + dt)
        return after, WantedForces(f_W, lost, margin, limited)

    def _counted(self, state: Shared) -> float:
        """Friction counted with now, of fingers that are trusted."""
        return self.friction * (1.0 - self.doubt * exp(-state.age / self.settled) * state.spare)

    def _alarm(self, state: Shared, estimate: Estimate, dt: float) -> float:
        """Squeeze that a leaning tool asks for [N]: at once, and fading."""
        leaning = hypot(estimate.nu[3], estimate.nu[4])
        wanted = max(self.reflex * (leaning - QUIET), state.alarm * (1.0 - dt / self.calm))
        return min(wanted, self.most_reflex)

    def _posed(
        self, state: Shared, goal: Goal, estimate: Estimate, F_hd: Array, rows: Rows, alarm: float, active: Marks
    ) -> Program:
        dynamics, sharing = self.robot.dynamics(estimate.q, estimate.v), self.sharing
        J = self.robot.contact_jacobians(estimate.q, estimate.v, estimate.c_W)
        return Program(*_posed(
            rows, goal.share, goal.squeeze, estimate.c_W, estimate.n_W, estimate.grip, estimate.p_WT, estimate.R_WT,
            F_hd, sharing.lever, estimate.radius, state.f_W, active, J, dynamics.bias, self._room, alarm,
            state.spare * self.margin, (self._counted(state), self.firm, self.least, self.first, self.most),
            (sharing.follow, sharing.rest), sharing.sides,
        ))  # fmt: skip


@compiled
def _posed(
    rows: Rows, share: Array, squeeze: Array, c_W: Array, n_W: Array, grip: Array, p_WT: Array, R_WT: Array,
    F_hd: Array, lever: float, radius: float, f_prev: Array, active: Marks, J: Array, bias: Array, room: Array,
    alarm: float, margin: float, limits: tuple[float, float, float, float, float], prices: tuple[float, float],
    sides: int,
) -> tuple[Array, Array, Array, Array, Array, Marks, Array, Array, Array, Array]:  # fmt: skip
    """The program for the contacts of the fingers in `rows`: `weighted_grasp_matrix`, bounds and `program` at once.

    All arrays of five are the messages'; `limits` has friction, firm, least, first and most, `prices` follow and rest.
    """
    friction, firm, least, first, most = limits
    follow, rest = prices
    held, n, weights = share[rows], n_W[rows], wrench_weights(lever, radius)
    A = weighted_grasp_matrix(c_W[rows], p_WT, R_WT, weights)
    bounds = _contact_bounds(held, friction * grip[rows], firm, margin, least, first, most)
    T, torque_least, torque_most = _torque_bounds(J, rows, bias, room)
    return program(
        A, weights * F_hd, n, squeeze[rows] + alarm * held, f_prev[rows], follow, rest, sides, bounds[0], bounds[1],
        bounds[2], bounds[3], T, torque_least, torque_most, active,
    )  # fmt: skip


@compiled
def _spread(
    rows: Rows, f_W: Array, margin: Array, lost: Array, full: Flags, spent: bool, lever: float, radius: float
) -> tuple[Array, Array, Array, Flags]:
    """Forces (5, 3) and margins (5,) of all fingers from those of the fingers in `rows`; the lost wrench itself.

    And which drives (24,) hold the forces back: those of the hand that are `full`, where the margin is `spent`.
    """
    forces, spare = np.zeros((FINGER_COUNT, 3)), np.full(FINGER_COUNT, np.nan)
    forces[rows], spare[rows] = f_W, margin
    limited = np.zeros(ARM_DRIVES + len(full), np.bool_)
    if spent:
        limited[ARM_DRIVES:] = full
    return forces, spare, lost / wrench_weights(lever, radius), limited


@compiled
def _torque_bounds(J: Array, rows: Rows, bias: Array, room: Array) -> tuple[Array, Array, Array]:
    """Torques of the hand's drives by the contact forces, (m, 3k), and their least and largest (m,) [N.m].

    J (5, 3, 24) has the contacts' Jacobians, `bias` (24,) what the drives need without them, and `room` (24,) what they
    may give.
    """
    T = np.empty((len(room) - ARM_DRIVES, 3 * len(rows)))
    for drive in range(len(T)):
        for i in range(len(rows)):
            for axis in range(3):
                T[drive, 3 * i + axis] = J[rows[i], axis, ARM_DRIVES + drive]
    rest, room = bias[ARM_DRIVES:], room[ARM_DRIVES:]
    return T, -room - rest, room - rest


@compiled
def _contact_bounds(
    share: Array, trusted: Array, firm: float, margin: float, least: float, first: float, most: float
) -> Array:
    """Friction counted with, margin, least and largest pressing force of contacts by their shares (k,): (4, k).

    `trusted` (k,) is the friction of contacts with their whole share.
    The largest grows to `first` for who has just touched, then with the square of the share.
    """
    bounds = np.empty((4, len(share)))
    for i in range(len(share)):
        more = max(share[i] - FIRST, 0.0) / (1.0 - FIRST)
        bounds[0, i] = trusted[i] * min(share[i] / firm, 1.0)
        bounds[1, i], bounds[2, i] = margin * share[i], least * share[i]
        bounds[3, i] = min(share[i] / FIRST, 1.0) * first + more * more * (most - first)
    return bounds
