"""A grasp under a rising torque, and the study of many: one is simulated here, where it was predicted to give way."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from turnscrew.errors import ScenarioError
from turnscrew.robot.joints import FINGERS
from turnscrew.show.give_way_report import agreement_table, report
from turnscrew.study.envelope.bench import Forces
from turnscrew.study.envelope.give_way import BEGIN, END, ENGAGE, SECONDS, SLIPPED, End, ramp
from turnscrew.study.envelope.study import (
    COMBINATIONS,
    Part,
    chosen_forces,
    chosen_grips,
    load_traces,
    parts,
    work,
)
from turnscrew.study.parts import Done
from turnscrew.task.envelope import Grip


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Part, Done]:
    out = tmp_path_factory.mktemp("study")
    (part,) = parts([(0.015, 0.8, 9.0)], (Grip.ROLLING,), (Forces.SUREST,), out)
    return part, work(part)


def test_the_grasp_gives_way_where_it_was_predicted_to(simulated: tuple[Part, Done]) -> None:
    _, done = simulated
    # what the whole study holds to
    assert abs(done["ratio"] - 1.0) < 0.1


def test_it_gives_way_by_slipping_and_the_torque_follows_until_then(simulated: tuple[Part, Done]) -> None:
    part, done = simulated
    traces = load_traces(part)
    assert done["end"] == End.SLIPPED
    assert traces["slip"][-1].max() > SLIPPED
    assert traces["slip"][-2].max() <= SLIPPED
    before = traces["asked"] < 0.8 * done["predicted_nm"]
    # the smoothing's lag at the ramp's first, steepest part: .05 s of .5 / s
    assert (np.abs(traces["asked"] - traces["got"])[before] < 0.06 * done["predicted_nm"] + 0.004).all()


def test_a_finger_presses_no_harder_than_it_may(simulated: tuple[Part, Done]) -> None:
    part, _ = simulated
    traces = load_traces(part)
    held = [FINGERS.index(finger) for finger in Grip.ROLLING.fingers]
    steady = traces["asked"] < 0.8 * traces["asked"].max()
    # a position servo and the program's weights stand beside the forces that are told: a twentieth
    assert traces["pressing"][steady][:, held].max() < 1.05 * part.most
    others = [row for row in range(5) if row not in held]
    assert not traces["pressing"][:, others].any()


def test_the_ramp_is_steady_and_reaches_beyond_the_guess() -> None:
    assert ramp(-1.0) == 0.0
    assert ramp(ENGAGE) == pytest.approx(BEGIN)
    assert ramp(ENGAGE + SECONDS) == pytest.approx(END)
    times = np.linspace(0.0, ENGAGE + SECONDS, 200)
    assert (np.diff([ramp(time) for time in times]) > 0.0).all()


def test_a_study_has_enough_cases_and_each_its_own_file() -> None:
    todo = parts(COMBINATIONS, tuple(Grip), tuple(Forces), Path("out"))
    assert len({part.file for part in todo}) == len(todo) == 14 * 3 * 2
    assert len({part.radius for part in todo}) >= 5


def test_what_is_finished_is_not_simulated_again(simulated: tuple[Part, Done], tmp_path: Path) -> None:
    _, done = simulated
    (part,) = parts([(0.015, 0.8, 9.0)], (Grip.ROLLING,), (Forces.SUREST,), tmp_path)
    part.file.parent.mkdir(parents=True)
    part.file.write_text(json.dumps(done))
    console = Console(record=True, width=160, file=(tmp_path / "shown").open("w"))
    report([part], 1, tmp_path, console)
    shown = console.export_text()
    assert f"{done['ratio']:.2f}" in shown
    assert "1 of 1" in shown
    assert (tmp_path / "give_way.parquet").is_file()


def test_agreement_counts_what_is_within_a_tenth() -> None:
    done = [{"forces": "surest", "grasp": "TH+MF", "ratio": ratio} for ratio in (0.95, 1.05, 1.2, float("nan"))]
    console = Console(width=120)
    with console.capture() as shown:
        console.print(agreement_table(done))
    assert "2 of 3" in shown.get()


def test_names_that_there_are_not_are_refused() -> None:
    with pytest.raises(ScenarioError, match=r"--grasp LF: unknown; there are TH\+MF, FF\+RF, all four"):
        chosen_grips(["LF"])
    with pytest.raises(ScenarioError, match="--forces best: unknown"):
        chosen_forces(["best"])
    assert chosen_grips(None) == tuple(Grip)
