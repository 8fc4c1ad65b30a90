"""Pictures of the cell: any window of what a scene camera sees, drawn through an off-axis frustum."""

from __future__ import annotations

import importlib
import os
import sys
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from turnscrew.errors import RenderError
from turnscrew.geometry.pinhole import KINECT, CameraPose, Pinhole, Window

Image = NDArray[np.uint8]

TILE = (1280, 960)
"""Largest piece that is drawn at once [px]: bigger windows are put together of several."""

FINE, LARGE = 3, 400_000
"""A pixel is the mean of so many by so many samples, as a sensor's gathers light from all its area; in a window of more
than LARGE pixels, which is for searching, it is a single sample: five times faster."""

NEAR, FAR = 0.05, 10.0
"""What is nearer or farther is not drawn [m]."""

GEOMS = 2000
"""Most shapes that a picture can hold: the cell has a tenth."""


@dataclass(frozen=True)
class SceneCamera:
    """A camera in the cell, without distortion: the lens is the sensor's affair.

    Attributes:
        pose: Where it stands.
        pinhole: What it sees.
    """

    pose: CameraPose
    pinhole: Pinhole = KINECT


class Pictures:
    """Draws a model's states; `close` gives OpenGL back."""

    def __init__(self, model: mujoco.MjModel, camera: SceneCamera) -> None:
        """Opens OpenGL.

        Raises:
            RenderError: This machine cannot draw.
        """
        self._camera = camera
        self._gl: Any = _context()
        self._scene = mujoco.MjvScene(model, GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = False
        self._option, self._free = mujoco.MjvOption(), mujoco.MjvCamera()
        self._context = _drawing(model)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._model = model

    def draw(self, data: mujoco.MjData, window: Window) -> Image:
        """The window's pixels (height, width, 3), RGB.

        Args:
            data: State to draw, its kinematics worked out.
            window: In the camera's full image.
        """
        self._gl.make_current()
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, self._option, None, self._free, everything, self._scene)
        image = np.empty((window.height, window.width, 3), np.uint8)
        fine = FINE if window.width * window.height <= LARGE else 1
        wide, high = TILE[0] // fine, TILE[1] // fine
        for top in range(0, window.height, high):
            for left in range(0, window.width, wide):
                width, height = min(wide, window.width - left), min(high, window.height - top)
                tile = Window(window.left + left, window.top + top, width, height)
                image[top : top + height, left : left + width] = self._draw_tile(tile, fine)
        return image

    def close(self) -> None:
        """Gives OpenGL back; drawing is over then."""
        if self._gl is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._gl = None

    def _draw_tile(self, window: Window, fine: int) -> Image:
        for eye in self._scene.camera:
            self._aim(eye, window)
        samples = np.empty((fine * window.height, fine * window.width, 3), np.uint8)
        rect = mujoco.MjrRect(0, 0, fine * window.width, fine * window.height)
        mujoco.mjr_render(rect, self._scene, self._context)
        mujoco.mjr_readPixels(samples, None, rect, self._context)
        return _averaged(samples, fine)[::-1]

    def _aim(self, eye: mujoco.MjvGLCamera, window: Window) -> None:
        """Makes the frustum see exactly the window's pixels, which reach half a pixel beyond their centres."""
        pinhole, pose = self._camera.pinhole, self._camera.pose
        left = (window.left - 0.5 - pinhole.c[0]) / pinhole.f[0]
        right = left + window.width / pinhole.f[0]
        top = -(window.top - 0.5 - pinhole.c[1]) / pinhole.f[1]
        bottom = top - window.height / pinhole.f[1]
        eye.pos, eye.forward, eye.up = pose.p_WK, pose.R_WK[:, 2], -pose.R_WK[:, 1]
        eye.frustum_near, eye.frustum_far = NEAR, FAR
        eye.frustum_center, eye.frustum_width = NEAR * (left + right) / 2, NEAR * (right - left) / 2
        eye.frustum_bottom, eye.frustum_top = NEAR * bottom, NEAR * top


def _averaged(samples: Image, fine: int) -> Image:
    """Means over blocks of fine x fine samples."""
    if fine == 1:
        return samples
    rows, columns = samples.shape[0] // fine, samples.shape[1] // fine
    total = np.zeros((rows, columns, 3), np.uint16)
    for row in range(fine):
        for column in range(fine):
            total += samples[row::fine, column::fine]
    return ((total + fine * fine // 2) // (fine * fine)).astype(np.uint8)


def _drawing(model: mujoco.MjModel) -> mujoco.MjrContext:
    """A drawing context with a buffer for a tile and no multisampling, which `FINE` stands for."""
    looks, quality = model.vis.global_, model.vis.quality
    before = looks.offwidth, looks.offheight, quality.offsamples
    looks.offwidth, looks.offheight, quality.offsamples = *TILE, 0
    context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50.value)
    looks.offwidth, looks.offheight, quality.offsamples = before
    return context


def _context() -> Any:
    """An OpenGL context, by EGL where no other way was chosen: it needs no display."""
    try:
        # MuJoCo reads the variable again when it looks for OpenGL's functions
        os.environ["MUJOCO_GL"] = os.environ.get("MUJOCO_GL") or ("egl" if sys.platform == "linux" else "")
        if os.environ["MUJOCO_GL"] == "egl":
            context = importlib.import_module("mujoco.egl").GLContext(*TILE)
        else:
            context = mujoco.GLContext(*TILE)
        context.make_current()
    # the platforms' modules raise whatever their libraries do
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RenderError(
            f"vision.source = 'rendered' draws pictures, and this machine cannot ({reason}): "
            "apt-get install libegl1 libopengl0 libgl1-mesa-dri"
        ) from None
    return context
