"""Drives that hear nothing."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from rigs.cells import cell

from turnscrew.plant.cell import Cell
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import DRIVEN
from turnscrew.robot.watchdog import STIFFNESS

WRISTS = [row for row, joint in enumerate(DRIVEN) if joint.startswith("WR")]


def told_once(plant: Cell, seconds: float, excess: np.ndarray) -> np.ndarray:
    """How far the joints (24,) have gone a while after drives were told to carry the load, and `excess` more."""
    mujoco.mj_forward(plant.model, plant.data)
    plant.data.qvel[:] = 0.0
    told = plant.data.qfrc_bias[DRIVEN_INDEX] + excess
    before = plant.q[DRIVEN_INDEX]
    plant.write(told)
    for _ in range(round(seconds * 1000)):
        plant.prepare()
        plant.step()
    return plant.q[DRIVEN_INDEX] - before


@pytest.mark.parametrize("row", WRISTS)
def test_a_drive_that_hears_nothing_holds_its_joint_against_what_is_too_much(row: int) -> None:
    excess = np.zeros(len(DRIVEN))
    excess[row] = 0.5
    held = told_once(cell(motors=True, patience=4), 0.5, excess)[row]
    loose = told_once(cell(motors=True), 0.5, excess)[row]
    # at rest the spring takes the excess; .2 of it is what fingers that fall meanwhile change of the load
    assert held == pytest.approx(0.5 / STIFFNESS[row], rel=0.2)
    assert loose > 5.0 * held


def test_a_drive_waits_before_it_holds_and_is_told_again() -> None:
    plant = cell(motors=True, patience=4)
    told = np.full(len(DRIVEN), 0.01)
    plant.write(told)
    for step in range(8):
        plant.prepare()
        # where it begins to hold, only speeds are braked
        assert (plant.data.ctrl[: len(DRIVEN)] == told).all() == (step < 4)
        plant.step()
    plant.write(told)
    plant.prepare()
    assert (plant.data.ctrl[: len(DRIVEN)] == told).all()


def test_what_is_sent_to_drives_that_do_not_hear_is_lost() -> None:
    plant = cell()
    plant.write(np.full(len(DRIVEN), 0.1))
    plant.drives.hears = False
    plant.write(np.full(len(DRIVEN), 0.2))
    assert (plant.data.ctrl[: len(DRIVEN)] == 0.1).all()
    plant.drives.hears = True
    plant.write(np.full(len(DRIVEN), 0.3))
    assert (plant.data.ctrl[: len(DRIVEN)] == 0.3).all()
