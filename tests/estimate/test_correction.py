from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rigs.estimation import HANDLE, P_WS, ROBOT, contact, gait

from turnscrew.estimate.correction import PATIENCE, Correction, Corrector
from turnscrew.estimate.filter_state import FilterState, Prior
from turnscrew.estimate.handle_contacts import capsules_of
from turnscrew.estimate.tool_filter import ToolFilter
from turnscrew.estimate.trail import Pose, Seen
from turnscrew.geometry.rotations import exp_so3, log_so3
from turnscrew.robot.model import Fingertips

FOUR = next(t for t in gait(1) if t.phase == "four" and np.all(np.linalg.norm(t.f_F[:4], axis=1) > 4.9))
FORCE = np.linalg.norm(FOUR.f_F, axis=1)
TIPS = ROBOT.fingertips(FOUR.q)
P_FRAME = np.diag([0.003**2] * 3 + [np.deg2rad(2.0) ** 2] * 3)


def sure() -> FilterState:
    """After some seconds: half a degree, half a millimetre."""
    prior = Prior(np.deg2rad(0.5), 0.0005, (0.0005, 0.0005, 0.0005), 1e-4, 0.002, None, 1e-4)
    return prior.state(P_WS, FOUR.R_WT, FOUR.q)


def correct(state: FilterState, seen: Seen | None, tips: Fingertips = TIPS, refused: int = 0) -> Correction:
    corrector = Corrector(HANDLE, ToolFilter(indentation=16e-6, alike=1.0))
    return corrector.apply(state, seen, P_WS, tips, capsules_of(tips), FORCE > 0.0, FORCE, refused)


def frame(turn: np.ndarray, shift: np.ndarray | float = 0.0) -> Seen:
    return Seen(Pose(P_WS + shift, exp_so3(turn) @ FOUR.R_WT), P_FRAME)


def tilt(state: FilterState) -> float:
    return float(np.degrees(np.linalg.norm(log_so3(FOUR.R_WT @ state.R_WT.T)[:2])))


def test_contacts_are_met_however_the_tool_was_believed_to_lean() -> None:
    state = replace(Prior().state(P_WS, FOUR.R_WT, FOUR.q), R_WT=exp_so3(np.array([0.05, -0.04, 0.0])) @ FOUR.R_WT)
    # angles, radius and screw known: what is left is the pose
    P = state.P.copy()
    P[6:], P[:, 6:] = 0.0, 0.0
    done = correct(replace(state, P=P), None)
    assert done.contacts == (0, 1, 2, 3)
    assert done.steps > 1
    gaps = [contact(TIPS, i, done.state.p_WT, done.state.R_WT).gap for i in range(4)]
    # .08 mm deep at 5 N; a contact weighs .3 mm against a doubt of 7 mm, so .02 mm of the 8 mm are left to the belief
    np.testing.assert_allclose(gaps, -16e-6 * FORCE[:4], atol=6e-5)
    # and 3.7 deg become .1: .3 mm at 130 mm
    assert tilt(done.state) < 0.15


def test_one_step_does_where_the_belief_is_good() -> None:
    assert correct(sure(), frame(np.array([0.01, 0.0, 0.0]))).steps == 1


def test_flipped_frames_are_refused_and_leave_no_trace() -> None:
    state, refused = sure(), 0
    for _ in range(5):
        done = correct(state, frame(np.array([np.deg2rad(30.0), 0.0, 0.0])), refused=refused)
        assert done.vision is False
        assert not done.restarted
        state, refused = done.state, done.refused
    assert refused == 5
    # contacts at their depth pull by nothing
    assert tilt(state) < 0.02
    done = correct(state, frame(np.array([0.01, 0.0, 0.0])), refused=refused)
    assert done.vision is True
    assert done.refused == 0


def test_a_camera_that_insists_is_believed() -> None:
    state, refused = sure(), 0
    for tries in range(1, PATIENCE + 1):
        done = correct(state, frame(np.array([np.deg2rad(30.0), 0.0, 0.0])), refused=refused)
        state, refused = done.state, done.refused
        assert done.restarted == (tries == PATIENCE)
    assert refused == 0
    # the pose was taken anew, with the prior's doubt, and its contacts may have moved it since
    assert tilt(state) > 5.0
    # what does not change with the pose is kept, within its doubt
    np.testing.assert_allclose(state.offset, sure().offset, atol=0.002)


@pytest.mark.parametrize("finger", range(4))
def test_a_finger_that_is_not_where_it_touches_is_left_out(finger: int) -> None:
    point = contact(TIPS, finger, P_WS, FOUR.R_WT)
    p_WF = TIPS.p_WF.copy()
    p_WF[finger] += 0.010 * point.n_W
    done = correct(sure(), None, replace(TIPS, p_WF=p_WF))
    # 10 mm against 1.2 mm of the belief, most of it .5 deg at 130 mm
    assert done.contacts == tuple(i for i in range(4) if i != finger)


def test_no_contact_is_no_trouble() -> None:
    corrector = Corrector(HANDLE)
    nobody = np.zeros(5, dtype=bool)
    done = corrector.apply(sure(), None, P_WS, TIPS, capsules_of(TIPS), nobody, FORCE, 0)
    assert done.contacts == ()
    assert done.steps == 0
    assert done.tip
