"""Markers and pictures of the cell; drawing is skipped, with its reason, where a machine cannot draw."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from rigs.cells import cell
from rigs.views import COLLAR, marked_cell, view

from turnscrew.errors import ModelError
from turnscrew.geometry.marker_board import Collar, Plates, collar_below
from turnscrew.plant.camera import SceneCamera
from turnscrew.plant.export import portable
from turnscrew.plant.markers import Markers
from turnscrew.show import gl

PLATES = Plates(0.018, 0.09)


@pytest.fixture(scope="module")
def drawing() -> None:
    reason = gl.why_not()
    if reason:
        pytest.skip(f"this machine cannot draw: {reason}")


def test_cell_without_markers_is_what_it_was() -> None:
    plain, watched = cell(), cell(camera=SceneCamera(view()))
    # a camera is no part of the model, and without markers nothing of theirs is either
    assert watched.xml == plain.xml
    assert not any(word in plain.xml for word in ('"collar"', '"plate0"', '"ink"', '"toner"'))
    tool = plain.model.body("tool").id
    names = [plain.model.geom(g).name for g in np.flatnonzero(plain.model.geom_bodyid == tool)]
    assert names == ["handle", "shaft", "blade", ""]


@pytest.mark.parametrize("board", [COLLAR, PLATES], ids=["collar", "plates"])
def test_markers_are_part_of_the_tools_mass_and_can_be_touched(board: Collar | Plates) -> None:
    model = marked_cell(board=board).model
    # the mass is summed from six-digit numbers
    assert model.body("tool").mass[0] == pytest.approx(0.08, rel=1e-5)
    on_tool = [model.geom(int(g)) for g in np.flatnonzero(model.geom_bodyid == model.body("tool").id)]
    carriers = [geom for geom in on_tool if geom.name.startswith(("collar", "plate"))]
    assert carriers
    assert all(geom.contype[0] and geom.conaffinity[0] and geom.condim[0] == 4 for geom in carriers)
    (ink,) = [geom for geom in on_tool if geom.name == "ink"]
    assert not ink.contype[0]
    assert not ink.conaffinity[0]


def test_a_fingertip_cannot_enter_the_collar() -> None:
    plant = marked_cell()
    pair = {plant.model.geom("collar").id, plant.model.geom("C_mfdistal").id}
    start = int(plant.model.joint("tool").qposadr[0])
    tip = plant.data.body("mfdistal").xpos
    # the tool is lifted until its collar is where the middle finger's tip is
    plant.data.qpos[start : start + 3] = tip - [0.015, 0.0, 0.055]
    mujoco.mj_forward(plant.model, plant.data)
    assert pair in [set(geoms) for geoms in plant.data.contact.geom.tolist()]


def test_marked_model_names_no_file_of_its_own_and_moves() -> None:
    plain, marked = cell(), marked_cell()
    text, assets = portable(marked.xml)
    assert assets.keys() == portable(plain.xml)[1].keys()
    moved = mujoco.MjModel.from_xml_string(text, assets)
    for name in ("body_mass", "body_inertia", "geom_pos", "geom_quat", "mesh_vert", "dof_invweight0"):
        assert np.array_equal(getattr(marked.model, name), getattr(moved, name)), name


def test_ink_lies_where_the_board_says() -> None:
    plant = marked_cell()
    model, ink = plant.model, plant.model.geom("ink").id
    mesh = int(model.geom_dataid[ink])
    first = int(model.mesh_vertadr[mesh])
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
    p_WT, R_WT = plant.tool_pose()
    p_T = (vertices @ plant.data.geom_xmat[ink].reshape(3, 3).T + plant.data.geom_xpos[ink] - p_WT) @ R_WT
    for corner in COLLAR.corners.reshape(-1, 3):
        # MJCF's six digits and single precision: under a micrometre
        assert np.linalg.norm(p_T - corner, axis=1).min() < 1e-6


def test_collar_that_finds_no_room_is_told() -> None:
    with pytest.raises(ModelError, match="needs 50 mm of shaft below the handle, which begins 40 mm above the tip"):
        collar_below(0.04)
    with pytest.raises(ModelError, match="where the board has 12 square markers"):
        Markers(COLLAR, np.zeros((3, 6, 6), dtype=bool))


def test_window_is_cut_from_the_whole(drawing: None) -> None:
    with marked_cell() as plant:
        whole = plant.picture(1700, 1000, 500, 400)
        part = plant.picture(1830, 1170, 150, 140)
    cut = whole[170:310, 130:280]
    off = np.abs(cut.astype(int) - part.astype(int)).max(axis=2)
    # samples on an edge may fall to either side: one of nine in a pixel, in few pixels
    assert np.mean(off > 2) < 0.01
    assert np.ptp(cut) > 100


def test_camera_opens_when_asked_and_closes(drawing: None) -> None:
    with pytest.raises(ModelError, match="the cell has no camera"):
        cell().picture(0, 0, 10, 10)
    plant = marked_cell()
    plant.close()
    first = plant.picture(1830, 1170, 150, 140)
    plant.close()
    plant.close()
    assert np.array_equal(plant.picture(1830, 1170, 150, 140), first)
    plant.close()
