"""Films of recorded runs; drawing is skipped, with its reason, where a machine cannot draw."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from turnscrew.errors import RecordError, RenderError
from turnscrew.show import gl
from turnscrew.show.video import HEIGHT, RATE, WIDTH, cut, film
from turnscrew.task.record import Recorder
from turnscrew.task.scenario import load

XML = """
<mujoco>
  <worldbody>
    <light pos="0 0 2"/>
    <geom type="plane" size="1 1 .1" rgba=".5 .4 .3 1"/>
    <body name="tool" pos="0 0 .15">
      <freejoint name="tool"/><geom type="cylinder" size=".018 .05" mass=".08" rgba=".9 .3 .1 1"/>
    </body>
    <body name="screw" pos="0 0 .01"><joint name="screw" axis="0 0 1"/><geom type="box" size=".004 .002 .004"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of half a second in which a tool falls and a screw turns."""
    folder = tmp_path_factory.mktemp("film") / "run"
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    data.joint("screw").qvel[:] = -2.0
    with Recorder(folder, load()) as recorder:
        recorder.model(XML)
        for step in range(500):
            if step % 5 == 0:
                recorder.tick(data.time, goal={"round": 0, "phase": "roll"})
            recorder.step(data)
            mujoco.mj_step(model, data)
        recorder.step(data)
    return folder


@pytest.fixture(scope="module")
def video(run_folder: Path) -> Path:
    reason = gl.why_not() or (gl.missing_packages() and "no av or Pillow")
    if reason:
        pytest.skip(f"this machine cannot draw: {reason}")
    return film(run_folder)


def frames(video: Path) -> np.ndarray:
    import av

    with av.open(str(video)) as container:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])


def test_film_has_the_length_and_size_of_the_run(video: Path) -> None:
    pictures = frames(video)
    assert pictures.shape[1:] == (HEIGHT, WIDTH, 3)
    # MuJoCo's default step is 2 ms, so the run lasts 1 s
    assert len(pictures) == RATE


def test_film_shows_motion_and_more_than_one_colour(video: Path) -> None:
    pictures = frames(video).astype(int)
    # a falling tool changes hundreds of pixels by more than what h264 loses
    assert (np.abs(pictures[0] - pictures[-1]).max(axis=-1) > 40).sum() > 300
    assert pictures[0].std() > 20


def test_cut_is_an_animation(video: Path, tmp_path: Path) -> None:
    from PIL import Image

    cut(video, tmp_path / "cut.webp", start=0.2, seconds=0.5)
    with Image.open(tmp_path / "cut.webp") as animation:
        # 12 frames a second for half a second
        assert getattr(animation, "n_frames", 1) == 6
    with pytest.raises(RenderError, match="holds nothing from 50 s on"):
        cut(video, tmp_path / "cut.webp", start=50.0, seconds=1.0)


def test_folder_without_a_run_has_no_film(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="holds no run"):
        film(tmp_path)


def test_machine_that_cannot_draw_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    assert gl.why_not()
    with pytest.raises(RenderError, match="apt-get install libegl1") as caught:
        gl.require()
    assert "\n" not in str(caught.value)


def test_missing_package_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gl, "missing_packages", lambda: ["av"])
    with pytest.raises(RenderError, match=r"a video needs av: pip install 'turnscrew\[video\]'"):
        gl.require()
