"""The study of many trials; killed, it resumes.  A part is one trial, and a trial is a `turnscrew fasten`."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.errors import ScenarioError
from turnscrew.study.disturbances.mishaps import MISHAPS
from turnscrew.study.events import columns_of
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.study.trials.trial import Trial, attempt
from turnscrew.study.trials.variation import Row, draw, override, table
from turnscrew.task.scenario import load
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.signal_table import write_parquet
from turnscrew.task.start import plan_of

TRIALS_FILE = "trials.parquet"


@dataclass(frozen=True)
class TrialPart:
    """One trial.

    Attributes:
        scenario: What is run, its seed and its drawn values included.
        drawn: The drawn values by key.
        command: That makes the trial again, with a record; without its mishap.
        file: Where its findings go.
        mishap: Name of what happens to the robot once; nothing without.
    """

    scenario: Scenario
    drawn: dict[str, Any]
    command: str
    file: Path
    mishap: str = ""


@dataclass(frozen=True)
class Trials:
    """What a study consists of.

    Attributes:
        variation: Its name.
        rows: What is varied.
        parts: The trials.
        rounds: That each is to reach; none where the goal is another.
    """

    variation: str
    rows: tuple[Row, ...]
    parts: tuple[TrialPart, ...]
    rounds: int | None


def trials(
    file: Path | None, overrides: Sequence[str], variation: str, seeds: range, out: Path, mishap: str = ""
) -> Trials:
    """All trials of a study.

    Args:
        file: The scenario that is varied, the defaults without.
        overrides: `key=value` each; what they set is not varied.
        variation: Of `variation.SIZES`.
        seeds: Of the trials.
        out: Folder of the study.
        mishap: Of `MISHAPS`, what happens to the robot once in each trial; nothing without.

    Raises:
        ScenarioError: file, override, variation or mishap are wrong.
        PlanError: no plan fits the handle.
    """
    if mishap and mishap not in MISHAPS:
        raise ScenarioError(f"--mishap {mishap}: unknown; there are {', '.join(MISHAPS)}")
    base = load(file, overrides)
    rows = table(base, variation, [name.partition("=")[0].strip() for name in overrides])
    # planned once, here, and kept for all
    plan_of(base)
    parts = []
    for seed in seeds:
        drawn = draw(rows, base, seed)
        # what was set by hand comes last: it may set a whole table
        wishes = [*(override(key, value) for key, value in drawn.items()), *overrides]
        scenario = load(file, wishes, seed)
        # a trial without a mishap keeps the name that it always had
        depends = ["trials", scenario.model_dump(mode="json"), *([mishap] if mishap else [])]
        path = part_file(out, f"{mishap or 'trial'}-{seed}", *depends)
        parts.append(TrialPart(scenario, drawn, command(file, wishes, seed), path, mishap))
    return Trials(variation, rows, tuple(parts), base.goal.rounds)


def command(file: Path | None, wishes: Sequence[str], seed: int) -> str:
    """The command that makes a trial again."""
    words = ["turnscrew", "fasten", *([] if file is None else [str(file)]), "--seed", str(seed)]
    return shlex.join([*words, *(word for wish in wishes for word in ("--set", wish))])


def work(part: TrialPart) -> Done:
    """Makes one trial."""
    return asdict(attempt(part.scenario, part.mishap))


def write_results(done: Sequence[tuple[TrialPart, Done]], out: Path) -> Path:
    """Every trial, one row each: what came of it, its drawn values by key, and the command that makes it again."""
    columns = columns_of(Trial, [found for _, found in done])
    keys = dict.fromkeys(key for part, _ in done for key, value in part.drawn.items() if not isinstance(value, list))
    for key in keys:
        values = [part.drawn.get(key) for part, _ in done]
        words = any(isinstance(value, str) for value in values)
        columns[key] = np.array([("" if words else math.nan) if value is None else value for value in values])
    columns["command"] = np.array([part.command for part, _ in done], dtype=np.str_)
    write_whole(out / TRIALS_FILE, lambda path: write_parquet(path, columns))
    return out / TRIALS_FILE
