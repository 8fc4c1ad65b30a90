"""The study of what makes the gait robust: one measure is taken out, and nothing else; tables, and a short run."""

from __future__ import annotations

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import duckdb
import numpy as np
import pytest
from rich.console import Console

from turnscrew.control.distribution import Distribution
from turnscrew.decide.gait_state import FF_RF, Phase
from turnscrew.decide.recovery import DeciderState
from turnscrew.errors import ScenarioError
from turnscrew.show.ablation_report import failures, report, worth_table
from turnscrew.study.ablation.measures import ALL, FIXED, MEASURES, Unguarded, Unrefined, chosen
from turnscrew.study.ablation.study import parts
from turnscrew.study.trials.trial import Trial
from turnscrew.task.fasten import Run
from turnscrew.task.scenario import load

SHORT = ("goal.time_limit=0.3",)
TORQUE = "robot.actuation=torque"


def measure(name: str):
    return next(measure for measure in MEASURES if measure.name == name)


def entry(without: str, seed: int, *, passed: bool) -> dict[str, object]:
    figures = dict.fromkeys(Trial.__dataclass_fields__, 1.0)
    told = {"outcome": "goal" if passed else "TOOL_DROPPED", "passed": passed, "rounds": 5 if passed else 1}
    return {**figures, **told, "phase": "roll", "seed": seed, "without": without}


def shown(table: object) -> str:
    console = Console(width=220, file=StringIO())
    console.print(table)
    return console.file.getvalue()


def test_without_refinement_the_tool_stands_as_the_camera_sees_it_with_its_tip_where_it_was_told() -> None:
    run = Run.begin(load(None, [], 7740), adapt=measure("refinement").without)
    assert isinstance(run.loop.blocks.estimator, Unrefined)
    while run.cell.time < 0.4:
        tick, _ = run.tick()
        run.advance(lambda: None)
    known, filtered = tick.estimate, run.state.estimator.filter
    np.testing.assert_array_equal(known.R_WT, known.R_WT_seen)
    # nothing has turned yet: the screw stands where it was said to, to what odometry has taken rolling noise for
    np.testing.assert_allclose(known.p_WT, run.loop.blocks.estimator.p_WS, atol=2e-5)
    np.testing.assert_array_equal(known.offset, 0.0)
    handle = run.loop.blocks.estimator.handle
    assert known.radius == pytest.approx(handle.meridian(0.5 * sum(handle.domain)).r)
    # the filter has learned meanwhile, and is not asked
    assert np.abs(filtered.b_W).max() > 1e-4
    # contacts are where kinematics and camera have them: gaps of touching fingers are off by millimetres
    assert np.abs(known.gap[known.touching]).max() > 3e-4


def test_unguarded_fingers_touch_when_they_should_have() -> None:
    blocks = Run.begin(load(None, [], 7741)).loop.blocks
    unguarded = measure("guarded contacts").without(blocks).decider
    assert isinstance(unguarded, Unguarded)
    run = Run.begin(load(None, [], 7741))
    tick, _ = run.tick()
    due = unguarded.gait.add + unguarded.gait.standoff / unguarded.gait.closing
    for touches in (False, True):
        estimate = replace(tick.estimate, touching=np.where(FF_RF, touches, [True, False, True, False, False]))
        for clock, joined in ((due - 0.02, False), (due + 0.02, True)):
            gait = replace(unguarded.gait.init(), phase=Phase.ADD, clock=clock)
            state, _ = unguarded.update(DeciderState(gait), estimate, (), 0.01)
            assert bool(state.gait.gripping[FF_RF].all()) is joined


def test_what_is_not_taken_away_stays() -> None:
    blocks = Run.begin(load(None, [], 7742)).loop.blocks
    assert ALL.without(blocks) is blocks
    sharing = blocks.controller.distribution
    assert isinstance(sharing, Distribution)
    assert measure("force integral").without(blocks).controller.distribution == replace(sharing, rate=0.0)
    fixed = measure("growing squeeze").without(blocks).controller.distribution
    assert fixed == replace(sharing, fixed=FIXED["position"])
    still = measure("re-centring").without(blocks).decider
    assert still == replace(blocks.decider, gait=replace(blocks.decider.gait, recentre=False))


def test_a_robot_that_takes_torques_squeezes_by_the_null_space_then() -> None:
    blocks = Run.begin(load(None, [TORQUE], 7742)).loop.blocks
    sharing = measure("growing squeeze").without(blocks).controller.distribution
    assert isinstance(sharing, Distribution)
    assert sharing.fixed == FIXED["torque"]
    assert sharing.rate == 0.0


def test_measures_are_chosen_by_name_among_those_that_the_robot_has() -> None:
    position, torque = load(None, []), load(None, [TORQUE])
    assert chosen(None, position) == MEASURES
    assert [each.name for each in chosen(["re-centring"], position)] == ["re-centring"]
    assert "force integral" not in [each.name for each in chosen(None, torque)]
    with pytest.raises(ScenarioError, match="--without luck: unknown; there are all measures, refinement"):
        chosen(["luck"], position)
    with pytest.raises(ScenarioError, match="--without force integral: unknown"):
        chosen(["force integral"], torque)


def test_table_tells_shares_and_why_trials_failed() -> None:
    entries = [entry("all measures", 1, passed=True), entry("all measures", 2, passed=True),
               entry("refinement", 1, passed=False), entry("refinement", 2, passed=True)]  # fmt: skip
    text = shown(worth_table(entries))
    assert "2/2" in text
    assert "1/2" in text
    assert failures(entries) == ["without refinement: 1 x TOOL_DROPPED: 1 (roll)"]


def test_a_short_study_makes_every_trial_without_every_measure(tmp_path: Path) -> None:
    measures = chosen(["all measures", "re-centring"], load(None, []))
    todo = parts(measures, SHORT, "standard", range(7743, 7745), tmp_path)
    assert len({part.file for part in todo}) == 4
    assert todo[0].scenario == todo[1].scenario
    report(todo, measures, 1, tmp_path, Console(width=200, file=StringIO()))
    rows = duckdb.sql(f"SELECT without, seed, outcome FROM '{tmp_path / 'ablation.parquet'}'").fetchall()
    assert sorted(rows) == [
        (name, seed, "TIMEOUT") for name in ("all measures", "re-centring") for seed in (7743, 7744)
    ]
    assert (tmp_path / "figures" / "ablation.png").stat().st_size > 10_000
    # what is on disk is not made again
    before = todo[0].file.stat().st_mtime_ns
    report(todo, measures, 1, tmp_path, Console(width=200, file=StringIO()))
    assert todo[0].file.stat().st_mtime_ns == before
    assert json.loads(todo[0].file.read_text())["without"] == "all measures"
