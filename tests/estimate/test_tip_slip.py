from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from turnscrew.estimate.second_look import SecondLook
from turnscrew.estimate.tip_slip import TipSlip

DT = 0.01
HEIGHT, RADIUS = 0.125, 0.018
ANGLES = np.radians([180.0, 90.0, 0.0, -90.0, 45.0])
N_W = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(5)])
C_W = RADIUS * N_W + [0, 0, HEIGHT]
GOOD = TipSlip(direction_error=0.05)
LOOK = round(SecondLook().look / DT)
"""Ticks for which a jerk of the forces is left in doubt."""

TWO, FOUR = np.array([4.0, 0, 4.0, 0, 0]), np.array([4.0, 4.0, 4.0, 4.0, 0])


@dataclass
class Rig:
    """Fingertips that hold a tool at rest on its tip, and read with white noise."""

    block: TipSlip = GOOD
    squeeze: np.ndarray = field(default_factory=lambda: TWO.copy())
    seed: int = 0

    def __post_init__(self) -> None:
        self.state = self.block.init()
        self.rng = np.random.default_rng(self.seed)

    def tick(
        self, extra: np.ndarray | float = 0.0, seen: tuple[np.ndarray, np.ndarray] | None = None, moved: float = 0.0
    ) -> float:
        """Signal of one tick, with forces added to what the squeezes and 5 N of thrust are."""
        held = self.squeeze > 0
        f_W = -self.squeeze[:, None] * N_W - np.outer(held, [0, 0, 5.0 / held.sum()]) + extra
        f_W = f_W + self.rng.normal(0.0, 0.03, (5, 3))
        self.state, signal = self.block.update(
            self.state, f_W, C_W, N_W, np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0, seen, moved, DT
        )
        return signal

    def after(self, *extra: np.ndarray) -> float:
        """Largest signal of ticks with these forces, and until a jerk is no longer in doubt."""
        return max([self.tick(force) for force in extra] + [self.tick() for _ in range(LOOK)])

    def run(self, ticks: int) -> float:
        """Largest signal of a while."""
        return max(self.tick() for _ in range(ticks))


def push(*rows: int, force: tuple[float, float, float]) -> np.ndarray:
    extra = np.zeros((5, 3))
    extra[list(rows)] = force
    return extra


def test_threshold_is_walds() -> None:
    # three tests, each with an alarm in 3 x 1200 s on average: ln(3600 s / 10 ms)
    assert TipSlip(alarm_period=1200.0).threshold(0.01) == pytest.approx(np.log(360_000.0))


def test_white_noise_alone_stays_below_the_alarm() -> None:
    # a minute of ticks; the mean time between alarms is made for twenty
    assert Rig().run(6000) < 1.0


def test_squeezes_that_rise_and_fall_are_no_slip_even_when_read_crooked() -> None:
    rig = Rig(block=TipSlip())
    crooked = push(0, force=(0.0, 0.15, 0.15)) + push(2, force=(0.0, 0.1, -0.1))
    for tick in range(600):
        rig.squeeze = TWO * (1.0 + 0.5 * np.sin(2 * np.pi * tick / 100))
        assert rig.tick(crooked * rig.squeeze[:, None]) < 1.0


@pytest.mark.parametrize("force", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 2.0)], ids=["x", "y", "thrust lost"])
def test_a_jerk_of_the_tool_is_seen(force: tuple[float, float, float]) -> None:
    rig = Rig(squeeze=FOUR)
    rig.run(100)
    jerk = push(0, 1, 2, 3, force=tuple(np.array(force) / 4))  # type: ignore[arg-type]
    # a newton beside noise of sqrt(4) x .03 N and .15 N that a tip at rest may pass on: six sigma in force, and in
    # torque, which a newton at 125 mm makes where it does not act at the tip
    assert rig.after(jerk) >= 1.0


@pytest.mark.parametrize("squeeze", [TWO, FOUR], ids=["two", "four"])
def test_fingers_that_slip_against_each_other_are_seen_while_all_hold_firm(squeeze: np.ndarray) -> None:
    rig = Rig(squeeze=squeeze)
    rig.run(100)
    # three newtons that the opposite cancels, beside .3 N of ripple
    inward = push(0, force=(3.0, 0.0, 0.0)) + push(2, force=(-3.0, 0.0, 0.0))
    assert rig.after(inward, inward) >= 1.0


def test_fingers_that_are_taken_off_may_slide() -> None:
    rig = Rig(squeeze=FOUR)
    rig.run(100)
    for share in np.linspace(1.0, 0.4, 12):
        rig.squeeze = TWO + (FOUR - TWO) * share
        assert rig.tick() < 1.0
    # both that leave lose what was left of their hold at once: 1.6 N each, against each other
    rig.squeeze = TWO
    assert rig.after() < 1.0


