"""Records: complete when the run ends, readable when it does not."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from turnscrew.errors import PlanError, RecordError
from turnscrew.geometry.arrays import Array
from turnscrew.plant.log import SEGMENTS, read_log
from turnscrew.signals import Fault, FaultKind, Vision
from turnscrew.task.record import Recorder
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import read_signals
from turnscrew.task.summary import (
    ForceError,
    PoseError,
    PoseErrorOf,
    Spread,
    Summary,
    WrenchError,
    versions,
)

ROOT = Path(__file__).parents[2]
XML = "<mujoco><worldbody><body><joint/><geom size='.1'/></body></worldbody></mujoco>"


@dataclass
class State:
    """A plant of three coordinates whose state tells which step it is."""

    step: int
    time: float
    qpos: Array
    qvel: Array
    ctrl: Array
    act: Array
    qacc_warmstart: Array


def state(step: int) -> State:
    value = float(step)
    return State(
        step, 0.001 * step, value + np.zeros(3), 2 * value + np.zeros(3), np.array([3 * value]), np.empty(0), np.ones(3)
    )


def run(recorder: Recorder, steps: int) -> None:
    for step in range(steps):
        if step % 5 == 0:
            recorder.tick(0.001 * step, estimate={"F_s": np.arange(6.0), "theta": step / 10}, phase="roll")
        recorder.step(state(step))


def summary() -> Summary:
    none = Spread(rms=None, max=None)
    pose = PoseErrorOf(position_mm=none, tilt_deg=none, yaw_deg=none)
    return Summary(
        outcome="goal", rounds=5, turned_deg=250.0, advance_mm=0.5, final_torque_nm=0.09, max_tilt_deg=1.0,
        tip_slip_mm=0.2, finger_slip_mm=0.1, sim_time_s=20.0, wall_time_s=10.0, real_time_factor=2.0,
        pose_error=PoseError(raw=pose, refined=pose), wrench_error=WrenchError(force_n=none, torque_nm=none),
        force_error=ForceError(magnitude_n=none, direction_deg=none), support_fraction=1.0, faults=[], recoveries=[],
        seed=0, versions=versions(),
    )  # fmt: skip


def test_finished_record_is_whole(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "run"
    with Recorder(out, load()) as recorder:
        recorder.model(XML)
        run(recorder, 2345)
        recorder.finish(summary())
    assert {path.name for path in out.iterdir()} == {
        "model", "scenario.toml", "log.npz", "signals.parquet", "summary.json",
    }  # fmt: skip
    log = read_log(out)
    assert np.array_equal(log.qpos[:, 0], np.arange(2345.0))
    assert np.array_equal(log.ctrl[:, 0], 3 * np.arange(2345.0))
    assert log.act.shape == (2345, 0)
    assert json.loads((out / "summary.json").read_text())["versions"]["mujoco"]
    assert load(out / "scenario.toml") == load()
    with np.load(out / "log.npz") as arrays:
        assert sorted(arrays.files) == ["act", "ctrl", "qacc_warmstart", "qpos", "qvel", "time"]


def test_signals_are_named_by_path(tmp_path: Path) -> None:
    fault = Fault(FaultKind.STALLED, 0.5, "0 deg in 2 s")
    with Recorder(tmp_path / "run", load()) as recorder:
        for step in range(12):
            vision = Vision(0.25, np.arange(3.0), np.eye(3), np.eye(6)) if step == 7 else None
            recorder.tick(
                0.005 * step, measurement={"vision": vision, "q": np.arange(28.0)}, faults=(fault,) if step else (),
                estimate={"F_s": np.arange(6.0), "touching": np.array([True] * 5), "f_W": np.ones((5, 3))},
                truth={"tool": {"p": np.arange(3.0), "q": np.ones(4)}},
            )  # fmt: skip
            recorder.step(state(step))
    signals = read_signals(tmp_path / "run")
    assert signals["estimate.F_s.f_z"][3] == 2.0
    assert signals["measurement.q.WAMJ2"][0] == 1.0
    assert signals["estimate.touching.TH"][0] == 1.0
    assert signals["truth.tool.p_y"][0] == 1.0
    assert {"truth.tool.q_w", "estimate.f_W.LF.z", "measurement.vision.R_WT.zz"} <= signals.keys()
    assert np.flatnonzero(~np.isnan(signals["measurement.vision.p_WT.y"])).tolist() == [7]
    assert signals["faults"][0] == ""
    assert "STALLED" in signals["faults"][1]


def test_whole_and_unfinished_record_read_alike(tmp_path: Path) -> None:
    left = Recorder(tmp_path / "left", load())
    run(left, 3000)
    left.step(state(3000))
    with Recorder(tmp_path / "closed", load()) as closed:
        run(closed, 3000)
    pieces, whole = read_log(tmp_path / "left"), read_log(tmp_path / "closed")
    assert np.array_equal(pieces.qpos, whole.qpos)
    first, second = read_signals(tmp_path / "left"), read_signals(tmp_path / "closed")
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_signal_that_comes_later_is_missing_before(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run", load())
    for step in range(2001):
        recorder.tick(0.001 * step, **({"late": float(step), "word": "here"} if step >= 1500 else {}))
        recorder.step(state(step))
    for folder in ("pieces", "whole"):
        signals = read_signals(tmp_path / "run")
        assert np.isnan(signals["late"][:1500]).all(), folder
        assert signals["late"][1500] == 1500.0
        assert (signals["word"][1499], signals["word"][1500]) == ("", "here")
        recorder.close()


def test_signal_of_another_size_is_refused(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run", load())
    recorder.tick(0.0, x=np.ones(3))
    with pytest.raises(RecordError, match="x: changed its size from 3 to 4"):
        recorder.tick(0.1, x=np.ones(4))


def test_error_in_a_run_leaves_its_record(tmp_path: Path) -> None:
    def interrupted() -> None:
        with Recorder(tmp_path / "run", load()) as recorder:
            run(recorder, 1234)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert len(read_log(tmp_path / "run").time) == 1234
    assert not (tmp_path / "run" / "summary.json").exists()


KILLED = """
import sys, time
from pathlib import Path
sys.path[:0] = {paths!r}
from test_record import Recorder, load, run, state
recorder = Recorder(Path({out!r}), load())
run(recorder, 5500)
print("running", flush=True)
time.sleep(60)
"""


def test_killed_run_loses_its_last_second_at_most(tmp_path: Path) -> None:
    out = tmp_path / "run"
    paths = [str(ROOT / "src"), str(Path(__file__).parent)]
    process = subprocess.Popen([sys.executable, "-c", KILLED.format(paths=paths, out=str(out))], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"running\n"
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    log, signals = read_log(out), read_signals(out)
    # 5500 steps at 1 kHz, a segment a second; the tick before step 5000 is on the page that step turns
    assert len(log.time) == 5000
    assert len(signals["time"]) == 1001
    assert np.array_equal(log.qpos[:, 0], np.arange(5000.0))
    with Recorder(out, load()) as again:
        run(again, 10)
    assert len(read_log(out).time) == 10


def test_torn_piece_is_never_seen(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run", load())
    run(recorder, 2001)
    (tmp_path / "run" / SEGMENTS / ".000002.npz.part").write_bytes(b"half")
    assert len(read_log(tmp_path / "run").time) == 2000


def test_folder_that_cannot_be_written_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    for folder in (tmp_path / "file", tmp_path / "file" / "run", Path("/proc/turnscrew")):
        with pytest.raises(RecordError, match=r"cannot be written: .*; choose another --out") as caught:
            Recorder(folder, load())
        assert "\n" not in str(caught.value)


def test_run_that_never_began_leaves_the_earlier_record(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run", load()) as first:
        run(first, 100)

    def no_plan() -> None:
        with Recorder(tmp_path / "run", load()):
            raise PlanError("no plan fits")

    with pytest.raises(PlanError):
        no_plan()
    assert len(read_log(tmp_path / "run").time) == 100


def test_foreign_files_are_never_removed(tmp_path: Path) -> None:
    (tmp_path / "model").mkdir()
    with pytest.raises(RecordError, match=r"holds model but no scenario\.toml"):
        Recorder(tmp_path, load())
    assert (tmp_path / "model").is_dir()


def test_logging_a_step_is_cheap(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run", load())
    now = state(0)
    recorder.step(now)
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(150):
            recorder.step(now)
        best = min(best, (time.perf_counter() - start) / 150)
    # 2 us are usual; a shared machine may be some times slower, a mistake (a copy, an allocation a step) far more
    assert best < 20e-6
