"""What the solvers are compared on: frames of the pose problem, drawn at random or as a recorded run posed them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from numpy.random import Generator

from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.pose_problem import PoseFrame, PoseProblem, pose_problem
from turnscrew.estimate.pose_refine import Guess, PoseRefiner, RefinedPose
from turnscrew.estimate.reference import Reference
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.profiles import Cylinder
from turnscrew.study.recording import Recording
from turnscrew.study.solvers.random_corrections import POSITION, ROTATION
from turnscrew.study.solvers.random_grasps import TIP, drawn_grasp

HANDLE = Cylinder(0.018, 0.08, 0.2)
"""What random grasps hold: the default handle."""


@dataclass(frozen=True)
class Posed:
    """A frame as it is put to a solver.

    Attributes:
        problem: For its contacts.
        frame: Data.
        x0: (7 + 4k,) start.
        goes_on: Whether the same fingers held in the frame before, so that its multipliers are a warm start.
    """

    problem: PoseProblem
    frame: PoseFrame
    x0: Array
    goes_on: bool = False


def random_frames(k: int, n: int, rng: Generator) -> Iterator[Posed]:
    """Frames of n grasps by k fingertips, seen and begun with `POSITION` and `ROTATION` of noise an axis, all cold."""
    problem = pose_problem(HANDLE, TIP, k)
    for _ in range(n):
        grasp = drawn_grasp(HANDLE, k, rng, ROTATION)
        guess = replace(grasp.guess(), p_WT=grasp.p_WT + rng.normal(0.0, POSITION, 3))
        yield _posed(problem, grasp.frame, guess)


@dataclass(frozen=True)
class Replay:
    """A run estimated again, for what was asked on its way.

    Attributes:
        frames: Of the pose problem, in order.
        corrections: State after each of the filter's corrections, and the row of its tick.
    """

    frames: list[Posed]
    corrections: list[tuple[EstimatorState, int]]


def replayed(recording: Recording, reference: Reference) -> Replay:
    """Estimates a run as its loop did, but for the rbar of its frames.

    The filter does not hear what the pose problem's solver says, so it goes its way with any of them.
    """
    listener = _Listener()
    estimator = replace(recording.estimator, refiner=listener, reference=reference)
    state = estimator.init(recording.measurements[0], recording.p_WT, recording.R_WT)
    frames: list[Posed] = []
    corrections: list[tuple[EstimatorState, int]] = []
    for row, (measurement, motion) in enumerate(zip(recording.measurements, recording.sent, strict=True)):
        last, (state, _) = state, estimator.update(state, measurement, motion, recording.dt)
        if state.correction is not last.correction:
            corrections.append((state, row))
        if len(listener.heard) > len(frames):
            frames.append(_posed(*listener.heard[-1], goes_on=_rows(state) == _rows(last)))
    return Replay(frames, corrections)


def _posed(problem: PoseProblem, frame: PoseFrame, guess: Guess, *, goes_on: bool = False) -> Posed:
    x0 = problem.point(frame, guess.p_WT, guess.R_WT, guess.xi, guess.tip_uv)
    return Posed(problem, frame, x0, goes_on)


def _rows(state: EstimatorState) -> tuple[int, ...]:
    """Fingers that the last frame held."""
    return () if state.refined is None else state.refined.rows


@dataclass(frozen=True)
class _Listener(PoseRefiner):
    """A refiner that keeps what it is asked."""

    heard: list[tuple[PoseProblem, PoseFrame, Guess]] = field(default_factory=list)

    def solve(self, problem: PoseProblem, frame: PoseFrame, guess: Guess) -> RefinedPose:
        self.heard.append((problem, frame, guess))
        return super().solve(problem, frame, guess)
