"""The screwdriver: a free body with handle, shaft and flat blade."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.plant.contact import STEEL, Friction, rub
from turnscrew.plant.markers import Markers, add_markers, markers_mass

STEEL_DENSITY = 7850.0
"""Density of shaft and blade [kg/m3]."""


@dataclass(frozen=True)
class Tool:
    """Dimensions of a slotted screwdriver, measured from the tip's edge centre along the axis.

    Attributes:
        radius: Of the handle [m].
        length: Of the handle [m].
        middle: Height of the handle's middle above the tip [m].
        mass: Of the whole tool [kg].
        shaft_radius: [m].
        blade: Width along the edge and thickness across it [m].
        blade_height: How far up the flat blade reaches [m].
        markers: For a camera; they are part of the mass.
    """

    radius: float
    length: float
    middle: float
    mass: float
    shaft_radius: float = 0.003
    blade: tuple[float, float] = (0.006, 0.001)
    blade_height: float = 0.008
    markers: Markers | None = None


def add_tool(spec: mujoco.MjSpec, tool: Tool, friction: Friction, p_WT: Array, R_WT: Array) -> None:
    """Adds body and free joint `tool` with frame T at the given pose (initial `qpos` is that pose)."""
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, R_WT.ravel())
    body = spec.worldbody.add_body(name="tool", pos=p_WT, quat=quat)
    body.add_freejoint(name="tool")
    handle_start = tool.middle - tool.length / 2
    width, thickness = tool.blade
    shaft_mass = STEEL_DENSITY * np.pi * tool.shaft_radius**2 * (handle_start - tool.blade_height)
    blade_mass = STEEL_DENSITY * width * thickness * tool.blade_height
    marker_mass = 0.0 if tool.markers is None else markers_mass(tool.markers)
    handle_mass = tool.mass - shaft_mass - blade_mass - marker_mass
    handle = body.add_geom(
        name="handle", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0, 0, tool.middle],
        size=[tool.radius, tool.length / 2, 0], mass=handle_mass, rgba=[0.85, 0.35, 0.1, 1],
    )  # fmt: skip
    shaft = body.add_geom(
        name="shaft", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0, 0, (handle_start + tool.blade_height) / 2],
        size=[tool.shaft_radius, (handle_start - tool.blade_height) / 2, 0], mass=shaft_mass, rgba=[0.7, 0.7, 0.73, 1],
    )  # fmt: skip
    blade = body.add_geom(
        name="blade", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0, 0, tool.blade_height / 2],
        size=[width / 2, thickness / 2, tool.blade_height / 2], mass=blade_mass, rgba=[0.7, 0.7, 0.73, 1],
    )  # fmt: skip
    # a line on the handle shows in pictures that it turns
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=[tool.radius - 0.0006, 0, tool.middle], contype=0, conaffinity=0, mass=0,
        size=[0.001, 0.0015, tool.length / 2 + 0.0002], rgba=[0.98, 0.95, 0.85, 1],
    )  # fmt: skip
    rub(handle, friction.finger)
    rub(shaft, friction.tip, solimp=STEEL)
    rub(blade, friction.tip, solimp=STEEL)
    if tool.markers is not None:
        add_markers(spec, body, tool.markers, friction.finger)
