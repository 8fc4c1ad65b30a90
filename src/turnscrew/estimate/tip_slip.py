"""Has the tip slipped?  Forces, camera and motion are asked what a tip at rest in its drive excludes.

The estimation assumes a tip without acceleration (III-B), so its poses and wrenches cannot show a slip; what shows it
is that the readings stop to agree with each other.  A tip that skids by a millimetre does so within some 20 ms, and
jerks the tool in the fingers:

- **net**: the hand's force, and its torque about the tip's x and y, jump.  A tool at rest on its tip needs no such
  torque, and a lateral force or a loss of axial force beyond what the friction of blade and slot passes on is no
  tip at rest either.  The errors of fingertip readings jump as well, when squeezes change: they are learned, and
  what is left of them counts as noise.
- **grip**: fingers that hold firm press smoothly.  Those that touch or let go do not, and jerk the tool by no more
  than what they press with.
- **seen**: the camera sees the tip leave the place where it has seen it so far.  It takes a camera of half a
  millimetre; one of 3 mm tells nothing in a tenth of a second.
- **moved**: the fingers move as by a tip that is displaced; see `TipMotion`.  It tells where many fingers hold the
  tool so firmly that nothing jerks.

The first three are CUSUMs (Page, 1954) of the likelihood ratio of innovations y with covariance S against
`inflation^2 S`,

    g <- max(0, g + (1 - inflation^-2) y' S^-1 y / 2 - m log(inflation)),       m the size of y.

Without slips, Wald's bound gives a mean time between alarms of `period exp(h)` at least, whence the threshold h.  The
log-likelihood ratio of the motion, which is independent of them, is added to the largest of these where it speaks for
a slip; where it speaks against one, it may be fingers that slide.

Paper: no counterpart; its no-slip assumptions dv_x = dv_y = 0 of III-B are what is tested.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, hypot, inf, log

import numpy as np

from turnscrew.estimate.biased_load import DIRECTION_SHARE
from turnscrew.estimate.second_look import LookState, SecondLook
from turnscrew.estimate.slip_steps import Press, held_force, net_force, pressed
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import FINGERS

K = len(FINGERS)
NET = 5
BIASED = slice(1, 1 + K)


@dataclass(frozen=True, slots=True)
class SlipState:
    """What the tests remember.

    Attributes:
        x: (5, 6) of hand force x, y, z and hand torque x, y in W: the load, and its errors per newton of squeeze.
        P: (5, 6, 6) their covariances.
        level: (5, 3) smoothed force of each fingertip, in W [N].
        slope: (5, 3) its change a tick [N].
        slow: (5,) slowly smoothed size of each force [N].
        changed: Time since the set of pressing fingers changed [s].
        since: (5,) time for which each finger has pressed [s].
        place: (2,) where the camera has seen the tip so far, less where the filter has it [m]; NaN before a frame.
        g: (3,) the CUSUMs: net, grip, seen.
        look: Whether a jerk of the forces is in doubt.
        age: Time since the start [s].
    """

    x: Array
    P: Array
    level: Array
    slope: Array
    slow: Array
    changed: float
    since: Array
    place: Array
    g: Array
    look: LookState
    age: float


@dataclass(frozen=True, slots=True)
class TipSlip:
    """Parameters of the tests.

    Attributes:
        direction_error: Bound of the readings' error in direction [rad].
        alarm_period: Mean time between false alarms that the threshold is made for [s]: thirty times the 100 rounds
            wanted, for the tails of real innovations are heavier than a Gaussian's.
        inflation: How much larger innovations are in a slip than without: 4, found by trial, 3 to 6 do equally well.
        noise: White noise of a reading, an axis [N].
        memory: Time in which an error of a reading forgets itself [s].
        force_walk: What the tip's force may change by in a tick without slip [N]: found by trial, what fingers that
            touch and slide pass this on.
        torque_walk: The same of the torque about the tip [N.m]: what .06 N at the handle's height make.
        turning: What the tip's force may change by in a tick while fingers touch or let go, over their force times the
            readings' error in direction, which is another one as soon as they slide: found by trial; .3 leaves two
            more false alarms in 22 recorded runs, .6 misses one more of 43 slips.
        stir: How much more forces may change by while fingers have just touched or let go: found by trial, 2 to 4 do.
        jump_error: Error that a jump of a squeeze brings with it, over the jump, beside what its direction error
            brings: .03 + sigma / 4, found by trial: a finger that slides turns its force, too.
        height: Of the contacts above the tip [m].
        ripple: Standard deviation of a held finger's force about its trend, at the usual pace [N]: where squeezes begin
            or end to ramp they bend by .25 N in a tick; a tip that slips moves them by newtons.
        firm: Force below which a finger does not hold firm [N]: a third of the lightest squeeze.
        letting_go: Share of its mean over `slow_time` below which a force tells that the finger lets go: a squeeze
            taken off in .2 s falls there in 40 ms, long before it slides; noise and fades of the load stay above.
        slow_time: Time constant of that mean [s].
        follow: Gains of the trend's level and slope: it follows a squeeze that begins to ramp within three ticks.
        quiet: Time for which a finger that touches or lets go shakes the tool [s], and until
            which one that has landed is not firm: found by trial; .04 raises false
            alarms.
        press: Reading above which a finger presses [N]: 7 sigma of its noise.
        start: Time until the grip has been built up [s].
        jump: Share of a new frame in the place seen so far: a memory of 20 frames.
        haste: By how much faster than usual fingers come and go: forces change by as much more in a tick.
        look: A second look at jerks of the forces, for which the blade's play may be the reason.
    """

    direction_error: float = np.deg2rad(30.0)
    alarm_period: float = 10800.0
    inflation: float = 4.0
    noise: float = 0.035
    memory: float = 3.0
    force_walk: float = 0.12
    torque_walk: float = 0.008
    turning: float = 0.5
    stir: float = 3.0
    jump_error: float = 0.03
    height: float = 0.125
    ripple: float = 0.3
    firm: float = 1.5
    letting_go: float = 0.87
    slow_time: float = 0.12
    follow: tuple[float, float] = (0.6, 0.2)
    quiet: float = 0.06
    press: float = 0.25
    start: float = 0.6
    jump: float = 0.05
    haste: float = 1.0
    look: SecondLook = field(default_factory=SecondLook)

    def init(self) -> SlipState:
        """Nothing pressed, nothing seen."""
        x, P = np.zeros((NET, 1 + K)), np.zeros((NET, 1 + K, 1 + K))
        P[:, BIASED, BIASED] = self._sigma**2 * np.eye(K)
        P[:3, 0, 0], P[3:, 0, 0] = 25.0, 1.0
        still, none = np.zeros((K, 3)), np.zeros(K)
        return SlipState(x, P, still, still, none, 0.0, none, np.full(2, np.nan), np.zeros(3), self.look.init(), 0.0)

    def update(
        self,
        state: SlipState,
        f_W: Array,
        c_W: Array,
        n_W: Array,
        p_WT: Array,
        axis: Array,
        turned: float,
        seen: tuple[Array, Array] | None,
        moved: float,
        dt: float,
    ) -> tuple[SlipState, float]:
        """Take in one tick.

        Args:
            state: Of the last tick.
            f_W: (5, 3) forces of the fingertips on the tool as read, not low-passed, in W [N].
            c_W: (5, 3) contact points, in W [m].
            n_W: (5, 3) the handle's outward unit normals there, in W.
            p_WT: (3,) tip position, in W [m].
            axis: (3,) the tool's axis in W.
            turned: By what the tool has turned about it since the last tick [rad].
            seen: If a frame came: (2,) where it has the tip less where the filter has it, in W [m], and the (2, 2)
                covariance of that.
            moved: Log-likelihood ratio of a slip by the fingers' motion.
            dt: Time since the last tick [s].

        Returns:
            The new state, and the signal: the evidence over the threshold, so that 1 is an alarm.
        """
        now = pressed(
            state.level, state.slow, state.since, f_W, self.press, self.firm, self.letting_go, self.quiet, dt
        )  # fmt: skip
        changed = state.changed + dt if now.same else 0.0
        stir = self.stir if changed < self.quiet else 1.0
        x, P, net = self._net(state, now, c_W - p_WT, n_W, stir, dt)
        ripple = hypot(self.haste * self.ripple, now.loose)
        level, slope, grip = held_force(state.level, state.slope, now.f_W, now.firm, ripple, *self.follow)
        place, innovation = self._seen(state, seen)
        age = state.age + dt
        gains = (
            self._ratio(net, NET),
            self._ratio(grip, 3 * int(now.firm.sum())) if now.firm.sum() >= 2 else -inf,
            0.0 if innovation is None else self._ratio(innovation, 2),
        )
        begun = age > self.start
        g = np.array([max(before + gain, 0.0) * begun for before, gain in zip(state.g.tolist(), gains, strict=True)])
        look = self.look.felt(state.look, now.f_W, c_W - p_WT, axis, turned, dt)
        forces, eye, h = float(max(g[0], g[1])), float(g[2]), self.threshold(dt)
        look, evidence = self.look.judged(look, forces, eye, max(moved, 0.0) * begun, h, dt)
        if look.excused > 0.0:
            g[:2] = 0.0
        slow = state.slow + dt / (self.slow_time + dt) * (now.size - state.slow)
        return SlipState(x, P, level, slope, slow, changed, now.since, place, g, look, age), evidence / h

    @property
    def _sigma(self) -> float:
        """Standard deviation of a reading's error across its force, over the force [rad]."""
        return DIRECTION_SHARE * self.direction_error

    def threshold(self, dt: float) -> float:
        """h: forces, camera and motion share the alarms, and each has one tick's chance every dt."""
        return log(3.0 * self.alarm_period / dt)

    def _ratio(self, squared: float, size: int) -> float:
        """Likelihood ratio of a squared normalised innovation of `size` entries."""
        return 0.5 * (1.0 - self.inflation**-2) * squared - size * log(self.inflation)

    def _net(
        self, state: SlipState, now: Press, arm: Array, n_W: Array, stir: float, dt: float
    ) -> tuple[Array, Array, float]:
        """Five Kalman filters at once: load and reading errors; returns the sum of squared normalised innovations."""
        jump, turned = (self.jump_error + 0.25 * self._sigma) ** 2, self.turning * self._sigma * now.loose
        force_walk = hypot(stir * self.haste * self.force_walk, turned)
        torque_walk = hypot(stir * self.haste * self.torque_walk, self.height * turned)
        return net_force(
            state.x, state.P, now.f_W, arm, n_W, state.level, self.height, jump, self._sigma, self.noise,
            exp(-dt / self.memory), force_walk, torque_walk,
        )  # fmt: skip

    def _seen(self, state: SlipState, seen: tuple[Array, Array] | None) -> tuple[Array, float | None]:
        """Where the camera has the tip; the squared normalised change against the frames before, if a frame came."""
        if seen is None:
            return state.place, None
        offset, P = seen
        if np.isnan(state.place[0]):
            return offset, None
        z = offset - state.place
        return state.place + self.jump * z, float(z @ np.linalg.solve((1.0 + self.jump) * P, z))
