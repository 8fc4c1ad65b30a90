"""Slips of fingers against alarms: which count, which are in time, and what the tables say."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import duckdb
import numpy as np
import pytest
from rich.console import Console

from turnscrew.errors import ScenarioError
from turnscrew.show.finger_slips_report import detection_table, quiet_lines, reaction_table, report
from turnscrew.study.disturbances.finger_slips import FingerMoment
from turnscrew.study.finger_slips.events import FingerWatch, around, quiet_alarms, slip_event
from turnscrew.study.finger_slips.study import load_signals, parts

MF = 2


def watched(*alarms: tuple[float, float], until: float = 5.0, speed: float = 0.0) -> FingerWatch:
    """Ticks of 10 ms with a signal of 2 of the middle finger in each of these stretches, which slides at `speed`."""
    watch = FingerWatch(4e-4)
    for i in range(round(100 * until)):
        signal, speeds, time = np.zeros(5), np.zeros((5, 3)), round(0.01 * i, 2)
        signal[MF] = 2.0 if any(a <= time < b for a, b in alarms) else 0.0
        speeds[MF, 2] = speed
        watch.time.append(time)
        watch.signal.append(signal)
        watch.speed.append(speeds)
        watch.phase.append("roll")
    return watch


def moment(reached: float | None = 1.03) -> FingerMoment:
    return FingerMoment(MF, 1.0, 0.5, reached, 0.0023, 0.002)


@pytest.mark.parametrize(
    ("made", "watch", "verdict"),
    [
        (moment(), watched((1.05, 1.2)), "in time"),
        (moment(), watched((1.01, 1.2)), "in time"),
        (moment(), watched((1.13, 1.2)), "in time"),
        (moment(), watched((1.14, 1.2)), "late"),
        (moment(), watched(), "missed"),
        (moment(), watched((1.54, 1.7)), "missed"),
        (moment(), watched((0.9, 1.2)), "alarm stood"),
        (moment(None), watched((1.05, 1.2)), "no slip"),
        (moment(), watched(until=1.1), "run over"),
    ],
)
def test_verdict_of_a_slip(made: FingerMoment, watch: FingerWatch, verdict: str) -> None:
    assert slip_event(made, "reacts", 1, watch).verdict == verdict


def test_delay_counts_from_the_first_millimetre() -> None:
    assert slip_event(moment(), "reacts", 1, watched((1.05, 1.2))).delay == pytest.approx(0.02)


@pytest.mark.parametrize(("speed", "false"), [(0.0, True), (0.005, False)])
def test_an_alarm_is_false_where_the_finger_has_not_slid(speed: float, false: bool) -> None:
    (alarm,) = quiet_alarms(3, watched((2.0, 2.1), speed=speed), 0.01)
    assert (alarm.finger, alarm.start, alarm.false) == ("MF", 2.0, false)
    # a fifth of a second, and the tick itself
    assert alarm.slid_mm == pytest.approx(1e3 * 0.21 * speed)


def test_signal_around_a_slip() -> None:
    signal = around(moment(1.0), watched((1.0, 1.1)), 0.01)
    # .1 s before, .3 s after, and the tick itself
    assert len(signal) == 41
    assert signal[10] == 2.0
    assert np.isnan(around(moment(1.0), watched(until=1.2), 0.01)[-1])


def test_tables_count_what_counts() -> None:
    events = [vars(slip_event(moment(), "reacts", 1, watch)) for watch in (watched((1.05, 1.2)), watched())]
    entry = {
        "kind": "reacts", "seed": 1, "outcome": "goal", "rounds": 5, "time": 600.0, "slid_mm": 2.3, "tilt_deg": 1.0,
        "slips": events, "alarms": [],
    }  # fmt: skip
    lost = {**entry, "kind": "only watches", "outcome": "TOOL_DROPPED", "slips": []}
    console = Console(width=220, file=StringIO())
    console.print(detection_table([entry, lost]))
    console.print(reaction_table([entry, lost]))
    text = console.file.getvalue()
    assert "1/2 = 50 %" in text
    assert "2.3, 2.3, 2.3" in text
    assert "[mm]" in text
    assert "TOOL_DROPPED 1" in text
    # no event in ten minutes: fewer than three at 95 %
    assert "0.00 in ten minutes (95 %: below 3.00)" in quiet_lines([{**entry, "kind": "quiet"}])[0]


def test_study_runs_and_leaves_tables(tmp_path: Path) -> None:
    todo = [part for part in parts(1, 1, 0.3, 7402, ["goal.time_limit=1.6"], tmp_path) if part.kind != "reacts"]
    report(todo, 1, tmp_path, Console(file=StringIO()))
    runs = duckdb.sql(f"SELECT kind, outcome FROM '{tmp_path / 'runs.parquet'}' ORDER BY kind").fetchall()
    assert runs == [("only watches", "TIMEOUT"), ("quiet", "TIMEOUT")]
    slips = duckdb.sql(f"SELECT * FROM '{tmp_path / 'finger_slips.parquet'}'")
    assert {"finger", "ratio", "travel_mm", "verdict"} <= set(slips.columns)
    assert load_signals(todo[0]).ndim >= 1


def test_bad_override_is_told_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"force\.noize"):
        parts(1, 1, 0.3, 0, ["force.noize=0.05"], tmp_path)
    with pytest.raises(ScenarioError, match="leaves no run"):
        parts(0, 0, 0.3, 0, [], tmp_path)
