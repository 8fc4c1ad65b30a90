"""The user's cache of gait plans: one JSON file each, named by a hash of all that the plan depends on."""

from __future__ import annotations

import hashlib
import os
import sys
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from turnscrew.decide.plan import Course, GaitPlan, Handle
from turnscrew.decide.plan_file import load, save
from turnscrew.errors import PlanError

CACHE_VARIABLE = "TURNSCREW_CACHE"
"""Environment variable that names the cache folder."""

_ROOMS = ("turnscrew.robot", "turnscrew.decide", "turnscrew.decide.plans")
_LIBRARIES = ("casadi", "gymnasium-robotics", "mujoco")


def cache_folder() -> Path:
    """`TURNSCREW_CACHE`, else the platform's place for caches."""
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "turnscrew" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "turnscrew"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "turnscrew"


def plan_path(handle: Handle, course: Course = Course.ROUND) -> Path:
    """The file that a handle's plan is kept in."""
    dimensions = repr((handle.radius, handle.length, handle.middle, handle.shaft_radius))
    digest = hashlib.sha256(f"{course} {dimensions} {_surroundings()}".encode()).hexdigest()
    return cache_folder() / "plans" / f"{course}-r{handle.radius * 1e3:g}-{digest[:16]}.json"


def fetch(handle: Handle, course: Course = Course.ROUND) -> GaitPlan | None:
    """The plan kept for a handle; None when there is none that can be read."""
    path = plan_path(handle, course)
    if not path.is_file():
        return None
    # a damaged file costs a minute of planning, which is no reason to stop
    with suppress(PlanError):
        return load(path)
    return None


def keep(plan: GaitPlan) -> None:
    """Keeps a plan for the next time; a cache that cannot be written only costs planning again."""
    with suppress(OSError):
        save(plan, plan_path(plan.handle, plan.course))


@cache
def _surroundings() -> str:
    """Digest of the planner's and the robot's sources, the starts, and the libraries' versions."""
    digest = hashlib.sha256()
    for room in _ROOMS:
        for item in _content(files(room)):
            digest.update(item.name.encode() + b"\0" + item.read_bytes())
    for library in _LIBRARIES:
        try:
            digest.update(f"{library} {version(library)}".encode())
        except PackageNotFoundError:
            digest.update(library.encode())
    return digest.hexdigest()


def _content(room: Traversable) -> list[Traversable]:
    """What of a package, and of its folder of starts, a plan depends on, in an order that is always the same."""
    own = [item for item in room.iterdir() if item.is_file() and item.name.endswith((".py", ".json"))]
    if room.name == "decide":
        own = [item for item in own if item.name.startswith("plan")]
    starts = room / "starts"
    own += [item for item in starts.iterdir() if item.is_file()] if starts.is_dir() else []
    return sorted(own, key=lambda item: item.name)
