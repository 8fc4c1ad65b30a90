"""Trials: what is drawn, that a trial is a run anybody can make again, and that killing a study loses nothing."""

from __future__ import annotations

import importlib.util
import multiprocessing
import shlex
from io import StringIO
from itertools import pairwise
from pathlib import Path

import duckdb
import numpy as np
import pytest
from rich.console import Console

from turnscrew.errors import PlanError, ScenarioError
from turnscrew.show.trials_report import (
    false_alarm_lines,
    lived_with,
    mishap_lines,
    report,
    result_tables,
    so_far,
    variation_table,
    worst_lines,
)
from turnscrew.study.parts import finish
from turnscrew.study.trials import trial
from turnscrew.study.trials.engines import engine, on_ray
from turnscrew.study.trials.study import TRIALS_FILE, trials, work, write_results
from turnscrew.study.trials.trial import CRASH, NO_START, Trial, attempt
from turnscrew.study.trials.variation import draw, table, value_of
from turnscrew.task.scenario import load

BASE = load(None, [])
SEEDS = range(7500, 7600)
SHORT = ("goal.time_limit=0.05",)
"""Five ticks: all that a trial does, in a quarter of a second."""


def draws(variation: str, key: str) -> list[float]:
    rows = table(BASE, variation)
    return [found[key] for seed in SEEDS if key in (found := draw(rows, BASE, seed))]


@pytest.mark.parametrize(
    ("key", "standard", "hard"),
    [
        # an error doubles, a range widens about its middle as far as its values make sense
        ("vision.latency", (0.02, 0.06), (0.04, 0.12)),
        ("force.noise", (0.25, 0.25), (0.5, 0.5)),
        ("start.tool_tilt", (np.radians(1.5),) * 2, (np.radians(3.0),) * 2),
        ("contact.finger_friction", (0.6, 1.1), (0.35, 1.35)),
        ("tool.mass", (0.056, 0.104), (0.032, 0.128)),
        ("screw.thread.stiffness", (0.003, 0.02), (0.0, 0.0285)),
        ("screw.slot_yaw", (-np.pi, np.pi), (-np.pi, np.pi)),
        ("model.finger_friction", (0.85, 0.85), (0.85, 0.85)),
    ],
)
def test_values_fill_their_range_and_twice_of_it(
    key: str, standard: tuple[float, float], hard: tuple[float, float]
) -> None:
    for variation, (low, high) in (("standard", standard), ("hard", hard)):
        found = draws(variation, key)
        # six digits are kept
        assert min(found) >= low - 1e-5 * abs(low)
        assert max(found) <= high + 1e-5 * abs(high)
        # 40 even draws leave a tenth of the range at an end empty once in 70 cases; these seeds do not
        assert max(found) - min(found) >= 0.8 * (high - low)


def test_calibration_doubles_along_each_axis() -> None:
    assert draw(table(BASE, "hard"), BASE, 1)["sense.calibration_error"] == [0.003, 0.003, 0.004]


@pytest.mark.parametrize("variation", ["none", "standard", "hard"])
def test_every_draw_is_a_valid_scenario(variation: str, tmp_path: Path) -> None:
    for part in trials(None, [], variation, SEEDS, tmp_path).parts:
        for key, value in part.drawn.items():
            held = value_of(part.scenario, key)
            assert (list(held) if isinstance(held, tuple) else held) == value


def test_a_draw_depends_on_seed_and_name_alone() -> None:
    rows = table(BASE, "standard")
    whole = draw(rows, BASE, 7501)
    assert whole == draw(rows, BASE, 7501)
    assert whole != draw(rows, BASE, 7502)
    fewer = draw([row for row in rows if row.key.startswith("vision.")], BASE, 7501)
    assert fewer == {key: value for key, value in whole.items() if key.startswith("vision.")}


def test_each_law_has_its_own_resistance() -> None:
    laws = set()
    for seed in SEEDS:
        found = draw(table(BASE, "standard"), BASE, seed)
        laws.add(found["screw.thread.law"])
        elastic = found["screw.thread.law"] == "elastic"
        assert ("screw.thread.stiffness" in found) == elastic
        assert ("screw.thread.prevailing_torque" in found) != elastic
    assert laws == {"elastic", "self-locking"}


def test_what_is_set_is_not_varied(tmp_path: Path) -> None:
    sets = ["screw.thread.law=self-locking", "contact.finger_friction=0.9", "vision.source=rendered", "tool.mass=0.1"]
    study = trials(None, sets, "hard", range(7500, 7503), tmp_path)
    keys = {row.key for row in study.rows}
    # the robot is told what was set, not the middle of what is not drawn
    assert not keys & {"screw.thread.law", "contact.finger_friction", "model.finger_friction", "model.tool_mass"}
    for part in study.parts:
        assert "screw.thread.prevailing_torque" in part.drawn
        assert "vision.position_noise" not in part.drawn
        assert part.scenario.contact.finger_friction == 0.9


