"""A study is done in parts, each with a file of its own: killed at any moment, it goes on from what is finished."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Protocol, TypeVar

from turnscrew import __version__

PARTS = "parts"

Done = dict[str, Any]
"""What a part has found out, as JSON takes it."""


class Part(Protocol):
    """One unit of a study's work."""

    @property
    def file(self) -> Path:
        """Where its findings go."""
        ...


P = TypeVar("P", bound=Part)


def part_file(out: Path, name: str, *depends: Any) -> Path:
    """The file of a part, named so that nothing else is taken for it.

    Args:
        out: Folder of the study.
        name: What a reader should see in the file's name.
        depends: All that the part's findings depend on, as JSON takes it; the version is added.
    """
    key = json.dumps([*depends, __version__])
    return out / PARTS / f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:12]}.json"


def finish(todo: Sequence[P], work: Callable[[P], Done], jobs: int) -> Iterator[tuple[P, Done]]:
    """Parts as they are finished, those first that an earlier study has left.

    Args:
        todo: Units of work.
        work: Does one; a module's function, for it is sent to other processes.
        jobs: Processes at a time.
    """
    left = []
    for part in todo:
        if part.file.is_file():
            yield part, json.loads(part.file.read_text())
        else:
            left.append(part)
    if jobs == 1 or len(left) < 2:
        yield from ((part, _kept(part, work)) for part in left)
        return
    # a fresh process: OpenGL's state does not survive a fork
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        under_way = {pool.submit(_kept, part, work): part for part in left}
        for future in as_completed(under_way):
            yield under_way[future], future.result()


def write_whole(path: Path, fill: Callable[[Path], Any]) -> None:
    """Writes aside, then renames: a file is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.part")
    fill(aside)
    os.replace(aside, path)


def _kept(part: P, work: Callable[[P], Done]) -> Done:
    """Does a part and writes down what it found; what else it leaves is there before."""
    done = work(part)
    write_whole(part.file, lambda path: path.write_text(json.dumps(done)))
    return done
