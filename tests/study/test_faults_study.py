"""Faults injected into a run: what came of each stands in a table, and a study that was killed goes on."""

from __future__ import annotations

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import duckdb
import numpy as np
import pytest
from rich.console import Console

from turnscrew.errors import ScenarioError
from turnscrew.show.faults_report import odd, report, table
from turnscrew.study.disturbances.disturbance import Span
from turnscrew.study.faults.events import FaultEvent, FaultWatch, fault_event
from turnscrew.study.faults.study import chosen, load_trace, parts, write_results
from turnscrew.study.parts import finish


def watched(
    *, until: float = 4.0, named: tuple[tuple[float, str], ...] = (), trouble: Span | None = None
) -> FaultWatch:
    """A fault from 1 to 1.2 s, seen at ticks of 10 ms: errors of .5, 5 while it lasts, 2 until 2 s."""
    watch = FaultWatch(Span(1.0, 1.2))
    watch.time = [round(0.01 * i, 2) for i in range(round(100 * until))]
    size = [5.0 if 1.0 <= t < 1.2 else 2.0 if 1.2 <= t < 2.0 else 0.5 for t in watch.time]
    watch.error = [(e, e, e) for e in size]
    watch.lasting = [trouble is not None and trouble.holds(t) for t in watch.time]
    watch.phase, watch.turning = ["roll"] * len(watch.time), [True] * len(watch.time)
    watch.named, watch.frames = list(named), ["refused"] * 4 + ["taken"]
    return watch


def event(watch: FaultWatch, kind: str = "flipped", outcome: str = "goal") -> FaultEvent:
    return fault_event(kind, 3, watch, outcome, 2)


def test_errors_count_during_the_fault_and_a_second_after_it() -> None:
    found = event(watched())
    assert (found.tip_mm, found.tip_mm_during) == (5.0, 5.0)
    late = watched()
    late.error = [(9.0, 9.0, 9.0) if t >= 2.2 else (1.0, 1.0, 1.0) for t in late.time]
    assert event(late).tilt_deg == 1.0
    assert (found.frames, found.refused) == (5, 4)
    assert event(watched(), "dark").frames == 0


def test_what_was_named_when() -> None:
    found = event(watched(named=((0.5, "STALLED"), (1.1, "TIP_SLIP"), (1.15, "POSE_SUSPECT"), (3.0, "STALLED"))))
    assert found.named == "TIP_SLIP POSE_SUSPECT"
    assert found.named_s == pytest.approx(0.1)
    assert found.expected_s == pytest.approx(0.15)
    assert event(watched()).expected_s is None


def test_healthy_when_nothing_is_named_any_more() -> None:
    assert event(watched()).healthy_s == 0.0
    # ticks of 10 ms
    assert event(watched(trouble=Span(1.1, 1.4))).healthy_s == pytest.approx(0.2, abs=0.011)
    assert event(watched(trouble=Span(1.1, 9.0))).healthy_s is None
    # a run that ended in the fault was never well again
    assert event(watched(until=1.5), outcome="CONTACT_LOST").healthy_s is None


def test_report_tells_goals_missed_and_outcomes_without_a_name() -> None:
    missed = event(watched(until=1.5), outcome="CONTACT_LOST")
    crashed = replace(missed, outcome="crash: ValueError: boom")
    well = event(watched(named=((1.1, "POSE_SUSPECT"),)))
    rows = [vars(well), vars(missed), vars(crashed)]
    assert any("goal missed" in line and "CONTACT_LOST" in line for line in odd(rows))
    assert any("unnamed outcome" in line and "boom" in line for line in odd(rows))
    assert odd([vars(well)]) == ["unnamed outcomes: none"]
    console = Console(width=200, file=StringIO())
    console.print(table(rows))
    text = console.file.getvalue()
    assert "tip [mm]" in text
    assert "POSE_SUSPECT (1, 0.10)" in text
    assert "12/15" in text
    assert "1/3" in text


def test_study_runs_resumes_and_leaves_a_table(tmp_path: Path) -> None:
    # the moment that this seed draws is 1.06 s: what counts is over at 2.07 s
    todo = parts(("nan",), 1, 7109, ["goal.time_limit=2.1"], tmp_path)
    report(todo, 1, tmp_path, Console(file=StringIO()))
    kept = json.loads(todo[0].file.read_text())
    assert kept["outcome"] == "TIMEOUT"
    assert "POSE_SUSPECT" in kept["named"]
    # the first tick of the fault, at most 10 ms after it began
    assert kept["expected_s"] < 0.011
    again = [found for _, found in finish(todo, lambda part: pytest.fail("done before"), 1)]
    assert again == [kept]
    columns = duckdb.sql(f"SELECT kind, seed, tip_mm, turning FROM '{write_results(again, tmp_path)}'").fetchall()
    assert columns == [("nan", 7109, kept["tip_mm"], kept["turning"])]
    trace = load_trace(todo[0])
    assert np.isclose(trace["time"][0], -kept["start"])
    assert trace["error"].shape == (len(trace["time"]), 3)


def test_bad_input_is_told_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="--fault fog: unknown; there are nothing, dark"):
        chosen(["fog"])
    assert chosen(["flipped", "dark"]) == ("dark", "flipped")
    with pytest.raises(ScenarioError, match=r"vision\.sorce"):
        parts(("dark",), 1, 0, ["vision.sorce=rendered"], tmp_path)