def test_command_makes_the_same_scenario(tmp_path: Path) -> None:
    file = tmp_path / "my screw.toml"
    file.write_text("[screw]\npitch = 0.0005\n")
    part = trials(file, ["goal.rounds=2"], "standard", range(7500, 7501), tmp_path).parts[0]
    words = shlex.split(part.command)
    assert words[:5] == ["turnscrew", "fasten", str(file), "--seed", "7500"]
    sets = [word for before, word in pairwise(words) if before == "--set"]
    assert load(Path(words[2]), sets, int(words[4])) == part.scenario


def test_bad_wishes_are_told_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"force\.noize"):
        trials(None, ["force.noize=0.1"], "standard", SEEDS, tmp_path)
    with pytest.raises(ScenarioError, match="standard, hard"):
        trials(None, [], "harder", SEEDS, tmp_path)
    with pytest.raises(ScenarioError, match="joblib, ray"):
        engine("dask")


def test_a_start_out_of_reach_and_a_bug_are_outcomes(monkeypatch: pytest.MonkeyPatch) -> None:
    def unreachable(scenario: object, **_: object) -> None:
        raise PlanError("start: MF cannot reach the handle")

    with monkeypatch.context() as patch:
        patch.setattr(trial.Run, "begin", unreachable)
        assert attempt(BASE).outcome == NO_START

    def broken(*_: object) -> str:
        raise ZeroDivisionError("no torque")

    monkeypatch.setattr(trial, "turn", broken)
    found = attempt(BASE)
    assert (found.outcome, found.passed, found.evidence) == (CRASH, False, "ZeroDivisionError: no torque")


def test_report_counts_and_names_causes(tmp_path: Path) -> None:
    done = []
    for part in trials(None, [], "standard", range(7500, 7510), tmp_path).parts:
        seed = part.scenario.seed
        failed = seed in (7503, 7507)
        outcome, rounds = ("CONTACT_LOST", 2) if failed else ("goal", 5)
        warned = {7503: "TIP_SLIP 2, VISION_LOST 1", 7505: "TIP_SLIP 1"}.get(seed, "")
        found = Trial(
            seed, not failed, outcome, "add", rounds, "no finger", rounds=rounds, max_tilt_deg=1.0, warnings=warned
        )
        done.append((part, vars(found)))
    console = Console(width=220, file=StringIO())
    file = write_results(done, tmp_path)
    for shown in [variation_table("standard", table(BASE, "standard")), *result_tables(file)]:
        console.print(shown)
    text = console.file.getvalue()
    # Wilson's interval of 8 in 10
    assert "8 of 10 = 80.0 % (95 %: 49 to 94 %)" in text
    assert "2 of 10 = 20.0 % (95 %: 6 to 51 %)" in text
    assert "7503, 7507" in text
    assert "even, 0.6 to 1.1" in text
    assert worst_lines(file)[1].startswith("  seed 7503: CONTACT_LOST, 2 rounds")
    assert lived_with(file) == [
        "lived with: TIP_SLIP 3 times, in 2 trials",
        "lived with: VISION_LOST 1 times, in 1 trials",
    ]
    assert mishap_lines(file) == []
    assert so_far([found for _, found in done]) == "8 of 10 passed"
    column = duckdb.sql(f"""SELECT "contact.finger_friction" FROM '{file}' ORDER BY seed""").fetchnumpy()
    drawn = [part.drawn["contact.finger_friction"] for part, _ in done]
    np.testing.assert_array_equal(column["contact.finger_friction"], drawn)


def test_report_tells_in_how_many_trials_a_mishap_happened(tmp_path: Path) -> None:
    done = []
    for part in trials(None, [], "standard", range(7500, 7510), tmp_path, "push").parts:
        seed = part.scenario.seed
        # three runs were over before, and one of those that were pushed is lost
        phase = "" if seed < 7503 else "roll"
        done.append((part, vars(Trial(seed, seed != 7505, "goal", mishap="push", mishap_phase=phase))))
    (line,) = mishap_lines(write_results(done, tmp_path))
    assert line.startswith("push: happened in 7 of 10 trials, 6 of which passed")


