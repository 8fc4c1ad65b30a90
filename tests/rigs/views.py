"""Cells with markers and a camera, posed along a round; run as a script, it draws the pictures of the tests anew."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
from rigs.cells import PLAN, cell

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.marker_board import MarkerBoard, collar_below
from turnscrew.geometry.pinhole import CameraPose, Pinhole, looking_at
from turnscrew.geometry.rotations import exp_so3, quaternion_from_matrix
from turnscrew.plant.camera import SceneCamera
from turnscrew.plant.cell import Cell
from turnscrew.plant.markers import Markers
from turnscrew.plant.tool import Tool
from turnscrew.sense.fiducials import Fiducials
from turnscrew.sense.lens import Calibration

PICTURES = Path(__file__).parents[1] / "sense" / "pictures"
COLLAR = collar_below(0.075)
SMALL = Pinhole((1920.0, 1920.0), (198.5, -41.5), (400, 300))
"""A piece of the camera's image that shows the collar and what is around it."""


def view(distance: float = 0.65) -> CameraPose:
    """The default scenario's camera."""
    return looking_at(PLAN.centre, distance, np.radians(75.0), np.radians(-20.0))


def marked_cell(
    distance: float = 0.65, board: MarkerBoard = COLLAR, dictionary: str = "4X4_50", pinhole: Pinhole | None = None
) -> Cell:
    """A cell whose tool carries markers, with the default scenario's camera."""
    tool = Tool(0.018, 0.1, 0.125, 0.08, markers=Markers(board, Fiducials(dictionary).cells(board.ids)))
    camera = SceneCamera(view(distance)) if pinhole is None else SceneCamera(view(distance), pinhole)
    return cell(tool=tool, camera=camera)


def place(plant: Cell, q: Array, p_WT: Array, R_WT: Array) -> None:
    """Puts hand and tool somewhere, without physics."""
    plant.data.qpos[: len(q)] = q
    start = int(plant.model.joint("tool").qposadr[0])
    plant.data.qpos[start : start + 7] = *p_WT, *quaternion_from_matrix(R_WT)
    mujoco.mj_kinematics(plant.model, plant.data)
    mujoco.mj_camlight(plant.model, plant.data)


def pose_in_round(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Posture, p_WT and R_WT somewhere in a round, the tool tilted and misplaced as in a poor run."""
    s = rng.uniform()
    q = [PLAN.rolling, PLAN.adding, PLAN.leaving, PLAN.relocating, PLAN.returning][rng.integers(5)](s)
    tilt = exp_so3(rng.normal(0.0, np.radians(1.5), 3) * [1.0, 1.0, 0.0])
    yaw = exp_so3(np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)]))
    return q, PLAN.p_WS + rng.normal(0.0, 0.001, 3), tilt @ yaw


@cache
def shipped() -> dict[str, tuple[Array, Array]]:
    """True p_WT and R_WT of each shipped picture, by file name."""
    truth = tomllib.loads((PICTURES / "truth.toml").read_text(encoding="utf-8"))
    return {name: (np.array(pose["p_WT"]), np.array(pose["R_WT"])) for name, pose in truth.items()}


def draw(folder: Path) -> None:
    """Draws the shipped pictures: four of a collar in use, one with another dictionary's markers, one without any."""
    import cv2

    from turnscrew.sense.calibration_file import write_calibration
    from turnscrew.sense.photograph import Photograph

    rng = np.random.default_rng(5)
    calibration = Calibration(view(), SMALL)
    write_calibration(calibration, folder / "calibration.toml")
    truth = ""
    names = {"collar0": "4X4_50", "collar1": "4X4_50", "collar2": "4X4_50", "collar3": "4X4_50", "other": "5X5_50"}
    for name, dictionary in names.items():
        with marked_cell(dictionary=dictionary, pinhole=SMALL) as plant:
            q, p_WT, R_WT = pose_in_round(rng)
            place(plant, q, p_WT, R_WT)
            picture = plant.picture(*calibration.needed(SMALL.image))
        grey = calibration.bent(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), SMALL.image)
        cv2.imwrite(str(folder / f"{name}.png"), Photograph().taken(grey, np.zeros(2), rng))
        truth += f'["{name}.png"]\np_WT = {p_WT.tolist()}\nR_WT = {R_WT.tolist()}\n'
    (folder / "truth.toml").write_text(truth, encoding="utf-8")


if __name__ == "__main__":
    draw(PICTURES)
