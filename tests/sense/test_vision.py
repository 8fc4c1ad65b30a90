from __future__ import annotations

import numpy as np
from rigs.plants import Still

from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.sense.vision import NoisyTruthVision
from turnscrew.signals import Vision

DT = 0.002


def frames(camera: NoisyTruthVision, seconds: float, seed: int = 0) -> list[tuple[float, Vision]]:
    """Frames with the times of their arrival, of a tool that turns by 1 rad/s and sinks by 1 mm/s."""
    state = camera.init(np.random.default_rng(seed))
    out = []
    for tick in range(round(seconds / DT)):
        time = DT * tick
        p, R = np.array([0.0, 0.0, -0.001 * time]), exp_so3(np.array([0.0, 0.0, -time]))
        state, frame, _ = camera.update(state, Still(time, p_WT=p, R_WT=R))
        if frame is not None:
            out.append((time, frame))
    return out


def test_thirty_frames_a_second_arrive_a_frame_after_their_stamp() -> None:
    got = frames(NoisyTruthVision(), 10.0)
    # the first frame's phase and the last's latency may cost one each
    assert 298 <= len(got) <= 300
    delays = np.array([time - frame.stamp for time, frame in got])
    assert delays.min() >= 1 / 30 - 1e-6
    # arrival is seen at the next tick
    assert delays.max() <= 1 / 30 + DT
    stamps = np.array([frame.stamp for _, frame in got])
    # exposure is at the next tick too
    np.testing.assert_allclose(np.diff(stamps), 1 / 30, atol=DT)


def test_frame_shows_the_pose_at_its_stamp_with_the_noise_asked_for() -> None:
    p_error, r_error = [], []
    for _, frame in frames(NoisyTruthVision(), 60.0):
        truth = exp_so3(np.array([0.0, 0.0, -frame.stamp]))
        p_error.append(frame.p_WT - np.array([0.0, 0.0, -0.001 * frame.stamp]))
        r_error.append(log_so3(frame.R_WT @ truth.T))
    # 1800 frames x 3 axes know a deviation to 1 %, a mean to 1.4 % of it: four of these
    np.testing.assert_allclose(np.std(p_error), 0.003, rtol=0.04)
    np.testing.assert_allclose(np.std(r_error), np.deg2rad(2.0), rtol=0.04)
    assert np.abs(np.mean(p_error, axis=0)).max() < 0.003 * 0.1
    assert np.abs(np.mean(r_error, axis=0)).max() < np.deg2rad(2.0) * 0.1


def test_dropped_frames_never_arrive() -> None:
    share = len(frames(NoisyTruthVision(dropout=0.3), 60.0)) / 1800
    # binomial deviation of the share is 1.1 %: four of these
    assert abs(share - 0.7) < 0.045
    assert frames(NoisyTruthVision(dropout=1.0), 2.0) == []


def test_same_seed_gives_the_same_frames() -> None:
    a, b = frames(NoisyTruthVision(), 1.0, seed=3), frames(NoisyTruthVision(), 1.0, seed=3)
    assert all(np.array_equal(x.R_WT, y.R_WT) and x.stamp == y.stamp for (_, x), (_, y) in zip(a, b, strict=True))
