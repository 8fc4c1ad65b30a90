from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import thread_time

import numpy as np
import pytest
from rigs.estimation import DT, RADIUS, ROBOT, Blurred, Noise, Truth, blur, gait

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.estimate.estimator import NO_CONTACT, Reference, ToolEstimator
from turnscrew.estimate.estimator_state import EstimatorState
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.sense.encoders import Encoders, finger_offset_sigma, reading_sigma
from turnscrew.sense.vision import NoisyTruthVision
from turnscrew.signals import Estimate, Measurement

TOOL = ToolInertia(0.08, np.array([0.0, 0.0, 0.13]), np.diag([1e-4, 1e-4, 1.3e-5]))
CLEAN = Noise(
    encoders=Encoders(noise=reading_sigma(0.0, 0.0), offset_sigma=finger_offset_sigma(0.0)),
    vision=NoisyTruthVision(position_noise=0.0, rotation_noise=0.0),
    calibration=(0.0, 0.0, 0.0),
    radius=0.0,
)


@dataclass(frozen=True)
class Tick:
    truth: Truth
    frame: bool
    state: EstimatorState
    estimate: Estimate


def estimator(blurred: Blurred) -> ToolEstimator:
    return ToolEstimator(ROBOT.fingertips, blurred.handle, blurred.p_WS, TipWrench(TOOL, 0.0005))


def run(
    truths: tuple[Truth, ...],
    blurred: Blurred,
    seed: int = 0,
    block: ToolEstimator | None = None,
    start: tuple[np.ndarray, np.ndarray] | None = None,
) -> list[Tick]:
    block = block or estimator(blurred)
    R0 = exp_so3(np.random.default_rng(1000 + seed).normal(size=3) * np.deg2rad(2.0)) @ truths[0].R_WT
    state = block.init(blurred.measurements[0], *(start or (blurred.p_WS, R0)))
    ticks = []
    for truth, measurement, motion in zip(truths[1:], blurred.measurements[1:], blurred.sent[1:], strict=True):
        state, estimate = block.update(state, measurement, motion, DT)
        ticks.append(Tick(truth, measurement.vision is not None, state, estimate))
    return ticks


def error(truth: Truth, p: np.ndarray, R: np.ndarray) -> tuple[float, float, float]:
    """Tip [mm], tilt and yaw [deg]."""
    turn = log_so3(truth.R_WT @ R.T)
    z = truth.R_WT[:, 2]
    yaw = float(z @ turn)
    return (
        float(np.linalg.norm(p - truth.p_WT)) * 1e3,
        float(np.degrees(np.linalg.norm(turn - yaw * z))),
        float(np.degrees(yaw)),
    )


def rms(errors: list[tuple[float, float, float]]) -> np.ndarray:
    return np.sqrt((np.array(errors) ** 2).mean(axis=0))


@pytest.fixture(scope="module")
def runs() -> list[tuple[Blurred, list[Tick]]]:
    truths = gait(2)
    return [(blurred := blur(truths, seed), run(truths, blurred, seed)) for seed in range(3)]


