"""The study of what makes the gait robust: the same trials without one measure at a time; killed, it resumes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from turnscrew.study.ablation.measures import MEASURES, Measure
from turnscrew.study.events import columns_of
from turnscrew.study.parts import Done, part_file, write_whole
from turnscrew.study.trials.study import trials
from turnscrew.study.trials.trial import Trial, attempt
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.signal_table import write_parquet

RESULTS = "ablation.parquet"


@dataclass(frozen=True)
class AblationPart:
    """One trial without one measure.

    Attributes:
        without: Name of the measure.
        scenario: What is run, its seed and its drawn values included.
        file: Where its findings go.
    """

    without: str
    scenario: Scenario
    file: Path


def parts(
    measures: Sequence[Measure], overrides: Sequence[str], variation: str, seeds: range, out: Path
) -> list[AblationPart]:
    """All trials, seed by seed, so that a study that is cut short compares what it has.

    Args:
        measures: That are taken away, one at a time.
        overrides: `key=value` each; what they set is not varied.
        variation: Of the trials.
        seeds: Of the trials, the same for each measure.
        out: Folder of the study.

    Raises:
        ScenarioError: override or variation are wrong.
        PlanError: no plan fits the handle.
    """
    found = []
    for trial in trials(None, overrides, variation, seeds, out).parts:
        for measure in measures:
            name = f"{measure.name.replace(' ', '-')}-{trial.scenario.seed}"
            file = part_file(out, name, "ablation", measure.name, trial.scenario.model_dump(mode="json"))
            found.append(AblationPart(measure.name, trial.scenario, file))
    return found


def work(part: AblationPart) -> Done:
    """Makes one trial."""
    measure = next(measure for measure in MEASURES if measure.name == part.without)
    return {"without": part.without} | asdict(attempt(part.scenario, adapt=measure.without))


def write_results(done: Sequence[Done], out: Path) -> Path:
    """Every trial, one row each: the columns of `turnscrew trials`, and what it was without."""
    columns = {"without": np.array([found["without"] for found in done], dtype=np.str_), **columns_of(Trial, done)}
    write_whole(out / RESULTS, lambda path: write_parquet(path, columns))
    return out / RESULTS
