"""Replay: the same run again, and every way in which it is not."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from turnscrew.errors import ModelError, RecordError
from turnscrew.plant.export import portable
from turnscrew.plant.log import read_log
from turnscrew.plant.replay import TOLERANCE, load_model, replay
from turnscrew.task.record import Recorder
from turnscrew.task.scenario import load

XML = """
<mujoco>
  <option timestep="0.001" cone="elliptic" impratio="100"/>
  <compiler meshdir="{folder}"/>
  <asset><mesh name="wedge" file="wedge.obj"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 .1"/>
    <body name="tool" pos="0 0 0.333333"><freejoint name="tool"/><geom type="mesh" mesh="wedge" mass="0.08"/></body>
    <body name="screw" pos="0.5 0 0.1">
      <joint name="screw" type="hinge" axis="0 0 1" damping="0.001"/><geom type="capsule" size="0.02 0.05"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="thread" joint="screw"/>
    <general name="lag" joint="screw" dyntype="filter" dynprm="0.01" gainprm="0.01"/>
  </actuator>
</mujoco>
"""
WEDGE = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .13\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def xml(tmp_path: Path) -> str:
    (tmp_path / "wedge.obj").write_text(WEDGE)
    return XML.format(folder=tmp_path)


def record(xml: str, out: Path, *, steps: int = 1500, started: int = 0) -> None:
    """A run of a body that falls, hits the ground and comes to rest, and a driven screw beside it."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    noise = np.random.default_rng(0)
    for _ in range(started):
        mujoco.mj_step(model, data)
    with Recorder(out, load()) as recorder:
        recorder.model(xml)
        for step in range(steps):
            if step % 5 == 0:
                data.ctrl[:] = noise.normal(size=2)
                recorder.tick(data.time, screw=float(data.qpos[7]))
            recorder.step(data)
            mujoco.mj_step(model, data)
        recorder.step(data)


@pytest.mark.parametrize("started", [0, 400])
def test_replay_is_the_run_to_the_last_bit(xml: str, tmp_path: Path, started: int) -> None:
    record(xml, tmp_path / "run", started=started)
    again = replay(tmp_path / "run")
    assert again.steps == 1500
    # the same binary does the same arithmetic: nothing but equality is good enough here
    assert again.deviation == 0.0
    assert again.agrees


def test_record_moves_to_another_machine(xml: str, tmp_path: Path) -> None:
    record(xml, tmp_path / "run", steps=100)
    (tmp_path / "wedge.obj").unlink()
    moved = (tmp_path / "run").rename(tmp_path / "elsewhere")
    assert (moved / "model" / "assets" / "wedge.obj").read_text() == WEDGE
    assert replay(moved).agrees


def test_portable_model_is_the_same_model(xml: str) -> None:
    text, assets = portable(xml)
    one, other = mujoco.MjModel.from_xml_string(xml), mujoco.MjModel.from_xml_string(text, assets)
    for name in ("body_mass", "body_inertia", "geom_pos", "geom_quat", "mesh_vert", "dof_invweight0"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_changed_control_is_found(xml: str, tmp_path: Path) -> None:
    record(xml, tmp_path / "run", steps=200)
    file = tmp_path / "run" / "log.npz"
    with np.load(file) as arrays:
        log = {name: arrays[name].copy() for name in arrays.files}
    log["ctrl"][100, 0] += 1e-3
    np.savez(file, **log)
    again = replay(tmp_path / "run")
    assert again.deviation > TOLERANCE
    assert again.step > 100
    assert not again.agrees


def test_state_that_is_no_number_is_found(xml: str, tmp_path: Path) -> None:
    record(xml, tmp_path / "run", steps=50)
    file = tmp_path / "run" / "log.npz"
    with np.load(file) as arrays:
        log = {name: arrays[name].copy() for name in arrays.files}
    log["qpos"][20, 3] = np.nan
    np.savez(file, **log)
    again = replay(tmp_path / "run")
    assert (again.deviation, again.step) == (np.inf, 20)


def test_killed_run_replays(xml: str, tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    recorder = Recorder(tmp_path / "run", load())
    recorder.model(xml)
    for _ in range(2500):
        recorder.step(data)
        mujoco.mj_step(model, data)
    again = replay(tmp_path / "run")
    assert again.steps == 1999
    assert again.agrees


def test_folder_without_a_run_is_told(xml: str, tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="holds no run"):
        replay(tmp_path / "nothing")
    record(xml, tmp_path / "run", steps=10)
    (tmp_path / "run" / "model" / "model.xml").write_text("<mujoco")
    with pytest.raises(RecordError, match="MuJoCo cannot load it") as caught:
        load_model(tmp_path / "run")
    assert "\n" not in str(caught.value)
    (tmp_path / "run" / "model" / "model.xml").write_text("<mujoco><worldbody/></mujoco>")
    with pytest.raises(RecordError, match="do not belong together"):
        replay(tmp_path / "run")
    (tmp_path / "run" / "log.npz").write_bytes(b"torn")
    with pytest.raises(RecordError, match="cannot be read as a log"):
        read_log(tmp_path / "run")


def test_missing_mesh_is_told(xml: str, tmp_path: Path) -> None:
    (tmp_path / "wedge.obj").unlink()
    with pytest.raises(ModelError, match=r"wedge\.obj: there is no such file"):
        portable(xml)
