"""Fiducial markers as geometry: black cells on a white collar or on white plates, so that the MJCF names no picture."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from turnscrew.errors import ModelError
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.marker_board import INK, Collar, MarkerBoard, Plates
from turnscrew.plant.contact import rub

PRINTED = 300.0
"""Density of collar and plates [kg/m3]: 3-D printed with thin walls, a quarter of solid plastic."""

WHITE, BLACK = (0.86, 0.86, 0.86, 1.0), (0.05, 0.05, 0.05, 1.0)
"""Reflectances of matt paper and of toner."""


@dataclass(frozen=True)
class Markers:
    """What is printed on the tool.

    Attributes:
        board: Where the markers are.
        cells: (n, k, k) which cells of each marker are white, black border included, row by row from the upper left.
    """

    board: MarkerBoard
    cells: NDArray[np.bool_]

    def __post_init__(self) -> None:
        count = len(self.board.ids)
        if self.cells.ndim != 3 or len(self.cells) != count or self.cells.shape[1] != self.cells.shape[2]:
            raise ModelError(f"markers: cells of shape {self.cells.shape}, where the board has {count} square markers")


def markers_mass(markers: Markers) -> float:
    """Mass of what carries the markers [kg]."""
    board = markers.board
    if isinstance(board, Collar):
        return PRINTED * float(np.sqrt(3.0) / 2.0 * board.across**2 * (board.top - board.bottom))
    return PRINTED * board.count * board.width**2 * board.thickness


def add_markers(spec: mujoco.MjSpec, body: mujoco.MjsBody, markers: Markers, friction: float) -> None:
    """Adds carrier and markers to the tool's body; the carrier can be touched, the ink only seen.

    Args:
        spec: The cell.
        body: The tool.
        markers: What to add.
        friction: Of fingers on the carrier.
    """
    # no highlights: they would wash a marker out as no matt print does
    spec.add_material(name="paper", rgba=WHITE, specular=0.0, shininess=0.0)
    spec.add_material(name="toner", rgba=BLACK, specular=0.0, shininess=0.0)
    board = markers.board
    carriers = [_add_collar(spec, body, board)] if isinstance(board, Collar) else _add_plates(body, board)
    for carrier in carriers:
        carrier.material = "paper"
        carrier.mass = markers_mass(markers) / len(carriers)
        rub(carrier, friction)
    vertices, faces = _ink(markers)
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.add_mesh(name="ink", uservert=vertices.ravel(), userface=faces.ravel(), inertia=shell)
    ink = body.add_geom(name="ink", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="ink", material="toner")
    ink.mass, ink.contype, ink.conaffinity = 0.0, 0, 0


def _add_collar(spec: mujoco.MjSpec, body: mujoco.MjsBody, collar: Collar) -> mujoco.MjsGeom:
    angles = np.pi / 3 * (np.arange(6) + 0.5)
    rim = collar.across / np.sqrt(3.0) * np.column_stack([np.cos(angles), np.sin(angles)])
    half = (collar.top - collar.bottom) / 2
    vertices = np.array([[x, y, z] for z in (-half, half) for x, y in rim])
    spec.add_mesh(name="collar", uservert=vertices.ravel())
    middle = [0.0, 0.0, (collar.top + collar.bottom) / 2]
    return body.add_geom(name="collar", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="collar", pos=middle)


def _add_plates(body: mujoco.MjsBody, plates: Plates) -> list[mujoco.MjsGeom]:
    geoms = []
    for index, corners in enumerate(plates.corners):
        out = corners.mean(axis=0) * [1.0, 1.0, 0.0]
        out /= np.linalg.norm(out)
        half_angle = np.arctan2(out[1], out[0]) / 2
        geoms.append(body.add_geom(name=f"plate{index}", type=mujoco.mjtGeom.mjGEOM_BOX))
        geoms[-1].pos = corners.mean(axis=0) - (INK + plates.thickness / 2) * out
        geoms[-1].quat = [np.cos(half_angle), 0.0, 0.0, np.sin(half_angle)]
        geoms[-1].size = [plates.thickness / 2, plates.width / 2, plates.width / 2]
    return geoms


def _ink(markers: Markers) -> tuple[Array, NDArray[np.int32]]:
    """Vertices (4m, 3) in T and triangles (2m, 3) of the m black cells, facing outwards."""
    k = markers.cells.shape[1]
    vertices = []
    for corners, cells in zip(markers.board.corners, markers.cells, strict=True):
        right, down = (corners[1] - corners[0]) / k, (corners[3] - corners[0]) / k
        for row, column in np.argwhere(~cells):
            corner = corners[0] + column * right + row * down
            vertices += [corner, corner + down, corner + down + right, corner + right]
    quads = 4 * np.arange(len(vertices) // 4)[:, None]
    faces = np.concatenate([quads + np.array([0, 1, 2]), quads + np.array([0, 2, 3])]).astype(np.int32)
    return np.array(vertices), faces