def test_report_tells_false_alarms_in_a_hundred_rounds(tmp_path: Path) -> None:
    done = []
    for part in trials(None, [], "standard", range(7500, 7510), tmp_path).parts:
        alarms = {7501: "FINGER_SLIP 1, TIP_SLIP 2", 7502: "TIP_SLIP 1"}.get(part.scenario.seed, "")
        done.append((part, vars(Trial(part.scenario.seed, True, "goal", rounds=5, false_alarms=alarms))))
    lines = false_alarm_lines(write_results(done, tmp_path))
    # intervals after Garwood for 1, 3 and 4 events in 50 rounds
    assert lines == [
        "false alarms: FINGER_SLIP 1 in 50 rounds = 2.00 in 100 (95 %: 0.05 to 11.14)",
        "false alarms: TIP_SLIP 3 in 50 rounds = 6.00 in 100 (95 %: 1.24 to 17.53)",
        "false alarms: all 4 in 50 rounds = 8.00 in 100 (95 %: 2.18 to 20.48)",
    ]
    (part, trial), *_ = done
    quiet = write_results([(part, {**trial, "false_alarms": ""})], tmp_path)
    # none in five rounds: 3.69 events at 97.5 %
    assert false_alarm_lines(quiet) == ["false alarms: all 0 in 5 rounds = 0.00 in 100 (95 %: 0.00 to 73.78)"]
    disturbed = write_results([(part, {**trial, "mishap": "push"})], tmp_path)
    assert false_alarm_lines(disturbed) == []


def test_report_tells_how_soon_a_mishap_is_named(tmp_path: Path) -> None:
    done = []
    for part in trials(None, [], "standard", range(7500, 7505), tmp_path, "dark").parts:
        seed = part.scenario.seed
        named = {7500: "missed", 7501: "run over", 7504: "nothing"}.get(seed, "named")
        delay = 0.01 * (seed - 7450) if named == "named" else np.nan
        done.append((part, vars(Trial(
            seed, True, "goal", mishap="dark", mishap_phase="roll", named=named, delay_s=delay
        ))))  # fmt: skip
    _, line, rest = mishap_lines(write_results(done, tmp_path))
    assert rest == "dark: led to nothing that should be named in 1"
    assert line.startswith("dark: named in 2 of 3 = 66.7 %")
    assert line.endswith("0.53 s after the trouble began (at most 0.53 s); missed in 1")


def test_two_processes_give_the_same_table_as_none(tmp_path: Path) -> None:
    found = []
    for jobs, name in ((1, "one"), (2, "two")):
        study = trials(None, SHORT, "standard", range(7501, 7503), tmp_path / name)
        report(study, jobs, tmp_path / name, Console(file=StringIO()))
        found.append(rows(tmp_path / name / TRIALS_FILE))
    assert found[0] == found[1]
    assert [row[0] for row in found[0]] == [7501, 7502]


@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="Ray is not installed")
def test_local_ray_gives_the_same_findings(tmp_path: Path) -> None:
    todo = trials(None, SHORT, "standard", range(7501, 7503), tmp_path / "here").parts
    elsewhere = trials(None, SHORT, "standard", range(7501, 7503), tmp_path / "ray").parts
    here = [str(found) for _, found in finish(todo, work, 1)]
    assert sorted(str(found) for _, found in finish(elsewhere, work, 2, on_ray)) == sorted(here)
    assert all(part.file.is_file() for part in elsewhere)


def study_in(out: Path) -> None:
    for _ in finish(trials(None, SHORT, "standard", range(7501, 7511), out).parts, work, 1):
        pass


def test_killed_at_random_moments_the_table_is_the_same(tmp_path: Path) -> None:
    out, rng, left = tmp_path / "killed", np.random.default_rng(7500), []
    # a fork has all imported already: what is cut are trials, and the writing of their findings
    fork = multiprocessing.get_context("fork")
    for _ in range(6):
        study = fork.Process(target=study_in, args=(out,))
        study.start()
        study.join(rng.uniform(0.05, 0.5))
        study.kill()
        study.join()
        left.append(len(list(out.glob("parts/*.json"))))
    # nothing that was finished is lost
    assert left == sorted(left)
    tables = []
    for place in (out, tmp_path / "whole"):
        study = trials(None, SHORT, "standard", range(7501, 7511), place)
        found = {part.file: done for part, done in finish(study.parts, work, 1)}
        tables.append(rows(write_results([(part, found[part.file]) for part in study.parts], place)))
    assert tables[0] == tables[1]
    assert [row[0] for row in tables[0]] == list(range(7501, 7511))


def rows(file: Path) -> list[tuple[object, ...]]:
    return duckdb.sql(f"SELECT * FROM '{file}'").fetchall()
