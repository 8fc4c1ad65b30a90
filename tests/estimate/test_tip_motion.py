"""The test for a slip of the tip by the fingers' motion."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from turnscrew.estimate.motion_steps import displaced, evidence
from turnscrew.estimate.tip_motion import HAND_JOINTS, TipMotion
from turnscrew.geometry.rotations import skew
from turnscrew.robot.model import Fingertips

DT, HEIGHT, RADIUS = 0.01, 0.125, 0.018
ANGLES = np.radians([180.0, 90.0, 0.0, -90.0, 45.0])
C_W = RADIUS * np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(5)]) + [0, 0, HEIGHT]
TWO, FOUR = np.array([4.0, 0, 4.0, 0, 0]), np.array([4.0, 4.0, 4.0, 4.0, 0])
BLOCK, P_WT, STILL = TipMotion(), np.zeros(3), np.zeros((3, 3))
NONE = np.zeros(5)


def jacobians() -> np.ndarray:
    """Each finger with three joints of its own, 30 mm from its contact, that move it along x, y and z."""
    J = np.zeros((5, 6, 28))
    for i in range(5):
        for j in range(3):
            J[i, j, HAND_JOINTS + 3 * i + j] = 0.03
    return J


@dataclass
class Rig:
    """Fingertips on a handle, read with the encoders' noise."""

    squeeze: np.ndarray = field(default_factory=lambda: FOUR.copy())
    S_hand: np.ndarray = field(default_factory=lambda: STILL)
    seed: int = 0

    def __post_init__(self) -> None:
        self.state, self.rng = BLOCK.init(), np.random.default_rng(self.seed)
        self.tips = Fingertips(C_W, np.tile(np.eye(3), (5, 1, 1)), jacobians(), np.full(5, 0.007), np.zeros(5))
        self.read = np.zeros((5, 3))

    def tick(self, moved: np.ndarray | float = 0.0, rolled: float = 0.0, slid: np.ndarray = NONE) -> float:
        """Evidence after a tick in which contacts moved so, the handle rolled by as much, and fingers slid [m]."""
        read = self.rng.normal(0.0, 0.03 * BLOCK.encoder, (5, 3))
        f_F = self.squeeze[:, None] * [0.0, 0.0, 1.0]
        self.state = BLOCK.update(
            self.state, self.tips, C_W, f_F, moved + read - self.read, slid, rolled, P_WT, np.eye(3), self.S_hand, DT
        )
        self.read = read
        return self.state.evidence

    def run(self, ticks: int) -> float:
        return max(self.tick() for _ in range(ticks))


def slip(t: tuple[float, float]) -> np.ndarray:
    """How contacts move when the tip is displaced by t and the tool tilts about their middle."""
    d = np.array([*t, 0.0])
    turn = np.array([t[1], -t[0], 0.0]) / HEIGHT
    return np.asarray(d + np.cross(turn, C_W))


def test_encoders_noise_alone_says_nothing() -> None:
    # a minute of ticks; the alarm is at twelve or so
    assert Rig().run(6000) < 6.0


@pytest.mark.parametrize("t", [(0.001, 0.0), (-0.0015, 0.0), (0.0007, 0.0007)])
def test_a_slip_of_a_millimetre_shows_with_four_fingers(t: tuple[float, float]) -> None:
    rig = Rig()
    rig.run(50)
    # contacts go up and down by .14 mm, beside .02 mm of noise and as much that no encoder tells
    assert rig.tick(slip(t)) > 12.8


def test_two_fingers_tell_along_their_line_alone() -> None:
    along, across = Rig(squeeze=TWO), Rig(squeeze=TWO)
    along.run(50)
    across.run(50)
    assert along.tick(slip((0.0015, 0.0))) > 12.8
    # a tool that tilts about the line of two fingers moves neither
    assert across.tick(slip((0.0, 0.0015))) < 3.0


def test_a_hand_that_moves_as_a_whole_is_no_slip_of_the_tip() -> None:
    doubtful = Rig(S_hand=0.0005**2 * np.eye(3))
    doubtful.run(50)
    # half a millimetre that the arm's encoders may have made up, and the same along z
    assert doubtful.tick(np.full((5, 3), 0.0005)) < 1.0


def test_a_finger_that_slides_is_no_slip_of_the_tip() -> None:
    rig = Rig()
    rig.run(50)
    # one of four, down by .4 mm: no rigid tool moves so, and what is left of the fit makes all doubtful
    assert rig.tick(np.outer(np.eye(5)[0], [0.0, 0.0, -0.0004])) < 6.0
    going = Rig()
    going.run(50)
    for share in (0.8, 0.5, 0.4):
        going.squeeze = FOUR * [share, 1.0, 1.0, 1.0, 1.0]
        found = going.tick(np.outer(np.eye(5)[0], [0.0, 0.0, -0.0004]) * (share < 0.6))
    # it lets go before it slides, and is not asked then
    assert found < 1.0


def test_one_of_two_fingers_that_is_felt_to_slide_is_no_slip_of_the_tip() -> None:
    down, way = np.outer(np.eye(5)[0], [0.0, 0.0, -0.0004]), 0.0004 * np.eye(5)[0]
    unaware, aware = Rig(squeeze=TWO), Rig(squeeze=TWO)
    unaware.run(50)
    aware.run(50)
    # what is left of the fit tells nothing: a tool that tilts by so much would move the two contacts likewise
    assert unaware.tick(down) > 12.8
    assert aware.tick(down, slid=way) < 0.0
    # what it tells across the handle still counts
    slipping = Rig()
    slipping.run(50)
    assert slipping.tick(slip((0.0015, 0.0)), slid=0.5 * way) > 12.8


