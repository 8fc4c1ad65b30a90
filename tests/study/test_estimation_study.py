"""A recorded run can be estimated again: to the bit as the loop did, or with other sensors and other methods."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from turnscrew.errors import ScenarioError
from turnscrew.study.estimation.figures_of_merit import pose_figures, spread
from turnscrew.study.estimation.replay import run
from turnscrew.study.estimation.study import RESULTS, Case, cases, chosen, parts, work, write_results
from turnscrew.study.parts import finish
from turnscrew.study.recording import read
from turnscrew.task.fasten import fasten
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import column, read_signals


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of .8 s: long enough for twenty frames and for the first contacts."""
    out = tmp_path_factory.mktemp("runs") / "short"
    fasten(load(None, ["goal.time_limit=0.8"], 4), out)
    return out


def test_run_is_estimated_again_to_the_last_bit(folder: Path) -> None:
    recording = read(folder)
    state = recording.estimator.init(recording.measurements[0], recording.p_WT, recording.R_WT)
    again = []
    for measurement, motion in zip(recording.measurements, recording.sent, strict=True):
        state, estimate = recording.estimator.update(state, measurement, motion, recording.dt)
        again.append(estimate.p_WT)
    np.testing.assert_array_equal(np.array(again), column(read_signals(folder), "estimate.p_WT", 3))


def test_run_by_torques_is_estimated_again_to_the_last_bit(tmp_path: Path) -> None:
    fasten(load(None, ["goal.time_limit=0.5", "robot.actuation=torque"], 4), tmp_path)
    recording = read(tmp_path)
    state = recording.estimator.init(recording.measurements[0], recording.p_WT, recording.R_WT)
    again = []
    for measurement, motion in zip(recording.measurements, recording.sent, strict=True):
        state, estimate = recording.estimator.update(state, measurement, motion, recording.dt)
        again.append(estimate.p_WT)
    np.testing.assert_array_equal(np.array(again), column(read_signals(tmp_path), "estimate.p_WT", 3))


def test_other_sensors_measure_the_same_run(folder: Path) -> None:
    as_it_was, other = read(folder), read(folder, ["vision.position_noise=0.0", "vision.rotation_noise=0.0"])
    np.testing.assert_array_equal(as_it_was.truth.p_WT, other.truth.p_WT)
    (noisy,), _ = run(as_it_was, ("camera",))
    (exact,), _ = run(other, ("camera",))
    # the tip moves by less than .1 mm between two ticks
    assert exact.error[:, 0].max() < 1e-4
    # 3 mm per axis: twenty frames of 5.2 mm rms
    assert 2e-3 < noisy.error[:, 0].mean() < 8e-3


def test_sensors_that_stay_read_the_same_to_the_last_bit(folder: Path) -> None:
    as_it_was, other = read(folder), read(folder, ["vision.position_noise=0.001"])
    for before, after in zip(as_it_was.measurements, other.measurements, strict=True):
        np.testing.assert_array_equal(before.q, after.q)
        np.testing.assert_array_equal(before.f_F, after.f_F)


def test_gauges_read_what_they_would_have_read(tmp_path: Path) -> None:
    fasten(load(None, ["goal.time_limit=0.5", "force.source=strain"], 4), tmp_path)
    as_it_was, other = read(tmp_path), read(tmp_path, ["vision.position_noise=0.001"])
    for before, after in zip(as_it_was.measurements, other.measurements, strict=True):
        np.testing.assert_array_equal(before.tau, after.tau)


def test_variants_differ_as_they_should(folder: Path) -> None:
    traces, wrench = run(read(folder), ("camera", "(1)", "MAP"))
    camera, tip, filtered = (pose_figures(trace)["held"] for trace in traces)
    # twenty frames averaged beat one by far; the screw's place alone says nothing of tilt
    assert filtered["tilt_deg"]["rms"] < 0.5 * camera["tilt_deg"]["rms"]
    assert tip["tilt_deg"]["rms"] > 0.5 * camera["tilt_deg"]["rms"]
    assert "nees" in pose_figures(traces[2])
    assert len(wrench.F_s) == len(wrench.time)


def test_study_takes_up_what_an_earlier_one_left(folder: Path, tmp_path: Path) -> None:
    wanted = [Case("as recorded", ()), Case("sharp", ("vision.position_noise=0.001",), "noise", 1.0)]
    todo = parts([folder], wanted, ("camera",), tmp_path)
    first = dict(finish(todo[:1], work, jobs=1))
    assert list(first) == todo[:1]
    worked = []
    done = [figures for _, figures in finish(todo, lambda part: worked.append(part) or work(part), jobs=1)]
    assert worked == todo[1:]
    assert json.loads(todo[0].file.read_text()) == next(iter(first.values())) == done[0]
    assert write_results(done, tmp_path) == tmp_path / RESULTS


def test_unknown_variant_is_told_with_those_there_are() -> None:
    with pytest.raises(ScenarioError, match=r"--variant kalman: unknown; there are camera, \(1\)"):
        chosen(["kalman"])


def test_sweeps_add_to_what_is_overridden() -> None:
    found = cases(["force.noise=0.05"], noise=True, distance=True)
    assert found[0].label == "force.noise=0.05"
    assert {case.sweep for case in found} == {"", "noise", "distance"}
    assert all(case.overrides[0] == "force.noise=0.05" for case in found)


def test_spread_of_known_values() -> None:
    found = spread(np.array([-3.0, 4.0]))
    assert found["rms"] == pytest.approx(np.sqrt(12.5))
    assert found["max"] == 4.0