def test_errors_over_two_rounds_of_gait(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    ticks = [tick for _, run_ in runs for tick in run_ if tick.truth.time > 1.0]
    filtered = rms([error(t.truth, t.estimate.p_WT, t.estimate.R_WT) for t in ticks])
    frames = [t for t in ticks if t.frame]
    raw = rms([error(t.truth, t.estimate.p_WT_seen, t.estimate.R_WT_seen) for t in frames])
    refined = rms([error(t.truth, t.estimate.p_WT_refined, t.estimate.R_WT_refined) for t in frames])
    # 3 mm and 2 deg per axis: sqrt(3) x 3, sqrt(2) x 2, 2; 640 frames know them to 3 %
    np.testing.assert_allclose(raw, [5.2, 2.83, 2.0], rtol=0.12)
    # measured over six seeds: .46 mm, .31 deg, .45 deg; a half more for the seeds at hand
    assert np.all(filtered < [0.7, 0.47, 0.7])
    assert np.all(refined < [0.7, 0.47, 0.7])


def test_covariance_is_consistent_along_the_gait(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    nees = []
    for _, run_ in runs:
        for t in run_:
            if t.frame and t.truth.time > 1.0:
                f = t.state.filter
                x = np.concatenate([log_so3(t.truth.R_WT @ f.R_WT.T), t.truth.p_WT - f.p_WT])
                nees.append(x @ np.linalg.solve(f.P[:6, :6], x))
    # six on average if the noise were white; errors last for seconds, so three runs hold some ten independent samples:
    # deviation sqrt(12 / 10) = 1.1, of which four
    assert 2.0 < np.mean(nees) < 10.5


def test_constants_are_learned(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    before = np.sqrt(np.mean([blurred.b_W**2 for blurred, _ in runs]))
    after = np.sqrt(np.mean([(run_[-1].state.filter.b_W - blurred.b_W) ** 2 for blurred, run_ in runs]))
    # 240 frames leave 3 mm / sqrt(240) = .2 mm of the screw's place per axis; twice that for three runs
    assert after < 0.4e-3 < before
    for blurred, run_ in runs:
        np.testing.assert_allclose(run_[-1].estimate.radius, blurred.handle.radius + blurred.radius_error, atol=8e-4)


def test_refinement_answers_every_frame_and_says_how(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    frames = [t for _, run_ in runs for t in run_ if t.frame]
    statuses = [t.estimate.status for t in frames]
    assert set(statuses) <= {"warm", "cold", "relaxed", "predicted", NO_CONTACT}
    # measured: 1278 of 1278 within the boxes once the constants are learned; the first second may need wider ones
    assert sum(status in ("warm", "cold") for status in statuses) >= 0.98 * len(statuses)
    for t in frames:
        if t.state.refined is not None:
            assert t.state.refined.pose.solver_statuses
            if t.estimate.status in ("warm", "cold"):
                # boxes of .5 mm inside the ball: |.|_j <= .29 mm, and the solver's .1 micrometre
                assert t.state.refined.pose.residuals.contact.max() < 0.0005 / np.sqrt(3) + 2e-7


def test_touch_flags_follow_the_forces(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    wrong = total = 0
    for _, run_ in runs:
        for t in run_:
            force = np.linalg.norm(t.truth.f_F, axis=1)
            clear = (force == 0.0) | (force > 1.0)
            wrong += int((t.estimate.touching != (force > 0.0))[clear].sum())
            total += int(clear.sum())
    # delays of some 22 ms at each of eight changes a round, for four fingers
    assert wrong < 0.02 * total


def test_screw_angle_follows_the_turning(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    for _, run_ in runs:
        # 2 x 45 deg of tool, less half of 6 deg of play; yaw is known to .5 deg at both ends
        assert abs(np.degrees(run_[-1].estimate.theta) - 87.0) < 2.5


def test_latency_leaves_no_lag_in_a_roll() -> None:
    truths = gait(1)
    ticks = run(truths, blur(truths, 0, CLEAN))
    lag = [error(t.truth, t.estimate.p_WT_seen, t.estimate.R_WT_seen)[2] for t in ticks if t.frame
           and t.truth.phase == "roll"]  # fmt: skip
    # 45 deg in 1 s are 1.5 deg on average in 33 ms, uncompensated, 2.2 at the fastest; the odometry since errs by
    # 1 % of that and a tick of 5 ms may lie between exposure and truth (.34 deg at the fastest)
    assert len(lag) >= 28
    assert np.abs(np.mean(lag)) < 0.15
    assert np.max(np.abs(lag)) < 0.4


def test_without_noise_the_estimate_is_the_truth_to_the_depth_of_penetration() -> None:
    truths = gait(1)
    ticks = [t for t in run(truths, blur(truths, 0, CLEAN)) if t.truth.time > 1.0]
    errors = np.abs([error(t.truth, t.estimate.p_WT, t.estimate.R_WT) for t in ticks]).max(axis=0)
    # .08 mm of penetration over 130 mm is .04 deg; the gauges' 30 deg and 25 % touch the weights of odometry alone
    assert np.all(errors < [0.15, 0.12, 0.5])


def test_camera_falls_silent() -> None:
    truths = gait(1)
    blurred = blur(truths, 2)
    silent = tuple(replace(m, vision=None) if m.time > 1.0 else m for m in blurred.measurements)
    ticks = run(truths, replace(blurred, measurements=silent))
    last = error(truths[-1], ticks[-1].estimate.p_WT, ticks[-1].estimate.R_WT)
    # 3.3 s on odometry and contacts: 45 deg of roll with 3 % of scale error, after a yaw known to .7 deg
    assert last[0] < 2.0
    assert last[1] < 1.5
    assert abs(last[2]) < 4.0
    assert ticks[-1].state.since_correction <= 2.0 / 30.0 + DT


def test_lost_tool_is_found_again_by_the_camera() -> None:
    truths = gait(1)
    blurred = blur(truths, 3)
    wrong = exp_so3(np.array([0.5, 0.0, 0.9])) @ truths[0].R_WT
    ticks = run(truths[:300], replace(blurred, measurements=blurred.measurements[:300], sent=blurred.sent[:300]),
                start=(blurred.p_WS + np.array([0.05, 0, 0]), wrong))  # fmt: skip
    assert any(t.state.correction is not None and t.state.correction.restarted for t in ticks)
    tip, tilt, yaw = error(ticks[-1].truth, ticks[-1].estimate.p_WT, ticks[-1].estimate.R_WT)
    # a second of frames after the restart: 5.2 mm and 2.8 deg of one frame over sqrt(30), and the screw's offset
    assert tip < 4.0
    assert tilt < 2.5
    assert abs(yaw) < 2.5


def test_camera_as_the_reference_is_the_papers_own_and_worse() -> None:
    truths = gait(1)
    blurred = blur(truths, 1)
    block = replace(estimator(blurred), reference=Reference.CAMERA)
    ticks = [t for t in run(truths, blurred, block=block) if t.frame and t.truth.time > 1.0]
    refined = rms([error(t.truth, t.estimate.p_WT_refined, t.estimate.R_WT_refined) for t in ticks])
    raw = rms([error(t.truth, t.estimate.p_WT_seen, t.estimate.R_WT_seen) for t in ticks])
    # measured .6 mm / .5 deg / 1.4 deg against 5.2 / 2.9 / 2.1: contacts fix position and tilt; yaw only through (5)
    assert np.all(refined < raw * [0.3, 0.4, 0.9])
    assert np.mean([t.estimate.status in ("warm", "cold") for t in ticks]) > 0.9


def test_radius_and_joint_angles_are_handed_on_corrected(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    blurred, ticks = runs[0]
    last = ticks[-1]
    np.testing.assert_allclose(last.estimate.radius, RADIUS, atol=8e-4)
    offset = last.state.joints.q - last.estimate.q
    np.testing.assert_allclose(offset, last.state.filter.joint_offset(), atol=1e-12)
    # smoothed readings: they miss the last by the noise of one, .05 deg in 28 joints
    np.testing.assert_allclose(last.state.joints.q, blurred.measurements[-1].q, atol=np.deg2rad(0.25))


def test_estimation_keeps_its_budget(runs: list[tuple[Blurred, list[Tick]]]) -> None:
    truths = gait(1)
    blurred = blur(truths, 0)
    block = estimator(blurred)
    state = block.init(blurred.measurements[0], blurred.p_WS, truths[0].R_WT)
    began = thread_time()
    for measurement, motion in zip(blurred.measurements[1:], blurred.sent[1:], strict=True):
        state, _ = block.update(state, measurement, motion, DT)
    spent = thread_time() - began
    # measured 200 ms of processor a simulated second on a shared core; a real-time factor of 1.5 leaves 350
    assert spent / truths[-1].time < 0.7


def altered(blurred: Blurred, start: float, end: float, change: Callable[[Measurement], Measurement]) -> Blurred:
    """The same run with its measurements changed for a while."""
    measurements = tuple(change(m) if start < m.time < end else m for m in blurred.measurements)
    return replace(blurred, measurements=measurements)


def flipped(measurement: Measurement) -> Measurement:
    """The frame leaning by 30 deg about a horizontal axis, as markers do that are taken for their mirror image."""
    frame = measurement.vision
    if frame is None:
        return measurement
    return replace(
        measurement, vision=replace(frame, R_WT=exp_so3(np.array([np.deg2rad(30.0), 0.0, 0.0])) @ frame.R_WT)
    )


@pytest.mark.parametrize("seed", [0, 5])
def test_two_dark_seconds_are_bridged_by_contacts_and_odometry(seed: int) -> None:
    truths = gait(2)
    dark = altered(blur(truths, seed), 4.0, 6.0, lambda m: replace(m, vision=None))
    ticks = run(truths, dark, seed)
    errors = np.abs([error(t.truth, t.estimate.p_WT, t.estimate.R_WT) for t in ticks if 4.0 < t.truth.time < 6.5])
    # what is asked for; measured over six seeds: .66 mm / .41 deg / 1.5 deg at most
    assert np.all(errors.max(axis=0)[:2] < 1.0)
    assert errors.max(axis=0)[2] < 2.0
    assert all(t.estimate.frame == "none" for t in ticks if 4.05 < t.truth.time < 6.0)
    assert any(t.estimate.frame == "taken" for t in ticks if 6.0 < t.truth.time < 6.2)


@pytest.mark.parametrize("seed", [1])
def test_a_marker_pose_that_flips_for_five_frames_is_refused(seed: int) -> None:
    truths = gait(1)
    blurred = blur(truths, seed)
    stamps = [m.time for m in blurred.measurements if m.vision is not None and m.time > 2.0][:6]
    ticks = run(truths, altered(blurred, stamps[0] - 1e-6, stamps[5] - 1e-6, flipped), seed)
    during = [t for t in ticks if stamps[0] <= t.truth.time < stamps[5] and t.frame]
    assert [t.estimate.frame for t in during] == ["refused"] * 5
    after = [t for t in ticks if stamps[0] <= t.truth.time]
    assert sum(t.estimate.frame == "refused" for t in after) == 5
    errors = np.abs([error(t.truth, t.estimate.p_WT, t.estimate.R_WT) for t in after])
    # as without them: twice the rms of .5 mm and .3 deg that the gait leaves
    assert np.all(errors.max(axis=0)[:2] < [1.5, 1.0])


@pytest.mark.parametrize("name", ["q", "f_F"])
def test_readings_that_are_no_numbers_never_enter_the_state(name: str) -> None:
    truths = gait(1)
    blurred, rng = blur(truths, 1), np.random.default_rng(7)

    def spoil(measurement: Measurement) -> Measurement:
        # every tenth reading loses one joint or finger, and every third frame is no pose
        reading = getattr(measurement, name).copy()
        if rng.random() < 0.1:
            reading[rng.integers(len(reading))] = np.nan
        frame = measurement.vision
        if frame is not None and rng.random() < 0.3:
            frame = replace(frame, p_WT=np.array([np.nan, 0.0, 0.0]))
        return replace(measurement, vision=frame, **{name: reading})

    ticks = run(truths, altered(blurred, 0.5, 9.0, spoil), 1)
    assert all(np.isfinite(t.state.filter.P).all() and np.isfinite(t.estimate.q).all() for t in ticks)
    errors = rms([error(t.truth, t.estimate.p_WT, t.estimate.R_WT) for t in ticks if t.truth.time > 1.0])
    # a joint held for one tick of 5 ms at 1 rad/s is .3 deg off: no worse than twice the gait's own errors
    assert np.all(errors < [1.4, 0.9, 1.4])
