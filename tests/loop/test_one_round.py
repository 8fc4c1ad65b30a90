"""The loop, closed, on a seed that nothing was tuned on: one round of rolling and gaiting under the default noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from turnscrew.plant.cell import Cell
from turnscrew.plant.log import read_log
from turnscrew.plant.replay import load_model, replay
from turnscrew.robot.joints import DRIVEN, INDEX, JOINTS
from turnscrew.robot.model import RobotModel
from turnscrew.task.fasten import fasten
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import read_signals
from turnscrew.task.summary import Progress, Summary

SEED = 777001


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Summary, Path, list[Progress]]:
    folder = tmp_path_factory.mktemp("round")
    seen: list[Progress] = []
    return fasten(load(None, ["goal.rounds=1"], SEED), folder, on_progress=seen.append), folder, seen


def test_the_round_turns_the_screw(run):
    summary, _, _ = run
    assert summary.outcome == "goal"
    assert summary.rounds == 1
    assert summary.turned_deg > 45.0
    assert summary.sim_time_s < 5.5  # a round of 4.5 s and the first grip of .6 s


def test_the_tool_stays_upright_and_in_the_drive(run):
    summary, _, _ = run
    assert summary.max_tilt_deg < 3.0
    assert summary.tip_slip_mm < 1.0
    assert summary.support_fraction > 0.99


def test_the_screw_sinks_by_its_pitch(run):
    summary, _, _ = run
    # thrust bends the helix by less than a micrometre
    assert summary.advance_mm == pytest.approx(0.7 * summary.turned_deg / 360.0, abs=2e-3)


def test_the_refined_pose_is_better_than_the_cameras(run):
    error = run[0].pose_error
    for refined, raw in zip(
        (error.refined.position_mm, error.refined.tilt_deg, error.refined.yaw_deg),
        (error.raw.position_mm, error.raw.tilt_deg, error.raw.yaw_deg),
        strict=True,
    ):
        assert refined.rms is not None
        assert raw.rms is not None
        assert refined.rms < 0.5 * raw.rms


def test_no_joint_leaves_its_range(run):
    _, folder, _ = run
    log, model = read_log(folder), load_model(folder)
    q = log.qpos[:, : len(JOINTS)]
    low, high = model.jnt_range[: len(JOINTS)].T
    # a limit is a soft contact: a thousandth of a radian is what a servo at its stop leans into it
    assert (q > low - 1e-3).all()
    assert (q < high + 1e-3).all()


def test_servos_are_held_to_the_published_torques(run):
    model, limits = load_model(run[1]), RobotModel().torque_limits
    for name in DRIVEN:
        servo = model.actuator(name)
        assert servo.forcelimited
        np.testing.assert_array_equal(servo.forcerange, limits[INDEX[name]] * np.array([-1.0, 1.0]))


def test_a_simulation_that_diverges_ends_the_run_with_its_record(tmp_path, monkeypatch):
    step, steps = Cell.step, []

    def kicked(cell):
        steps.append(0)
        if len(steps) == 200:
            cell.data.qvel[10] = np.nan
        step(cell)

    monkeypatch.setattr(Cell, "step", kicked)
    summary = fasten(load(None, ["goal.rounds=1"], SEED), tmp_path)
    assert summary.outcome == "DIVERGED"
    assert len(read_log(tmp_path).time) >= 200


def test_the_record_replays_to_the_last_bit(run):
    assert replay(run[1]).deviation <= 1e-9


def test_the_same_scenario_gives_the_same_run(run, tmp_path):
    fasten(load(run[1] / "scenario.toml"), tmp_path)
    np.testing.assert_array_equal(read_log(tmp_path).qpos, read_log(run[1]).qpos)


def test_progress_tells_phase_round_angle_torque_force_and_tilt(run):
    _, _, seen = run
    assert [p.phase for p in seen[:1]] == ["settle"]
    assert {"roll", "add", "leave", "relocate", "return", "remove"} <= {p.phase for p in seen}
    assert seen[-1].screw_angle > 0.7


def test_every_message_is_recorded_beside_the_truth(run):
    columns = read_signals(run[1])
    for name in ("measurement.q.FFJ3", "estimate.F_s.f_z", "goal.phase", "effort.f_W.TH.x", "truth.theta"):
        assert name in columns
