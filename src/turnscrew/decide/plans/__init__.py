"""Gait plans by handle radius: shipped, cached, or planned on demand."""

from __future__ import annotations

from importlib.resources import files

from turnscrew.decide.plan import GaitPlan
from turnscrew.decide.plan_file import from_json

DEFAULT_RADIUS = 0.018


def plan_for(radius: float = DEFAULT_RADIUS) -> GaitPlan:
    """The gait plan of a handle radius [m]."""
    text = files(__package__).joinpath("r18.json").read_text(encoding="utf-8")
    return from_json(text, "the default gait plan")
