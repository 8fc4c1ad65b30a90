"""A study is done in parts, each with a file of its own: killed at any moment, it goes on from what is finished."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypeVar

from joblib import Parallel, delayed

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

Engine: TypeAlias = Callable[[Callable[[Any], Done], Sequence[Any], int], Iterator[tuple[int, Done]]]
"""Does work on parts, so many at a time, and yields a part's place with its findings as soon as it has them."""


def part_file(out: Path, name: str, *depends: Any) -> Path:
    """The file of a part, named so that nothing else is taken for it.

    Args:
        out: Folder of the study.
        name: What a reader should see in the file's name.
        depends: All that the part's findings depend on, as JSON takes it; the version is added.
    """
    key = json.dumps([*depends, __version__])
    return out / PARTS / f"{name}-{hashlib.sha256(key.encode()).hexdigest()[:12]}.json"


def finish(
    todo: Sequence[P], work: Callable[[P], Done], jobs: int, engine: Engine | None = None
) -> Iterator[tuple[P, Done]]:
    """Parts as they are finished, those first that an earlier study has left.

    Args:
        todo: Units of work.
        work: Does one; a module's function, for it is sent to other processes.
        jobs: Processes at a time.
        engine: Where they run; processes of this machine without.
    """
    left = []
    for part in todo:
        if part.file.is_file():
            yield part, json.loads(part.file.read_text())
        else:
            left.append(part)
    chosen = engine or (processes if jobs > 1 and len(left) > 1 else here)
    for index, done in chosen(work, left, jobs):
        _keep(left[index], done)
        yield left[index], done


def here(work: Callable[[Any], Done], todo: Sequence[Any], jobs: int) -> Iterator[tuple[int, Done]]:
    """Works on one part after the other, in this process."""
    yield from ((index, work(part)) for index, part in enumerate(todo))


def processes(work: Callable[[Any], Done], todo: Sequence[Any], jobs: int) -> Iterator[tuple[int, Done]]:
    """Works on the parts in fresh processes of this machine: OpenGL's state would not survive a fork.

    Each writes down what it found: should the study be killed, the parts under way are not lost. No more are handed
    out than can be begun, so that the processes do not go on for long.
    """
    pool = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="n_jobs")
    yield from pool(delayed(_kept)(work, index, part) for index, part in enumerate(todo))


def write_whole(path: Path, fill: Callable[[Path], Any]) -> None:
    """Writes aside, then renames: a file is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # two processes may be at the same part: one of a study that was killed, one of the study that goes on
    aside = path.with_name(f".{path.name}.{os.getpid()}.part")
    fill(aside)
    os.replace(aside, path)


def _kept(work: Callable[[Any], Done], index: int, part: Any) -> tuple[int, Done]:
    done = work(part)
    _keep(part, done)
    return index, done


def _keep(part: Part, done: Done) -> None:
    """Writes down what a part found, unless that has been done; what else the part leaves is there before."""
    if not part.file.is_file():
        write_whole(part.file, lambda path: path.write_text(json.dumps(done)))
