"""Torques of the drives, read back from a record, against MuJoCo's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigs.cells import PLAN, cell

from turnscrew.errors import RecordError
from turnscrew.plant.drive_work import DriveWork, read_drives
from turnscrew.robot.coupling import DRIVEN_INDEX
from turnscrew.robot.joints import DRIVEN
from turnscrew.task.record import Recorder
from turnscrew.task.scenario import load


@pytest.mark.parametrize("motors", [False, True])
def test_torques_and_speeds_are_those_of_the_simulation(motors: bool, tmp_path: Path) -> None:
    plant, rng = cell(motors=motors), np.random.default_rng(0)
    forces, speeds = [], []
    with Recorder(tmp_path, load()) as recorder:
        recorder.model(plant.xml)
        for step in range(60):
            if step % 10 == 0:
                # far enough that some drives reach their limits
                plant.write(rng.normal(size=len(DRIVEN)) + (0.0 if motors else PLAN.rolling(0.0)[DRIVEN_INDEX]))
            plant.prepare()
            recorder.step(plant.data)
            speeds.append(plant.data.qvel[DRIVEN_INDEX].copy())
            plant.step()
            forces.append(plant.data.actuator_force[: len(DRIVEN)].copy())
        recorder.step(plant.data)
    drives = read_drives(tmp_path)
    assert drives.dt == 0.001
    # the same arithmetic in another order, on torques of up to 160 N.m
    np.testing.assert_allclose(drives.tau, forces, atol=1e-10)
    np.testing.assert_array_equal(drives.v, speeds)


def test_work_counts_what_is_put_in_and_heat_what_is_held() -> None:
    # pushes for a second at 2 rad/s, is pushed back for another, then holds
    tau, v = np.full((3000, 24), 0.5), np.repeat([2.0, -2.0, 0.0], 1000)[:, None] * np.ones(24)
    drives = DriveWork(0.001, tau, v)
    assert drives.work == pytest.approx(np.full(24, 1.0))
    assert drives.heat == pytest.approx(np.full(24, 0.75))


def test_folder_without_a_run_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="holds no run"):
        read_drives(tmp_path)