def test_a_slip_is_forgotten() -> None:
    rig = Rig()
    rig.run(50)
    first = rig.tick(slip((0.001, 0.0)))
    # after five memories exp(-5) is left of it
    rig.run(100)
    assert rig.state.evidence < 0.0 < first


def test_displacement_is_a_weighted_least_squares() -> None:
    rng = np.random.default_rng(1)
    way, J = 1e-4 * rng.normal(size=(5, 3)), rng.normal(size=(5, 6, 28))
    held, p_WF, encoder, floor = np.array([1.0, 0.0, 0.5, 0.3, 0.0]), C_W + 0.01 * rng.normal(size=(5, 3)), 4e-4, 2e-5
    slid, axis = 3e-4 * rng.random(5), np.array([0.0, 0.6, 0.8])
    found = displaced(way, held, C_W, p_WF, J, P_WT, HAND_JOINTS, encoder, floor, slid, axis, 5e-4, 0.02, 0.02, DT)
    N, g, square = np.diag([0.0, 0.0, 5e-4**-2, *[0.02**-2] * 3]), np.zeros(6), 0.0
    for i in (0, 2, 3):
        point = (J[i, :3] - skew(C_W[i] - p_WF[i]) @ J[i, 3:])[:, HAND_JOINTS:]
        S = encoder**2 * (1.0 + DT / held[i]) * point @ point.T + floor**2 * np.eye(3)
        W = np.linalg.inv(S + slid[i] ** 2 * np.outer(axis, axis))
        B = np.hstack([np.eye(3), -skew(C_W[i])])
        N, g, square = N + B.T @ W @ B, g + B.T @ W @ way[i], square + float(way[i] @ W @ way[i])
    x = np.linalg.solve(N, g)
    # the matrix's condition is 1e8 or so
    np.testing.assert_allclose(found.d, x[:2], rtol=1e-6)
    np.testing.assert_allclose(found.S, np.linalg.inv(N)[:2, :2], rtol=1e-6)
    assert found.misfit == pytest.approx((square - g @ x) / 4, rel=1e-6)
    assert found.number == 3


def test_evidence_is_a_ratio_of_two_gaussians() -> None:
    d, S, along = np.array([0.4, -0.3]), np.array([[0.2, 0.05], [0.05, 0.3]]), np.array([0.6, 0.8])
    T = S + 0.25 * np.eye(2) + (4.0 - 0.25) * np.outer(along, along)

    def log_density(C: np.ndarray) -> float:
        return float(-0.5 * (d @ np.linalg.solve(C, d) + np.log(np.linalg.det(C))))

    # rounding; a direction that is not of unit length is taken as one
    assert evidence(d, S, 3.0 * along, 2.0, 0.5) == pytest.approx(log_density(T) - log_density(S), rel=1e-12)


def test_a_rougher_encoder_says_less() -> None:
    rough, rig = replace(BLOCK, encoder=4.0 * BLOCK.encoder), Rig()
    rig.run(50)
    before, moved = rig.state, slip((0.001, 0.0))
    f_F = rig.squeeze[:, None] * [0.0, 0.0, 1.0]
    sharp = BLOCK.update(before, rig.tips, C_W, f_F, moved, NONE, 0.0, P_WT, np.eye(3), STILL, DT)
    blunt = rough.update(before, rig.tips, C_W, f_F, moved, NONE, 0.0, P_WT, np.eye(3), STILL, DT)
    assert blunt.evidence < 0.5 * sharp.evidence


def test_what_the_blade_s_play_allows_is_no_slip() -> None:
    tight = replace(BLOCK, play=0.0)
    rig = Rig()
    rig.run(50)
    f_F, found = rig.squeeze[:, None] * [0.0, 0.0, 1.0], []
    for block in (tight, BLOCK):
        for t in ((0.0, BLOCK.play), (0.001, 0.0)):
            state = block.update(rig.state, rig.tips, C_W, f_F, slip(t), NONE, 0.0, P_WT, np.eye(3), STILL, DT)
            found.append(state.evidence)
    # a slip of a millimetre stays one beside play of a fifth of it
    assert found[2] < 0.8 * found[0]
    assert found[3] > 12.8


def test_a_handle_that_has_rolled_far_tells_less() -> None:
    still, rolling = Rig(), Rig()
    for _ in range(50):
        still.tick()
        # as in a fast roll: 2 rad/s on 18 mm
        rolling.tick(rolled=0.00036)
    assert rolling.tick(slip((0.001, 0.0))) < still.tick(slip((0.001, 0.0)))


def test_a_finger_that_joins_others_has_strayed_as_they_have() -> None:
    rig, alike = Rig(squeeze=FOUR * [1.0, 0.0, 1.0, 0.0, 0.0]), np.full((5, 3), 0.0005)
    rig.run(50)
    # the hand is read wrong by half a millimetre, and no longer so when a finger has joined: no finger has moved
    rig.tick(alike)
    rig.squeeze = FOUR
    rig.run(1)
    rig.tick(-alike)
    assert np.abs(rig.state.way[:4]).max() < 1.5e-4
