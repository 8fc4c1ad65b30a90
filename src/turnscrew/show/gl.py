"""Whether this machine can draw: tried in a process of its own, since a broken OpenGL can take its process down."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

from turnscrew.errors import RenderError

PACKAGES = "apt-get install libegl1 libopengl0 libgl1-mesa-dri"
EXTRA = "pip install 'turnscrew[video]'"
SECONDS = 60
"""A first frame takes one second on a software renderer; a driver that hangs is given up on after this."""

_FRAME = """
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><geom size=".1" rgba="1 1 1 1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.Renderer(model, 32, 32)
renderer.update_scene(data)
bright = renderer.render().max()
renderer.close()
raise SystemExit(0 if bright > 0 else 'the frame stayed black')
"""


def environment() -> dict[str, str]:
    """The environment that a drawing process gets: EGL, which needs no display, unless the user chose otherwise."""
    # the child has to find this very package, installed or not
    paths = [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
    return {"MUJOCO_GL": "egl", **os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}


def why_not() -> str | None:
    """Why this machine cannot draw, in a few words, or None if it drew a frame."""
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _FRAME], env=environment(), capture_output=True, text=True, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return f"drawing a frame took more than {SECONDS} s"
    if tried.returncode == 0:
        return None
    lines = tried.stderr.strip().splitlines()
    return lines[-1] if lines else f"the drawing process ended with status {tried.returncode}"


def missing_packages() -> list[str]:
    """Python packages that a film needs and that are not installed."""
    return [name for name in ("av", "PIL") if importlib.util.find_spec(name) is None]


def require() -> None:
    """Makes sure that a film can be made here.

    Raises:
        RenderError: It cannot; the message says how to get what is missing.
    """
    missing = missing_packages()
    if missing:
        raise RenderError(f"a video needs {' and '.join(missing)}: {EXTRA}; or leave out --video")
    reason = why_not()
    if reason:
        raise RenderError(f"this machine cannot draw ({reason}): {PACKAGES}; or leave out --video")


def main() -> int:
    """Says in one line why no video can be drawn here; 1 then, 0 otherwise."""
    try:
        require()
    except RenderError as error:
        print(f"no video: {error}")
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
