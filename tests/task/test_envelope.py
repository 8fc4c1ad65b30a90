"""The envelope of the shipped plans: what stands in it, its laws, what is said of wrong input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from turnscrew.contact.envelope import Gains, Verdict
from turnscrew.decide.plans import plan_for
from turnscrew.errors import ScenarioError
from turnscrew.robot.model import RobotModel
from turnscrew.task.envelope import Envelope, Grip, at, binding, conditions, envelope
from turnscrew.task.scenario import load
from turnscrew.task.seating import SIZES, seated_by


@pytest.fixture(scope="module")
def found() -> Envelope:
    return envelope(load(), angles=5)


def of(grip: Grip, friction: float = 0.8, most: float = 12.0, radius: float = 0.018) -> float:
    scenario = load(None, [f"contact.finger_friction={friction}"])
    return at(plan_for(radius), RobotModel(), conditions(scenario, most), grip, 0.5).steady.torque


def test_every_grasp_is_there_at_every_angle(found: Envelope) -> None:
    for grip in Grip:
        angles = [moment.angle for moment in found.of(grip)]
        np.testing.assert_allclose(angles, np.linspace(0.0, found.stroke, 5))
        assert found.weakest(grip).steady.torque == min(moment.steady.torque for moment in found.of(grip))


def test_four_fingers_seat_an_m3_and_two_do_not(found: Envelope) -> None:
    sizes = {grip: seated_by(found.weakest(grip).steady.torque) for grip in Grip}
    assert {grip: size.name for grip, size in sizes.items() if size} == {
        Grip.ROLLING: "M2", Grip.HOLDING: "M2", Grip.ALL: "M3"
    }  # fmt: skip


def test_what_binds_is_named_and_shared_out(found: Envelope) -> None:
    for moment in found.moments:
        shares = [limit.share for limit in moment.limits]
        assert shares == sorted(shares, reverse=True)
        # what is left out is below a hundredth each, of two dozen limits that seldom bind at all
        assert 0.95 < sum(shares) <= 1.0 + 1e-9


@pytest.mark.parametrize("grip", list(Grip))
def test_more_friction_and_squeeze_never_give_less(grip: Grip) -> None:
    assert of(grip, 0.6) < of(grip, 0.8) < of(grip, 1.0)
    assert of(grip, most=6.0) < of(grip, most=9.0) <= of(grip, most=30.0)


@pytest.mark.parametrize("grip", list(Grip))
def test_fatter_handles_give_more(grip: Grip) -> None:
    # where the squeeze binds; postures differ from plan to plan, and so do the drives' levers
    torques = [of(grip, most=8.0, radius=radius) for radius in (0.010, 0.012, 0.015, 0.018)]
    assert torques == sorted(torques)


def test_a_pair_gives_no_more_than_two_opposed_contacts_could() -> None:
    # the tool's 80 g help to press the tip
    side = (5.0 - 0.08 * 9.81) / 2
    for grip in (Grip.ROLLING, Grip.HOLDING):
        assert of(grip, 0.8, 8.0) <= 2 * 0.018 * np.sqrt((0.8 * 8.0) ** 2 - side**2)


def test_with_a_large_squeeze_a_drive_binds() -> None:
    plan, robot = plan_for(0.018), RobotModel()
    moment = at(plan, robot, conditions(load(), 60.0), Grip.ROLLING, 0.5)
    names = [limit.name for limit in moment.limits]
    assert not any("squeeze" in name for name in names)
    assert any(name.startswith(("MFJ", "THJ")) for name in names)


def test_a_limit_is_named_by_its_gain() -> None:
    plan, robot = plan_for(0.018), RobotModel()
    steady = at(plan, robot, conditions(load()), Grip.ROLLING, 0.5).steady
    drives = np.zeros(24)
    drives[3] = 0.3
    gains = Gains(np.array([0.0, 0.1]), np.zeros(2), drives, 0.0, 0.001)
    limits = binding(replace(steady, gains=gains), ("TH", "MF"))
    assert [limit.name for limit in limits] == ["WAMJ4", "MF friction"]
    assert binding(replace(steady, gains=gains, verdict=Verdict.HELPLESS), ("TH", "MF")) == ()


@pytest.mark.parametrize("most", [0.0, -1.0, float("nan"), float("inf")])
def test_a_squeeze_that_is_no_force_is_refused(most: float) -> None:
    with pytest.raises(ScenarioError, match=r"largest squeeze .* above 0 N"):
        conditions(load(), most)


def test_seating_torques_grow_with_the_screw() -> None:
    torques = [size.seating_torque for size in SIZES]
    assert torques == sorted(torques)
    # .2 x 3 mm x .75 x 225 MPa x 5.03 mm2 = .509 N.m, and the scenario's M4
    assert torques[1] == pytest.approx(0.509, abs=5e-4)
    assert torques[2] == pytest.approx(load().screw.thread.seat_torque, rel=0.01)


def test_the_largest_screw_that_a_torque_seats() -> None:
    assert seated_by(0.1) is None
    for size, larger in zip(SIZES, [*SIZES[1:], None], strict=True):
        assert seated_by(size.seating_torque) is size
        if larger is not None:
            assert seated_by(0.999 * larger.seating_torque) is size
