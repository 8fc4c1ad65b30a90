"""Plans are continuous from phase to phase, survive their file, and refuse files that are not theirs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from turnscrew.decide.plan import GaitPlan, between
from turnscrew.decide.plan_file import DECIMALS, from_json, load, save, to_json
from turnscrew.decide.plans import plan_for
from turnscrew.errors import PlanError
from turnscrew.robot.joints import COUPLED, INDEX, finger_joints


@pytest.fixture(scope="module")
def plan() -> GaitPlan:
    return plan_for(0.018)


def test_phases_join(plan: GaitPlan) -> None:
    joints = (
        (plan.rolling(1.0), plan.adding(0.0)),
        (plan.adding(1.0), plan.leaving(0.0)),
        (plan.leaving(1.0), plan.relocating(0.0)),
        (plan.relocating(1.0), plan.returning(0.0)),
        (plan.returning(1.0), plan.adding(1.0, rolled=0.0)),
        (plan.adding(0.0, rolled=0.0), plan.rolling(0.0)),
    )
    for end, start in joints:
        # the same numbers, blended with weights 0 and 1
        np.testing.assert_allclose(end, start, atol=1e-15)


def test_postures_keep_the_coupling_and_the_arm(plan: GaitPlan) -> None:
    for q in (plan.rolling(0.3), plan.adding(0.5), plan.relocating(0.7)):
        assert all(q[INDEX[follower]] == q[INDEX[leader]] for follower, leader in COUPLED.items())
        np.testing.assert_array_equal(q[:6], plan.arm)


def test_support_fingers_do_not_move_while_the_others_roll(plan: GaitPlan) -> None:
    support = [*finger_joints("FF"), *finger_joints("RF")]
    np.testing.assert_array_equal(plan.rolling(0.0)[support], plan.rolling(1.0)[support])


def test_between_is_linear_and_stops_at_its_ends() -> None:
    rows = np.array([[0.0, 0.0], [1.0, 2.0], [1.0, 6.0]])
    # exact in binary
    np.testing.assert_array_equal(between(rows, 0.25), [0.5, 1.0])
    np.testing.assert_array_equal(between(rows, 0.75), [1.0, 4.0])
    np.testing.assert_array_equal(between(rows, -1.0), rows[0])
    np.testing.assert_array_equal(between(rows, 2.0), rows[-1])
    np.testing.assert_array_equal(between(rows[:1], 0.5), rows[0])


def test_file_holds_the_whole_plan(plan: GaitPlan, tmp_path: Path) -> None:
    path = tmp_path / "new" / "plan.json"
    save(plan, path)
    again = load(path)
    assert again.handle == plan.handle
    assert again.command == plan.command
    assert dict(again.contact_heights) == dict(plan.contact_heights)
    # the digits that the file keeps
    digits = 0.5 * 10.0**-DECIMALS
    for s in (0.0, 0.4, 1.0):
        np.testing.assert_allclose(again.rolling(s), plan.rolling(s), atol=digits)
        np.testing.assert_allclose(again.relocating(s), plan.relocating(s), atol=digits)
    assert to_json(again) == to_json(plan)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": 2}', "not json", '{"format": 2, "handle": 3}'])
def test_text_that_is_no_plan_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(PlanError, match=r"^here: not a gait plan .*$"):
        from_json(text, "here")


def test_other_format_is_refused(plan: GaitPlan) -> None:
    content = json.loads(to_json(plan)) | {"format": 99}
    with pytest.raises(PlanError, match="plan format 99"):
        from_json(json.dumps(content), "here")


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"nowhere\.json"):
        load(tmp_path / "nowhere.json")
