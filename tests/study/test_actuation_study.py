"""The study of actuation: conditions, figures of a run, tables, and a short run of it."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path

import duckdb
import numpy as np
import pytest
from rich.console import Console

from turnscrew.errors import ScenarioError
from turnscrew.plant.drive_work import DriveWork
from turnscrew.show.actuation_report import force_table, lost, report, savings, task_table
from turnscrew.study.actuation.conditions import CONDITIONS, arms, chosen_arms, chosen_conditions
from turnscrew.study.actuation.figures import figures_of, read_figures, slips, travelled
from turnscrew.study.actuation.study import RunRow, load_trace, parts
from turnscrew.study.actuation.trace import Trace
from turnscrew.study.parts import finish
from turnscrew.task.fasten import fasten
from turnscrew.task.scenario import load

IDLE = DriveWork(0.001, np.zeros((2, 24)), np.zeros((2, 24)))
SHORT = ("goal.time_limit=1.2", "force.noise=0.05", "force.direction_noise=0.05")


def trace_of(n: int = 300, **changes: np.ndarray) -> Trace:
    """Ticks of 10 ms at which TH and MF press with 5 N; nothing moves."""
    pressed = np.zeros((n, 5))
    pressed[:, [0, 2]] = 5.0
    rest = {
        "time": 0.01 * np.arange(n), "round": np.zeros(n), "theta": np.zeros(n), "tilt": np.zeros(n),
        "tip_slip": np.zeros(n), "tip_error": np.zeros(n), "rolling": np.ones(n, dtype=bool), "touching": pressed > 0.0,
        "pressed": pressed, "asked": np.where(pressed > 0.0, 4.0, np.nan), "sliding": np.zeros((n, 5, 3)),
    }  # fmt: skip
    return Trace(**{**rest, **changes})


def entry(
    condition: str, arm: str, seed: int, pressed: float, *, holds: bool = True, count: int = 0
) -> dict[str, object]:
    figures = dict.fromkeys((field for field in RunRow.__dataclass_fields__), 1.0)
    told = {"outcome": "goal" if holds else "TOOL_DROPPED", "holds": holds, "rounds": 5 if holds else 2}
    label = {"condition": condition, "arm": arm, "seed": seed, "pressed": pressed, "slips": count}
    return {**figures, **told, **label, "named": {}, "pushes": []}


def shown(table: object) -> str:
    console = Console(width=220, file=StringIO())
    console.print(table)
    return console.file.getvalue()


def test_friction_is_less_than_believed_and_the_belief_is_kept() -> None:
    plain = load(None, ["contact.finger_friction=0.9", "model.friction_error=0.1"])
    for condition in CONDITIONS:
        changed = load(None, ["contact.finger_friction=0.9", "model.friction_error=0.1", *condition.overrides(plain)])
        believed = changed.contact.finger_friction * (1.0 + changed.model.friction_error)
        assert believed == pytest.approx(0.99)
        assert changed.contact.finger_friction == pytest.approx(0.9 * condition.friction)
        assert changed.model.mass_error == condition.mass_error


def test_forces_are_averaged_over_the_time_that_a_finger_holds() -> None:
    pressed = np.zeros((300, 5))
    pressed[:100, 0], pressed[:, 2], pressed[200:, 3] = 2.0, 8.0, 0.2
    found = figures_of(trace_of(pressed=pressed), IDLE)
    # .2 N hold nothing
    assert found.pressed == pytest.approx((100 * 2.0 + 300 * 8.0) / 400)
    assert found.asked == 4.0
    assert found.peak == 8.0


def test_tip_force_is_judged_while_rolling_and_after_the_start() -> None:
    error, rolling = np.zeros(300), np.arange(300) < 200
    error[:50], error[150:200], error[250:] = 9.0, 2.0, 7.0
    found = figures_of(trace_of(tip_error=error, rolling=rolling), IDLE)
    # 99 rolling ticks after 1 s, of which 50 err by 2 N
    assert found.tip_error == pytest.approx((50 * 4.0 / 99) ** 0.5)
    assert found.tip_close == pytest.approx(49 / 99)


def test_slow_creep_slides_and_only_what_is_fast_is_a_slip() -> None:
    sliding = np.zeros((300, 5, 3))
    sliding[:, 0, 1] = 0.3e-3
    sliding[100:110, 2, 0] = 7e-3
    sliding[200:210, 2, 0] = -7e-3
    sliding[:, 4, 0] = 1.0
    trace = trace_of(sliding=sliding)
    holding = trace.pressed > 0.4
    # .3 mm/s for 3 s; .7 mm to one side and back; LF does not hold
    assert travelled(trace, holding) * 1e3 == pytest.approx([0.9, 0.0, 0.7, 0.0, 0.0])
    assert [(round(time, 2), finger) for time, finger in slips(trace, holding)] == [(1.04, "MF"), (2.04, "MF")]
    holding[150] = False
    # let go and taken up again, each hold counts
    assert travelled(trace, holding)[2] * 1e3 == pytest.approx(1.4)


def test_tables_count_runs_that_hold_and_name_the_others() -> None:
    entries = [
        entry("nothing", "torque", 1, 6.0), entry("nothing", "fixed 9 N", 1, 9.0, count=2),
        entry("nothing", "torque", 2, 6.0), entry("nothing", "fixed 9 N", 2, 2.0, holds=False),
        entry("pushes", "torque", 1, 7.0),
    ]  # fmt: skip
    text = shown(task_table(entries))
    assert "2/2" in text
    assert "1/2" in text
    assert "9.00 (9.00)" in shown(force_table(entries))
    (line,) = savings(entries)
    assert "press 33 % less than fixed 9 N" in line
    assert "1 seeds that both reach), slips 0 against 2" in line
    assert lost(entries) == ["lost: nothing, fixed 9 N, seed 2: TOOL_DROPPED at 1.00 s after 2 rounds"]


def test_study_runs_resumes_and_leaves_tables_and_plots(tmp_path: Path) -> None:
    chosen = chosen_conditions(["all"]), chosen_arms(["torque", "position"], [])
    todo = parts(*chosen, 1, 7305, SHORT, tmp_path)
    report(todo, 1, tmp_path, Console(file=StringIO()))
    kept = [json.loads(part.file.read_text()) for part in todo]
    assert [run["outcome"] for run in kept] == ["TIMEOUT", "TIMEOUT"]
    assert [found for _, found in finish(todo, lambda part: pytest.fail("done before"), 1)] == kept
    rows = duckdb.sql(f"SELECT arm, holds, pressed, work_hand FROM '{tmp_path / 'actuation.parquet'}'").fetchall()
    assert [(arm, holds) for arm, holds, *_ in rows] == [("torque", False), ("position", False)]
    # a grip of 4 N and what the load adds, 6 N; by torques that over .7, for friction is doubted by .3 at first
    most = {"torque": 9.0, "position": 8.0}
    assert all(2.0 < pressed < most[arm] and work > 0.0 for arm, _, pressed, work in rows)
    assert kept[0]["pushes"] == [dict(push, arm="torque") for push in kept[1]["pushes"]]
    assert duckdb.sql(f"SELECT * FROM '{tmp_path / 'pushes.parquet'}'").columns[3] == "start"
    trace = load_trace(todo[0])
    assert trace["pressed"].shape == (len(trace["time"]), 5)
    assert (tmp_path / "figures" / "comparison.png").is_file()


def test_record_of_an_ordinary_run_gives_the_same_figures(tmp_path: Path) -> None:
    summary = fasten(load(None, SHORT, 7305), tmp_path)
    found = read_figures(tmp_path)
    assert found.tilt_deg == pytest.approx(summary.max_tilt_deg)
    assert found.tip_slip_mm == pytest.approx(summary.tip_slip_mm)
    # the last tick comes before the end of the run by less than a tick's turning
    assert found.turned_deg == pytest.approx(summary.turned_deg, abs=0.6)


def test_bad_input_is_told_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="--arm legs: unknown; there are torque, fixed, position"):
        chosen_arms(["legs"], [])
    assert [arm.name for arm in chosen_arms(["fixed"], [8.0, 12.5])] == ["fixed 8 N", "fixed 12.5 N"]
    with pytest.raises(
        ScenarioError, match=r"control\.squeeze = 30: must be a number, at least 0\.5 N and at most 20 N"
    ):
        parts(CONDITIONS, arms([30.0]), 1, 0, [], tmp_path)
    with pytest.raises(ScenarioError, match="--condition rain: unknown; there are nothing, pushes"):
        chosen_conditions(["rain"])
    with pytest.raises(ScenarioError, match=r"tool\.mas"):
        parts(CONDITIONS, arms([9.0]), 1, 0, ["tool.mas=0.1"], tmp_path)
