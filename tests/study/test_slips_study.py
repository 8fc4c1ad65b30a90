"""Slips against alarms: which count, which are in time, and how sure the shares are."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import duckdb
import numpy as np
import pytest
from rich.console import Console

from turnscrew.errors import ScenarioError
from turnscrew.show.slips_report import failures, quiet_lines, report, slip_table
from turnscrew.study.disturbances.tip_slips import Slip
from turnscrew.study.slips.events import SlipWatch, around, false_alarms, slip_event
from turnscrew.study.slips.study import load_signals, parts


def watched(*alarms: tuple[float, float], until: float = 5.0, in_slot: bool = True) -> SlipWatch:
    """Ticks of 10 ms with a signal of 2 in each of these stretches, 0 elsewhere."""
    time = [round(0.01 * i, 2) for i in range(round(100 * until))]
    signal = [2.0 if any(a <= t < b for a, b in alarms) else 0.0 for t in time]
    return SlipWatch(time, signal, [in_slot] * len(time), ["roll"] * len(time))


def slip(reached: float | None = 1.03) -> Slip:
    return Slip("knock", 1.0, 0.02, 5.0, reached, 0.0015)


@pytest.mark.parametrize(
    ("made", "watch", "verdict"),
    [
        (slip(), watched((1.05, 1.2)), "in time"),
        (slip(), watched((1.01, 1.2)), "in time"),
        (slip(), watched((1.13, 1.2)), "in time"),
        (slip(), watched((1.14, 1.2)), "late"),
        (slip(), watched(), "missed"),
        (slip(), watched((2.04, 2.2)), "missed"),
        (slip(), watched((0.9, 1.2)), "alarm stood"),
        (slip(None), watched((1.05, 1.2)), "no slip"),
        (slip(), watched((1.05, 1.2), in_slot=False), "not in slot"),
        (slip(), watched((1.05, 1.2), until=1.1), "run over"),
    ],
)
def test_verdict_of_a_slip(made: Slip, watch: SlipWatch, verdict: str) -> None:
    assert slip_event(made, "knock", 1, watch).verdict == verdict


def test_delay_counts_from_the_first_millimetre() -> None:
    assert slip_event(slip(), "knock", 1, watched((1.05, 1.2))).delay == pytest.approx(0.02)
    assert slip_event(slip(), "knock", 1, watched((1.01, 1.2))).delay == pytest.approx(-0.02)


def test_run_is_over_a_second_after_the_tip_has_left_its_slot() -> None:
    watch = watched(until=3.0)
    assert not watch.left()
    watch.in_slot[-99:] = [False] * 99
    assert not watch.left()
    watch.in_slot[-102:] = [False] * 102
    assert watch.left()


def test_alarms_close_together_are_one() -> None:
    found = false_alarms(4, watched((1.0, 1.1), (1.5, 1.6), (3.0, 3.05)))
    assert [alarm.start for alarm in found] == [1.0, 3.0]


def test_signal_around_a_slip() -> None:
    signal = around(slip(1.0), watched((1.0, 1.1)), 0.01)
    # .2 s before, .5 s after, and the tick itself
    assert len(signal) == 71
    assert signal[20] == 2.0
    assert signal[:20].max() == 0.0
    assert np.isnan(around(slip(1.0), watched(until=1.2), 0.01)[-1])


def test_tables_count_what_counts() -> None:
    events = [
        vars(slip_event(slip(), "knock", 1, w)) for w in (watched((1.05, 1.2)), watched(), watched(in_slot=False))
    ]
    entry = {"kind": "knock", "seed": 1, "outcome": "goal", "rounds": 5, "time": 20.0, "slips": events, "alarms": []}
    console = Console(width=220, file=StringIO())
    console.print(slip_table([entry]))
    text = console.file.getvalue()
    assert "1/2 = 50 %" in text
    assert "not in slot 1" in text
    assert any(line.startswith("missed: knock, seed 1, roll at 1.00 s") for line in failures([entry]))
    quiet = {**entry, "kind": "quiet", "time": 600.0, "slips": []}
    # no event in ten minutes: fewer than three at 95 %
    assert "0.00 in ten minutes (95 %: below 3.00)" in quiet_lines([quiet])[0]


def test_study_runs_and_leaves_tables(tmp_path: Path) -> None:
    wishes = ["goal.time_limit=1.9", "force.noise=0.05", "force.direction_noise=0.05"]
    todo = [part for part in parts(1, 1, 7109, wishes, tmp_path) if part.kind != "slick"]
    report(todo, 1, tmp_path, Console(file=StringIO()))
    runs = duckdb.sql(f"SELECT kind, outcome FROM '{tmp_path / 'runs.parquet'}' ORDER BY kind").fetchall()
    assert runs == [("knock", "TIMEOUT"), ("quiet", "TIMEOUT")]
    slips = duckdb.sql(f"SELECT verdict, peak FROM '{tmp_path / 'slips.parquet'}'").fetchall()
    assert slips
    assert all(peak != 0.0 for _, peak in slips)
    assert load_signals(todo[0]).ndim >= 1
    assert duckdb.sql(f"SELECT * FROM '{tmp_path / 'false_alarms.parquet'}'").columns[0] == "kind"


def test_bad_override_is_told_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"force\.noize"):
        parts(1, 1, 0, ["force.noize=0.05"], tmp_path)
    with pytest.raises(ScenarioError, match="leaves no run"):
        parts(0, 0, 0, [], tmp_path)
