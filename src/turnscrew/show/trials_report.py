"""Trials as they go on, and when they are done: how many passed, how fast, why others failed, and which to look at."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import duckdb
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from turnscrew.show.parts_progress import gather
from turnscrew.study.parts import Done, Engine
from turnscrew.study.rates import poisson, wilson
from turnscrew.study.trials.study import Trials, work, write_results
from turnscrew.study.trials.variation import Row
from turnscrew.task.scenario import fields

WORST = 5
"""Trials that are shown with their command."""

MEASURES = {
    "rounds": "rounds",
    "degrees a round": "deg_a_round",
    "seconds a round": "seconds_a_round",
    "turning speed, whole run [deg/s]": "deg_per_s",
    "largest tilt [deg]": "max_tilt_deg",
    "tip from the drive's centre, at most [mm]": "tip_slip_mm",
    "joints from their limits, at least [deg]": "joint_room_deg",
    "error of the tip, rms [mm]": "tip_error_mm",
    "error of tilt, rms [deg]": "tilt_error_deg",
    "error of yaw, rms [deg]": "yaw_error_deg",
}
"""What is shown of the trials, and the column that holds it."""


def report(study: Trials, jobs: int, out: Path, console: Console, engine: Engine | None = None) -> None:
    """Makes the trials and shows what came of them.

    Args:
        study: What is to be done.
        jobs: Processes at a time.
        out: Where results and figures go.
        console: Where progress and tables are shown.
        engine: Where the trials are made; processes of this machine without.
    """
    if study.rows:
        console.print(variation_table(study.variation, study.rows))
    done = gather(study.parts, work, jobs, console, "trials", tell=so_far, engine=engine)
    table = write_results(done, out)
    for shown in result_tables(table):
        console.print(shown)
    for line in [*lived_with(table), *false_alarm_lines(table), *mishap_lines(table), *worst_lines(table)]:
        console.print(line, highlight=False, soft_wrap=True)
    places = [table, *_plots(table, [row.key for row in study.rows], out)]
    console.print("written: " + ", ".join(str(place) for place in places), highlight=False, soft_wrap=True)
    if importlib.util.find_spec("matplotlib") is None:
        console.print("no plots without matplotlib: pip install 'turnscrew[plots]'", highlight=False)


def so_far(done: Sequence[Done]) -> str:
    """Successes among the trials that are done."""
    return f"{sum(found['passed'] for found in done)} of {len(done)} passed"


def share(count: int, of: int) -> str:
    """A counted share with its 95 % interval."""
    if not of:
        return "none"
    low, high = wilson(count, of)
    return f"{count} of {of} = {100 * count / of:.1f} % (95 %: {100 * low:.0f} to {100 * high:.0f} %)"


def variation_table(variation: str, rows: Sequence[Row]) -> Table:
    """What is varied, from which distribution, and why."""
    shown = Table(title=f"Variation: {variation}", box=SIMPLE)
    for heading in ("key", "drawn", "unit", "what", "source", "when"):
        shown.add_column(heading)
    known: dict[str, Any] = {name: field.json_schema_extra for name, field in fields()}
    for row in rows:
        when = "" if row.when is None else f"{row.when[0]} = {row.when[1]}"
        cells = (row.key, str(row.drawn), known[row.key]["unit"], row.meaning, row.source, when)
        shown.add_row(*(escape(cell) for cell in cells))
    return shown


def result_tables(table: Path) -> list[Table]:
    """Success and pace of the trials in a file, and the causes of the failures, if there are any."""
    with duckdb.connect() as connection:
        connection.execute(f"CREATE VIEW trials AS SELECT * FROM '{_quoted(table)}'")
        passed, count = connection.execute("SELECT count(*) FILTER (passed), count(*) FROM trials").fetchall()[0]
        shown = Table(title=f"Goal reached: {share(passed, count)}", box=SIMPLE)
        for heading in ("of trials that passed", "median", "5 %", "95 %", "least", "largest"):
            shown.add_column(heading)
        for name, column in MEASURES.items():
            found = connection.execute(
                f"SELECT median(x), quantile_cont(x, .05), quantile_cont(x, .95), min(x), max(x) "
                f"FROM (SELECT {column}::DOUBLE AS x FROM trials WHERE passed)"
            ).fetchall()[0]
            shown.add_row(escape(name), *("" if value is None else f"{value:.4g}" for value in found))
        causes = connection.execute(
            "SELECT outcome, phase, count(*), string_agg(round::VARCHAR, ', ' ORDER BY seed), "
            "string_agg(seed::VARCHAR, ', ' ORDER BY seed), arg_min(evidence, seed) FROM trials WHERE NOT passed "
            "GROUP BY outcome, phase ORDER BY count(*) DESC, outcome, phase"
        ).fetchall()
    return [shown, *([_cause_table(causes, count)] if causes else [])]


def lived_with(table: Path) -> list[str]:
    """Trouble that was named and did not end the run: how often, in how many trials, whether they passed or not."""
    with duckdb.connect() as connection:
        found = connection.execute(
            "SELECT kind, sum(number), count(*) FROM (SELECT split_part(word, ' ', 1) AS kind, "
            "split_part(word, ' ', 2)::INT AS number FROM (SELECT unnest(string_split(warnings, ', ')) AS word "
            f"FROM '{_quoted(table)}' WHERE warnings != '')) GROUP BY kind ORDER BY kind"
        ).fetchall()
    return [f"lived with: {kind} {number} times, in {trials} trials" for kind, number, trials in found]


def false_alarm_lines(table: Path) -> list[str]:
    """Trouble that was named and was not there, in trials to which nothing was done: by fault, in 100 rounds."""
    with duckdb.connect() as connection:
        (rounds,) = connection.execute(
            f"SELECT coalesce(sum(rounds), 0) FROM '{_quoted(table)}' WHERE mishap = ''"
        ).fetchall()[0]
        found = connection.execute(
            "SELECT split_part(word, ' ', 1) AS kind, sum(split_part(word, ' ', 2)::INT) FROM (SELECT "
            f"unnest(string_split(false_alarms, ', ')) AS word FROM '{_quoted(table)}' "
            "WHERE mishap = '' AND false_alarms != '') GROUP BY kind ORDER BY kind"
        ).fetchall()
    if not rounds:
        return []
    every = [*found, ("all", sum(count for _, count in found))] if len(found) != 1 else found
    lines = []
    for kind, count in every:
        low, high = (100.0 * bound / rounds for bound in poisson(int(count)))
        lines.append(
            f"false alarms: {kind} {count} in {rounds} rounds = {100.0 * count / rounds:.2f} in 100 "
            f"(95 %: {low:.2f} to {high:.2f})"
        )
    return lines


def mishap_lines(table: Path) -> list[str]:
    """In how many trials what was to go wrong did go wrong (a run may be over before), and how soon it was named."""
    with duckdb.connect() as connection:
        found = connection.execute(
            "SELECT mishap, count(*) FILTER (mishap_phase != ''), "
            "count(*) FILTER (mishap_phase != '' AND passed), count(*), "
            "count(*) FILTER (named = 'named'), count(*) FILTER (named = 'missed'), "
            "count(*) FILTER (named = 'nothing'), "
            "median(delay_s) FILTER (named = 'named'), max(delay_s) FILTER (named = 'named') "
            f"FROM '{_quoted(table)}' WHERE mishap != '' GROUP BY mishap"
        ).fetchall()
    lines = []
    for mishap, met, passed, count, named, missed, nothing, median, latest in found:
        happened = f"{mishap}: happened in {met} of {count} trials, {passed} of which passed"
        lines.append(f"{happened}; the commands make trials without it")
        if named + missed:
            delay = f", {median:.2f} s after the trouble began (at most {latest:.2f} s)" if named else ""
            lines.append(f"{mishap}: named in {share(named, named + missed)}{delay}; missed in {missed}")
        if nothing:
            lines.append(f"{mishap}: led to nothing that should be named in {nothing}")
    return lines


def worst_lines(table: Path) -> list[str]:
    """The trials that went worst, each with the command that makes it again: fewest rounds, then largest tilt."""
    with duckdb.connect() as connection:
        found = connection.execute(
            f"SELECT seed, outcome, rounds, max_tilt_deg, command FROM '{_quoted(table)}' "
            "ORDER BY passed, rounds, max_tilt_deg DESC NULLS FIRST, seed LIMIT ?", [WORST]
        ).fetchall()  # fmt: skip
    lines = ["worst trials:"]
    for seed, outcome, rounds, tilt, command in found:
        tilted = "" if tilt is None else f", tilt up to {tilt:.1f} deg"
        lines += [f"  seed {seed}: {outcome}, {rounds} rounds{tilted}", f"    {command}"]
    return lines


def _cause_table(causes: Sequence[tuple[Any, ...]], count: int) -> Table:
    shown = Table(title="Why trials failed", box=SIMPLE)
    for heading in ("outcome", "phase", "trials", "rounds before", "seeds", "evidence of the first"):
        shown.add_column(heading)
    for outcome, phase, number, rounds, seeds, evidence in causes:
        shown.add_row(*(escape(cell) for cell in (outcome, phase, share(number, count), rounds, seeds, evidence)))
    return shown


def _plots(table: Path, keys: Sequence[str], out: Path) -> list[Path]:
    """The plot, where matplotlib is installed."""
    if importlib.util.find_spec("matplotlib") is None:
        return []
    from turnscrew.show.trials_plots import trials_figure

    return [trials_figure(table, keys, out / "figures" / "trials.png")]


def _quoted(path: Path) -> str:
    return str(path).replace("'", "''")
