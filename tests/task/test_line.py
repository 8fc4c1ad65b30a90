"""The line between controller and drives."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.task.line import Line
from turnscrew.task.scenario import load


@pytest.mark.parametrize("periods", [0, 1, 5])
def test_commands_arrive_in_order_and_so_many_periods_late(periods):
    line, sent, arrived = Line(periods), (), []
    for number in range(12):
        sent, due = line.update(sent, np.array([float(number)]))
        arrived.append(due[0])
        assert len(sent) == periods
    assert arrived == [max(number - periods, 0) for number in range(12)]


@pytest.mark.parametrize(
    ("overrides", "periods"),
    [
        ([], 0),
        (["robot.actuation=torque", "robot.delay=0.006"], 3),
        (["robot.actuation=torque", "robot.delay=0.0071"], 4),
        (["robot.delay=0.02"], 2),
    ],
)
def test_a_delay_is_so_many_control_periods(overrides, periods):
    assert load(None, overrides).delay_periods == periods


@pytest.mark.parametrize(
    ("overrides", "steps"),
    [
        ([], None),
        (["robot.actuation=torque"], 4),
        (["robot.actuation=torque", "robot.watchdog=5"], 10),
        (["robot.actuation=torque", "rate.torque=100"], 20),
        (["robot.actuation=torque", "robot.watchdog=0"], None),
    ],
)
def test_drives_wait_for_so_many_control_periods(overrides, steps):
    assert load(None, overrides).patience == steps
