"""The command line: what it prints, what it returns, and one line for whatever is wrong."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from turnscrew import __version__, cli
from turnscrew.errors import PlanError
from turnscrew.plant.replay import replay
from turnscrew.task.scenario import Scenario, load
from turnscrew.task.summary import (
    FaultEntry,
    ForceError,
    PoseError,
    PoseErrorOf,
    Progress,
    Spread,
    Summary,
    WrenchError,
)

ROOT = Path(__file__).parents[1]
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Runs the command line in this process, in an empty folder; returns status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["turnscrew", *words])
        status = cli.main()
        shown = capsys.readouterr()
        return status, shown.out, shown.err

    return call


def ended(outcome: str, scenario: Scenario) -> Summary:
    none = Spread(rms=None, max=None)
    pose = PoseErrorOf(position_mm=none, tilt_deg=none, yaw_deg=none)
    faults = [] if outcome == "goal" else [FaultEntry(kind=outcome, time_s=1.5, evidence="2.1 mm is more than 2 mm")]
    return Summary(
        outcome=outcome, rounds=scenario.goal.rounds or 0, turned_deg=250.0, advance_mm=0.5, final_torque_nm=0.09,
        max_tilt_deg=1.0, tip_slip_mm=0.2, finger_slip_mm=0.1, sim_time_s=20.0, wall_time_s=10.0, real_time_factor=2.0,
        pose_error=PoseError(raw=pose, refined=pose), wrench_error=WrenchError(force_n=none, torque_nm=none),
        force_error=ForceError(magnitude_n=none, direction_deg=none), support_fraction=1.0, faults=faults,
        recoveries=[], seed=scenario.seed, versions={},
    )  # fmt: skip


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Scenario, Path]]:
    """Stands in for the loop: reports progress and reaches the goal; returns what it was asked for."""
    asked: list[tuple[Scenario, Path]] = []

    def fasten(scenario: Scenario, out: Path, *, on_progress: Any = None, on_planning: Any = None) -> Summary:
        asked.append((scenario, out))
        if on_progress is not None:
            on_progress(Progress(3.0, "roll", 1, 1.2, 0.024, 5.1, 0.01, 2.5))
        return ended("goal", scenario)

    replace_loop(monkeypatch, fasten)
    return asked


def replace_loop(monkeypatch: pytest.MonkeyPatch, fasten: Any) -> None:
    import turnscrew.task.fasten

    monkeypatch.setattr(turnscrew.task.fasten, "fasten", fasten)


def one_line(text: str) -> str:
    assert text.startswith("turnscrew: ")
    assert text.count("\n") == 1
    assert "Traceback" not in text
    return text


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"turnscrew {__version__}\n", "")


def test_scenario_prints_a_file_that_fasten_takes(run: Run, runs: list[tuple[Scenario, Path]], tmp_path: Path) -> None:
    status, out, _ = run("scenario")
    assert status == 0
    assert tomllib.loads(out)["tool"]["handle"]["radius"] == 0.018
    (tmp_path / "mine.toml").write_text(out)
    assert run("fasten", "mine.toml")[0] == 0
    assert runs[0][0] == load()


def test_fasten_passes_its_options_on(run: Run, runs: list[tuple[Scenario, Path]]) -> None:
    status, out, _ = run(
        "fasten", "--set", "tool.handle.radius=0.015", "--set", "tool.mass=0.09", "--seed", "7", "--rounds", "2",
        "--out", "there",
    )  # fmt: skip
    (scenario, folder), *_ = runs
    assert status == 0
    assert (scenario.tool.handle.radius, scenario.tool.mass, scenario.seed) == (0.015, 0.09, 7)
    assert (scenario.goal.rounds, folder) == (2, Path("there"))
    for word in ("phase roll", "round 2", "68.8 deg", "0.024 N.m", "5.1 N", "0.57 deg", "x 2.50", "250 deg", "there"):
        assert word in out


def test_json_prints_the_summary_alone(run: Run, runs: list[tuple[Scenario, Path]]) -> None:
    status, out, err = run("fasten", "--json")
    assert (status, err) == (0, "")
    assert json.loads(out)["outcome"] == "goal"


def test_run_that_ends_in_a_fault_returns_1_and_names_it(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    replace_loop(monkeypatch, lambda scenario, out, **_: ended("TIP_SLIP", scenario))
    status, out, _ = run("fasten")
    assert status == 1
    assert "TIP_SLIP at 1.50 s: 2.1 mm is more than 2 mm" in out


def test_interrupt_returns_1_and_says_where_the_record_is(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(scenario: Scenario, out: Path, *, on_progress: Any = None, on_planning: Any = None) -> Summary:
        raise KeyboardInterrupt

    replace_loop(monkeypatch, interrupted)
    status, _, err = run("fasten", "--out", "there")
    assert status == 1
    assert "the record up to here is in there" in one_line(err)


def test_handle_that_no_plan_fits_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_plan(scenario: Scenario, out: Path, *, on_progress: Any = None, on_planning: Any = None) -> Summary:
        raise PlanError("no plan fits a handle\nof radius 0.05 m")

    replace_loop(monkeypatch, no_plan)
    status, _, err = run("fasten", "--set", "tool.handle.radius=0.05")
    assert status == 2
    assert "no plan fits a handle of radius 0.05 m" in one_line(err)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["fasten", "--set", "tool.handle.radios=1"], "unknown key; the nearest is tool.handle.radius"),
        (["fasten", "--set", "tool.mass=9"], "tool.mass = 9: must be a number, at least 0.01 kg and at most 1 kg"),
        (["fasten", "--rounds", "0"], "goal.rounds = 0: must be a whole number, at least 1"),
        (["fasten", "--rounds", "many"], "--rounds"),
        (["fasten", "--seed", "-1"], "seed = -1: must be a whole number, at least 0"),
        (["fasten", "none.toml"], "none.toml: there is no such file"),
        (["fasten", "broken.toml"], "broken.toml: not valid TOML"),
        (["fasten", "--colour"], "--colour"),
        (["fasten", "one.toml", "two.toml"], "two.toml"),
        (["scenario", "--set", "nothing"], "an override is key=value"),
        (["trials", "--variation", "harder"], "--variation harder: must be one of none, standard, hard"),
        (["trials", "--engine", "dask"], "--engine dask: must be one of joblib, ray"),
        (["trials", "--trials", "0"], "--trials"),
        (["replay", "nowhere"], "nowhere: holds no run"),
        (["video", "nowhere"], "nowhere: holds no run"),
        (["replay"], "DIR"),
        (["turn"], "turn"),
    ],
)
def test_bad_input_is_one_line_and_status_2(run: Run, tmp_path: Path, words: list[str], expected: str) -> None:
    (tmp_path / "broken.toml").write_text("tool = [")
    status, out, err = run(*words)
    assert status == 2
    assert expected in one_line(err)
    assert out == ""
    assert not (tmp_path / "runs").exists()


def test_output_folder_that_cannot_be_written_is_told(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    status, _, err = run("fasten", "--out", "file/run")
    assert status == 2
    assert "cannot be written" in one_line(err)


def test_video_without_rendering_is_told_before_the_run(
    run: Run, runs: list[tuple[Scenario, Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    status, _, err = run("fasten", "--video")
    assert status == 2
    assert "apt-get install libegl1 libopengl0 libgl1-mesa-dri" in one_line(err)
    assert runs == []


def test_doctor_looks_at_everything_and_names_cures(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    status, out, _ = run("doctor")
    assert status == 0, "rendering is not needed for a run"
    for word in ("Python", "mujoco", "casadi", "Shadow Hand", "runs", "drawing", "video", "libegl1"):
        assert word in out


def test_doctor_returns_1_when_a_needed_part_is_missing(run: Run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    status, out, _ = run("doctor", "--out", "file/runs")
    assert status == 1
    assert "cannot be written" in out


def test_killed_command_leaves_a_record_that_replays(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-m", "turnscrew", "fasten", "--json", "--out", str(out)],
        env={**os.environ, "PYTHONPATH": str(ROOT / "src")}, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    # a second of simulated time takes a second or two; a busy machine may take many times that
    deadline = time.monotonic() + 120
    while not list(out.glob("segments/*.npz")) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    process.kill()
    process.wait()
    again = replay(out)
    assert again.steps >= 999
    assert again.deviation == 0.0
    assert load(out / "scenario.toml") == load()
    assert not (out / "summary.json").exists()
