"""The record of a run: written a second at a time, so that a run killed half-way leaves all but its last second.

While a run goes on, `segments/` grows by one file for each second of simulated time.  At the end they are put
together into `log.npz` and `signals.parquet`.  Every file appears whole or not at all (written aside, then renamed).

Nothing is compressed: the noise in the last bits of a log leaves 4 % to win, and winning it takes 6 % of the
time of a run.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol

import numpy as np

from turnscrew.errors import RecordError
from turnscrew.geometry.arrays import Array
from turnscrew.plant.export import portable
from turnscrew.plant.log import LOG, MODEL, SEGMENTS, STEP_FIELDS, read_log
from turnscrew.task.scenario import Scenario
from turnscrew.task.scenario_text import to_toml
from turnscrew.task.signal_table import SIGNALS, SignalTable, read_signals, write_parquet
from turnscrew.task.summary import Summary

__all__ = ["Recorder", "read_log", "read_signals"]

SCENARIO = "scenario.toml"
SUMMARY = "summary.json"
OWN = (LOG, SIGNALS, SUMMARY, SCENARIO, MODEL.parts[0], SEGMENTS, "video.mp4", "video.webp")


class PlantState(Protocol):
    """What `mjData` offers of a plant's state."""

    time: float
    qpos: Array
    qvel: Array
    ctrl: Array
    act: Array
    qacc_warmstart: Array


class Recorder:
    """Writes a run into a folder; a context manager, so that the record is whole however the run ends."""

    def __init__(self, folder: Path, scenario: Scenario) -> None:
        """Makes sure that the folder can be written; an earlier record in it stays until there is something to record.

        Args:
            folder: Where to; made if it does not exist.
            scenario: The scenario of the run.

        Raises:
            RecordError: The folder cannot be written, or holds files of these names that are no record.
        """
        self.folder = folder
        self._rows_per_segment = round(scenario.rate.plant)
        self._log = np.empty((0, 0))
        self._slices: dict[str, slice] = {}
        self._row = 0
        # a tick comes before its step: one more of it may wait when the steps fill their page
        self._signals = SignalTable(self._rows_per_segment + 1)
        self._written = 0
        self._begun = self._closed = False
        self._scenario = to_toml(scenario)
        self._guard(self._check)

    def model(self, xml: str) -> None:
        """Writes `model/`: the MJCF that the plant was compiled from, and the files that it names.

        Raises:
            ModelError: A file that it names is missing.
            RecordError: The folder cannot be written.
        """
        xml, assets = portable(xml)
        self._begin()
        for name, content in {**assets, MODEL.name: xml.encode()}.items():
            self._write(MODEL.parent / name, partial(_save_bytes, content))

    def step(self, state: PlantState) -> None:
        """Logs the state before a plant step with the controls of that step; once more after the last step."""
        if self._row == len(self._log):
            self._turn_page(state)
        row = self._log[self._row]
        at = self._slices
        row[0] = state.time
        row[at["qpos"]] = state.qpos
        row[at["qvel"]] = state.qvel
        row[at["ctrl"]] = state.ctrl
        row[at["act"]] = state.act
        row[at["qacc_warmstart"]] = state.qacc_warmstart
        self._row += 1

    def tick(self, time: float, **signals: object) -> None:
        """Logs one tick of the loop.

        Args:
            time: Simulated time [s].
            **signals: Anything made of dataclasses, mappings, arrays, numbers and words; columns are
                named by path, so `estimate=Estimate(...)` gives `estimate.F_s.f_z` and so on.
        """
        self._signals.append({"time": time, **signals})

    def finish(self, summary: Summary) -> None:
        """Puts the record together and writes the summary last: where it is, the record is whole."""
        self.close()
        self._write(Path(SUMMARY), lambda path: path.write_text(summary.model_dump_json(indent=2) + "\n"))

    def close(self) -> None:
        """Puts the segments together into `log.npz` and `signals.parquet`; does nothing the second time."""
        if self._closed:
            return
        self._closed = True
        self._flush()
        if not self._written:
            return
        log = read_log(self.folder)
        self._write(Path(LOG), lambda path: _save(path, {name: getattr(log, name) for name in STEP_FIELDS}))
        columns = read_signals(self.folder)
        if columns:
            self._write(Path(SIGNALS), lambda path: write_parquet(path, columns))
        self._guard(lambda: shutil.rmtree(self.folder / SEGMENTS))

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _here(self) -> list[str]:
        return [name for name in OWN if (self.folder / name).exists()]

    def _check(self) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        trial = self.folder / ".trial.part"
        trial.touch()
        trial.unlink()
        here = self._here()
        if here and SCENARIO not in here:
            raise RecordError(
                f"{self.folder}: holds {here[0]} but no {SCENARIO}, so it is no earlier run; choose another --out"
            )

    def _begin(self) -> None:
        if not self._begun:
            self._begun = True
            self._guard(self._remove_earlier)
            self._write(Path(SCENARIO), lambda path: path.write_text(self._scenario, encoding="utf-8"))

    def _remove_earlier(self) -> None:
        for name in self._here():
            path = self.folder / name
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def _turn_page(self, state: PlantState) -> None:
        if self._slices:
            self._flush()
            return
        self._begin()
        start = 0
        for name in STEP_FIELDS:
            width = np.size(getattr(state, name))
            self._slices[name] = slice(start, start + width)
            start += width
        self._log = np.empty((self._rows_per_segment, start))

    def _flush(self) -> None:
        if not self._row:
            return
        rows = self._log[: self._row]
        arrays = {f"log.{name}": rows[:, at] for name, at in self._slices.items()}
        arrays["log.time"] = rows[:, 0]
        arrays |= self._signals.take()
        self._write(Path(SEGMENTS) / f"{self._written:06d}.npz", lambda path: _save(path, arrays))
        self._written += 1
        self._row = 0

    def _write(self, name: Path, fill: Callable[[Path], Any]) -> None:
        path = self.folder / name
        aside = path.with_name(f".{path.name}.part")

        def whole() -> None:
            path.parent.mkdir(parents=True, exist_ok=True)
            fill(aside)
            os.replace(aside, path)

        self._guard(whole)

    def _guard(self, work: Callable[[], Any]) -> None:
        try:
            work()
        except OSError as error:
            reason = error.strerror or " ".join(str(error).split())
            raise RecordError(f"{self.folder}: cannot be written: {reason}; choose another --out") from None


def _save_bytes(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def _save(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    with path.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]
