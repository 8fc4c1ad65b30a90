"""Pictures of a recorded run: hand and tool in full, tip and screw enlarged in a corner."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

import mujoco
import numpy as np
from numpy.typing import NDArray

from turnscrew.geometry.arrays import Array
from turnscrew.plant.log import MODEL

Image = NDArray[np.uint8]

AZIMUTH, ELEVATION = 75.0, -12.0
"""Directions of view [deg] from which thumb, first and middle finger are seen side by side (found by trial)."""

DISTANCE, HEIGHT = 0.31, 0.115
"""The hand fills the picture from here, the screw at its lower edge [m]."""

CLOSE_DISTANCE, CLOSE_HEIGHT, CLOSE_ELEVATION = 0.055, 0.004, -28.0
"""Of the enlarged view: the screw's head fills a third of it [m, m, deg]."""

NEAR = 0.01
"""What is nearer to the camera than this is not drawn [m]: below the enlarged view's distance."""


class Scene:
    """Draws states of a run's model; a context manager, since OpenGL must be given back."""

    def __init__(self, folder: Path, width: int, height: int) -> None:
        self._model = _model_to_look_at(folder, width, height)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        screw = self._data.body("screw").xpos.copy()
        self._camera = _camera(screw, HEIGHT, DISTANCE, ELEVATION)
        self._close_camera = _camera(screw, CLOSE_HEIGHT, CLOSE_DISTANCE, CLOSE_ELEVATION)
        self._main = _renderer(self._model, width, height)
        self._inset = _renderer(self._model, width * 3 // 10, height * 2 // 5)

    def draw(self, qpos: Array) -> Image:
        """A state as an RGB image (height, width, 3), the enlarged view in its lower right corner."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._main.update_scene(self._data, self._camera)
        image: Image = self._main.render()
        self._inset.update_scene(self._data, self._close_camera)
        inset = self._inset.render()
        rows, columns = inset.shape[:2]
        image[-rows - 10 : -6, -columns - 10 : -6] = 255
        image[-rows - 8 : -8, -columns - 8 : -8] = inset
        return image

    def __enter__(self) -> Scene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._main.close()
        self._inset.close()


def _model_to_look_at(folder: Path, width: int, height: int) -> mujoco.MjModel:
    """The run's model with a sky and a near clipping plane; bodies and joints stay as they are."""
    spec = mujoco.MjSpec.from_file(str(folder / MODEL))
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.95, 0.97], rgb2=[0.62, 0.68, 0.75], width=256, height=1536,
    )  # fmt: skip
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    # a software renderer spends nine tenths of its time on shadows and multisampling
    spec.visual.quality.offsamples = 0
    model = spec.compile()
    model.vis.map.znear = NEAR / model.stat.extent
    return model


def _camera(screw: Array, height: float, distance: float, elevation: float) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    camera.lookat[:] = screw[0], screw[1], screw[2] + height
    camera.distance, camera.azimuth, camera.elevation = distance, AZIMUTH, elevation
    return camera


def _renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    renderer = mujoco.Renderer(model, height, width)
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
    return renderer
