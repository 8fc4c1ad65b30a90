"""The loop on a rendered camera and on strain gauges: a short run each, on seeds that nothing was tuned on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from turnscrew.plant.replay import replay
from turnscrew.show import gl
from turnscrew.task.fasten import fasten
from turnscrew.task.scenario import load
from turnscrew.task.signal_table import column, read_signals


@pytest.fixture(scope="module")
def drawing() -> None:
    reason = gl.why_not()
    if reason:
        pytest.skip(f"this machine cannot draw: {reason}")


def test_marker_camera_closes_the_loop(tmp_path: Path, drawing: None) -> None:
    wishes = ["vision.source=rendered", "force.source=strain", "goal.time_limit=1.5"]
    summary = fasten(load(None, wishes, 777301), tmp_path)
    # the run is cut short in its first roll; nothing else may have been amiss
    assert [fault.kind for fault in summary.faults] == ["TIMEOUT"]
    assert summary.turned_deg > 20.0
    signals = read_signals(tmp_path)
    frames = np.flatnonzero(~np.isnan(signals["measurement.vision.stamp"]))
    # 30 Hz for 1.5 s; at most a sixth lost while the tool is searched for
    assert len(frames) > 37
    seen = column(signals, "measurement.vision.p_WT", 3)[frames]
    stamp = signals["measurement.vision.stamp"][frames]
    true = column(signals, "truth.p_WT", 3)[np.searchsorted(signals["time"], stamp - 1e-9)]
    # .45 mm rms measured; a wrong frame, or a pose a marker off, would show centimetres
    assert np.sqrt(((seen - true) ** 2).sum(axis=1).mean()) < 1.5e-3
    assert replay(tmp_path).deviation <= 1e-9


def test_no_marker_in_view_ends_the_run_with_the_reason(tmp_path: Path, drawing: None) -> None:
    # a camera below the bench sees its underside
    wishes = ["vision.source=rendered", "vision.camera.azimuth=1.8", "vision.camera.elevation=0.9"]
    summary = fasten(load(None, wishes, 777302), tmp_path)
    assert summary.outcome == "VISION_LOST"
    (fault,) = (fault for fault in summary.faults if "since the start" in fault.evidence)
    assert fault.evidence.startswith("no pose from the camera since the start: no marker of 4X4_50")
    # two seconds without sight, and half a second in which the tool is held still
    assert summary.sim_time_s < 2.6


def test_strain_gauges_turn_the_screw(tmp_path: Path) -> None:
    summary = fasten(load(None, ["force.source=strain", "goal.rounds=1"], 777303), tmp_path)
    assert summary.outcome == "goal"
    assert summary.turned_deg > 45.0
    assert summary.max_tilt_deg < 3.0
    signals = read_signals(tmp_path)
    assert "measurement.f_F.TH.x" not in signals
    assert np.isfinite(column(signals, "measurement.tau", 24)).all()