def test_readings_that_turn_while_fingers_let_go_are_no_slip() -> None:
    found = []
    rough = TipSlip()
    for block in (replace(rough, turning=0.0), rough, GOOD):
        rig = Rig(block=block, squeeze=FOUR)
        rig.run(100)
        signals = []
        for share in np.linspace(1.0, 0.1, 18):
            rig.squeeze = TWO + (FOUR - TWO) * share
            # both that leave begin to slide at last: what they are read to press with turns by 40 deg, to one side
            side = 0.8 * 4.0 * share if share < 0.5 else 0.0
            signals.append(rig.tick(push(1, 3, force=(side, 0.0, 0.0))))
        rig.squeeze = TWO
        found.append(max(*signals, rig.after()))
    assert found[0] >= 1.0
    assert found[1] < 1.0
    # with readings that are good to 3 deg it would have been a force
    assert found[2] >= 1.0


def test_good_fingertips_see_what_rough_ones_excuse() -> None:
    evidence = []
    for block in (GOOD, replace(GOOD, direction_error=np.deg2rad(30.0))):
        rig = Rig(block=block, squeeze=FOUR)
        rig.run(100)
        # a finger jumps off by 2 N, which a reading turned by 30 deg makes .5 N of side force
        rig.squeeze = FOUR - [0, 2.0, 0, 0, 0]
        rig.tick(push(1, force=(0.6, 0.0, 0.0)))
        evidence.append(float(rig.state.g[:2].max()))
    assert evidence[1] < evidence[0]


@pytest.mark.parametrize(("noise", "frames"), [(0.0002, 3), (0.003, None)], ids=["good camera", "3 mm"])
def test_a_millimetre_shows_to_a_good_camera_only(noise: float, frames: int | None) -> None:
    rig, P = Rig(), noise**2 * np.eye(2)

    def frame(x: float) -> tuple[np.ndarray, np.ndarray]:
        # a constant error of the camera is no slip
        return np.array([0.002 + x, 0.001]) + rig.rng.normal(0.0, noise, 2), P

    assert max(rig.tick(seen=frame(0.0)) for _ in range(300)) < 1.0
    signals = [rig.tick(seen=frame(0.001)) for _ in range(3)]
    if frames is None:
        # a third of a sigma a frame
        assert max(signals) < 1.0
    else:
        # five sigma a frame
        assert signals[frames - 1] >= 1.0


def test_nothing_is_said_while_the_grip_builds_up() -> None:
    rig = Rig()
    rig.run(30)
    assert rig.tick(push(0, 2, force=(3.0, 0.0, 0.0))) == 0.0


def test_motion_adds_to_what_forces_say_and_takes_nothing_away() -> None:
    rig = Rig(squeeze=FOUR)
    rig.run(100)
    h = GOOD.threshold(DT)
    # white noise alone leaves the CUSUMs at zero
    assert rig.tick(moved=-10.0) == 0.0
    assert rig.tick(moved=0.6 * h) == pytest.approx(0.6)
    half = push(0, 1, 2, 3, force=(0.12, 0.0, 0.0))
    forces = replace(rig), rig.state
    alone = rig.after(half)
    rig.state = forces[1]
    assert rig.tick(half, moved=h) >= 1.0 > alone


def test_a_blade_that_meets_the_other_wall_is_no_slip() -> None:
    # a hop: for a tick the tip presses with next to nothing; afterwards the walls hold another torque, 30 mN.m of it
    hop, tangential = (
        push(0, 2, force=(0.0, 0.0, 2.4)),
        push(0, force=(0.0, 0.83, 0.0)) - push(2, force=(0.0, 0.83, 0.0)),
    )
    for after, slips in ((0.0 * tangential, True), (tangential, False)):
        rig = Rig()
        rig.run(100)
        found = max(rig.tick(hop), *(rig.tick(after) for _ in range(2 * LOOK)))
        assert (found >= 1.0) == slips


def test_a_faster_gait_moves_forces_more_before_they_alarm() -> None:
    evidence = []
    for haste in (1.0, 2.0):
        rig = Rig(block=replace(GOOD, haste=haste), squeeze=FOUR)
        rig.run(100)
        rig.tick(push(0, 1, 2, 3, force=(0.25, 0.0, 0.0)))
        evidence.append(float(rig.state.g[0]))
    assert evidence[1] < evidence[0]


def test_a_finger_that_lands_beside_firm_ones_jerks_them_by_no_more_than_it_presses() -> None:
    rig = Rig()
    rig.run(100)
    rig.squeeze = np.array([4.0, 2.0, 4.0, 0, 0])
    # what it brings is handed on to the others, half of it each
    shared = push(0, 2, force=(0.0, 1.0, 0.0))
    assert max(rig.tick(shared) for _ in range(LOOK + 2)) < 1.0
