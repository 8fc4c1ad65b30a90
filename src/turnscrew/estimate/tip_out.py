"""Has the tip left its drive?  What the camera sees of the tool over several frames, and what the fingers carry.

While the tip is taken to be in its drive the filter holds to that, and to rolling about a tip at rest: a tip that has
left the drive does not show in its pose.  It shows in the camera's frames, which know nothing of the drive: they see
tip and lean elsewhere, all of them alike.  One frame errs by 3 to 5 mm, a tip that stands beside the screw is 5 to
40 mm away; so frames are summed up.

With u_i a frame's whitened deviation from the filter, the sum over the last n frames has, without a loss, the
covariance n + n^2 r, r the share of what does not average out (lasting errors of the camera, the filter's own doubt).
The statistic |sum u_i|^2 / (n + n^2 r) is asked for all n up to `frames`: a large step shows in a few, a small one in
many.

The fingers feel a loss at once: what pressed on the tip is gone, and the axial force as estimated, which control holds
near what is wanted while the tip stands on something, falls below nothing.  That alone is no proof, for readings err by
as much as what is pressed with; but then fewer frames are enough.

A tip that is knocked onto the screw's head stays pressed, two or three millimetres beside its slot.  The filter takes
up by and by what the frames then say, as errors of the camera, and no sum of a few of them is large.  But the slip has
been named, which says when it would have begun: all frames since then are summed up.

Paper: no counterpart; (1) takes the tip to be where the screw is.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from turnscrew.estimate.filter_state import THETA, TIP, FilterState
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.rotations import log_so3
from turnscrew.values import changed

if TYPE_CHECKING:
    from turnscrew.estimate.trail import Seen

SIZE = 5
"""Of a deviation: three of the tip, two of the lean.  Of the yaw a tip tells nothing."""


@dataclass(frozen=True, slots=True)
class OutState:
    """What is remembered.

    Attributes:
        frames: The last frames' whitened deviations, (5,) each, oldest first, and r of each as a sixth entry.
        largest: Of the statistics of their sums.
        unloaded: Time since the tip was last felt to carry nothing [s].
        load: Axial force of the screw on the tip as estimated [N].
        age: Time since the tip was put into its drive [s].
        slipped: Time since the tip has slipped, which may have been its loss [s],
        total: (6,) sum of the frames since then,
        count: their number,
        since: and its statistic.
    """

    frames: tuple[Array, ...] = ()
    largest: float = 0.0
    unloaded: float = np.inf
    load: float = 0.0
    age: float = 0.0
    slipped: float = np.inf
    total: Array = field(default_factory=lambda: np.zeros(SIZE + 1))
    count: int = 0
    since: float = 0.0


@dataclass(frozen=True, slots=True)
class TipOut:
    """Parameters of the test.

    Attributes:
        threshold: Of the statistic, without a loss chi-squared with 5 degrees of freedom: 40 is exceeded in 1.5e-7,
            which in an hour of 30 frames a second, with some four sums of `frames` that are as good as independent,
            happens with a probability of .06.
        suspected: The same while the tip is felt, or was lately, to carry nothing, and of the frames since it has
            slipped: exceeded in 3e-3,
        lately: so long for a tip that carries nothing [s]: thirty frames, and the camera's lateness,
        remembered: so long for one that has slipped [s]: 150 frames, of which 80 to 100 tell of 2.5 mm.
        doubt: Signal up to which the tip is taken to be in its drive: mostly it stays below while it is.
        loaded: Load above which that is so [N]: in undisturbed runs it stays above half of that, and it is gone 70 ms
            after the tip has left its drive, in which fast fingers turn the tool by 15 deg.
        least: Axial force below which it carries nothing [N]: in 11 undisturbed runs of five rounds (seeds 7820 to
            7830, torques and positions, two paces) it stays above .5 N.
        begun: Time after which the force is asked [s]: until then what presses on the tip is built up.
        frames: How many frames are summed up at most: two thirds of a second.
        most: Largest size of a whitened deviation: a single frame that is wrong, as of a marker that has flipped, tells
            no more than 4 sigma, and at least three are needed, or two where the fingers agree.
        flipped: A frame that is turned by more tells nothing [rad]: a tool that has lost its drive leans by up to 17
            deg, a flipped marker by 30.
        bent: What filter and camera differ by for good, tip [m] and lean [rad]: the blade's play in the slot, what a
            shaft bends by.
    """

    threshold: float = 40.0
    suspected: float = 18.0
    lately: float = 1.1
    remembered: float = 5.0
    doubt: float = 0.3
    loaded: float = 1.0
    least: float = -0.5
    begun: float = 1.0
    frames: int = 20
    most: float = 4.0
    flipped: float = np.deg2rad(22.0)
    bent: tuple[float, float] = (0.0005, np.deg2rad(0.3))

    def init(self) -> OutState:
        """No frame yet."""
        return OutState()

    def felt(self, state: OutState, f_z: float, slip: float, dt: float) -> OutState:
        """Takes in a tick.

        Args:
            state: Of the last tick.
            f_z: Axial force of the screw on the tip as estimated [N].
            slip: How strongly the tip seems to slip: 1 is the threshold.
            dt: Since the last tick [s].
        """
        age, slipped = state.age + dt, state.slipped + dt
        unloaded = 0.0 if f_z < self.least and age > self.begun else state.unloaded + dt
        state = changed(state, unloaded=unloaded, load=f_z, age=age, slipped=slipped)
        if slip < 1.0 or slipped < self.remembered:
            return state
        return changed(state, slipped=0.0, total=np.zeros(SIZE + 1), count=0, since=0.0)

    def seen(self, state: OutState, f: FilterState, seen: Seen, common: float) -> OutState:
        """Takes in a frame.

        Args:
            state: Of the last frame.
            f: The filter before it has heard of this frame.
            seen: The frame, brought to now.
            common: Share of a frame's variance that the next ones share.
        """
        across = f.R_WT[:, :2]
        turn = log_so3(seen.pose.R_WT @ f.R_WT.T)
        if float(turn @ turn) > self.flipped**2:
            return state
        z = np.concatenate([seen.pose.p_WT - f.p_WT, across.T @ turn])
        H = np.zeros((SIZE, 6))
        H[:3, :3], H[3:, 3:] = np.eye(3), across.T
        own = np.diag(np.repeat([self.bent[0] ** 2, self.bent[1] ** 2], [3, 2]))
        own[:3, :3] += f.P[TIP, TIP]
        own[3:, 3:] += across.T @ f.P[THETA, THETA] @ across
        # a camera without noise would leave nothing to measure deviations by
        L = np.linalg.cholesky(H @ seen.P @ H.T + own)
        u = np.linalg.solve(L, z)
        doubt = np.linalg.solve(L, np.linalg.solve(L, own).T)
        lasting = common + float(np.linalg.eigvalsh(doubt)[-1])
        u *= min(self.most / max(float(np.sqrt(u @ u)), 1e-9), 1.0)
        frame = np.append(u, lasting)
        frames = (*state.frames[1 - self.frames :], frame)
        backwards, n = np.array(frames[::-1]), np.arange(1, len(frames) + 1)
        sums, total, count = np.cumsum(backwards[:, :SIZE], axis=0), state.total + frame, state.count + 1
        return changed(
            state,
            frames=frames,
            largest=float(((sums**2).sum(axis=1) / (n + n**2 * backwards[:, SIZE])).max()),
            total=total,
            count=count,
            since=float(total[:SIZE] @ total[:SIZE]) / (count + count * float(total[SIZE])),
        )

    def signal(self, state: OutState) -> float:
        """How strongly frames, forces and slips contradict a tip in its drive: 1 is the threshold."""
        signal = state.largest / (self.suspected if state.unloaded < self.lately else self.threshold)
        return max(signal, state.since / self.suspected) if state.slipped < self.remembered else signal

    def sure(self, state: OutState) -> bool:
        """Whether nothing speaks against a tip in its drive: neither frames nor its load nor a slip lately."""
        return state.load > self.loaded and state.slipped >= self.remembered and self.signal(state) < self.doubt
