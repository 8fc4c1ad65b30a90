"""What this machine offers and lacks for turnscrew, and how to get what is missing."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import machine, python_version

from turnscrew.show import gl

PACKAGES = ("mujoco", "gymnasium-robotics", "numpy", "scipy", "casadi", "daqp", "pydantic", "typer", "rich", "duckdb")
HAND = Path("envs") / "assets" / "hand" / "robot.xml"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        name: What.
        good: Whether it is there and works.
        needed: Whether `fasten` without `--video` needs it.
        detail: What was found, or what is wrong.
        cure: How to get it; empty when nothing is missing.
    """

    name: str
    good: bool
    needed: bool
    detail: str
    cure: str = ""


def examine(folder: Path) -> Iterator[Finding]:
    """Looks at one thing after the other.

    Args:
        folder: Where runs would be written.
    """
    yield _python()
    yield from map(_package, PACKAGES)
    looks: tuple[Callable[[], Finding], ...] = (_hand, lambda: _writable(folder), _drawing, _encoder)
    for look in looks:
        yield look()


def _python() -> Finding:
    good = sys.version_info >= (3, 11)
    return Finding("Python", good, True, f"{python_version()} on {machine()}", "" if good else "install Python 3.11")


def _package(name: str) -> Finding:
    try:
        return Finding(name, True, True, version(name))
    except PackageNotFoundError:
        return Finding(name, False, True, "not installed", "pip install turnscrew (or: make demo)")


def _hand() -> Finding:
    name, cure = "Shadow Hand", "pip install gymnasium-robotics==1.4.2"
    spec = importlib.util.find_spec("gymnasium_robotics")
    if spec is None or not spec.submodule_search_locations:
        return Finding(name, False, True, "its files come with gymnasium-robotics, which is missing", cure)
    file = Path(next(iter(spec.submodule_search_locations))) / HAND
    if not file.is_file():
        return Finding(name, False, True, f"{file} is missing", cure)
    return Finding(name, True, True, str(file.parent))


def _writable(folder: Path) -> Finding:
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    good = place.is_dir() and os.access(place, os.W_OK | os.X_OK)
    cure = "" if good else "choose another folder: --out DIR"
    return Finding("runs", good, True, f"{place} can{'' if good else 'not'} be written", cure)


def _drawing() -> Finding:
    reason = gl.why_not()
    backend = gl.environment()["MUJOCO_GL"]
    if reason is None:
        return Finding("drawing", True, False, f"a frame was drawn with MUJOCO_GL={backend}")
    return Finding("drawing", False, False, f"MUJOCO_GL={backend}: {reason}", gl.PACKAGES)


def _encoder() -> Finding:
    missing = gl.missing_packages()
    if missing:
        return Finding("video", False, False, f"{' and '.join(missing)} not installed", gl.EXTRA)
    tried = subprocess.run(
        [sys.executable, "-c", "import av; av.codec.Codec('h264', 'w')"], capture_output=True, text=True
    )
    if tried.returncode:
        return Finding("video", False, False, "PyAV has no h264 encoder", gl.EXTRA)
    return Finding("video", True, False, f"PyAV {version('av')} encodes h264")
