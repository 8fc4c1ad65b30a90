"""Small dense algebra as machine code: what NumPy would do in twenty calls of a microsecond each, done in one.

Vectors of three and matrices of a few dozen rows cost NumPy far more in calls than in arithmetic, and the loop has
half a millisecond for hundreds of them.  A function under `compiled` is plain Python over arrays and numbers that Numba
translates at its first call (seconds) and keeps on disk beside its source, so every later process starts with it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., Any])

COMPILING = "numba:compile"

_newest: dict[int, float] = {}
"""Of each compiled function, when its source or that of anything compiled that it calls last changed."""


def compiled(function: Function) -> Function:
    """Translates a function at its first call, and keeps the result on disk.

    Arithmetic is that of IEEE 754 in the order written, so results do not depend on what the translator knows of the
    machine.  A division by zero gives an infinity, as in NumPy.

    Args:
        function: Over C-contiguous arrays and numbers; it calls nothing but NumPy and other compiled functions, which
            it names at the top of its module.
    """
    kernel = njit(cache=True, error_model="numpy")(function)
    called = [function.__globals__.get(name) for name in function.__code__.co_names]
    source = Path(function.__code__.co_filename)
    newest = max([source.stat().st_mtime, *(_newest.get(id(other), 0.0) for other in called)])
    _newest[id(kernel)] = newest
    _forget(kernel, source, function, newest)
    return cast(Function, kernel)


def on_translation(tell: Callable[[], None]) -> None:
    """Calls `tell` once, before this process translates anything; what is on disk already costs nothing to load."""
    event.register(COMPILING, _Once(tell))  # type: ignore[no-untyped-call]


class _Once(event.Listener):
    """Hears of the first translation and of no other."""

    def __init__(self, tell: Callable[[], None]) -> None:
        self.tell = tell

    def on_start(self, event_: Any) -> None:
        event.unregister(COMPILING, self)  # type: ignore[no-untyped-call]
        self.tell()

    def on_end(self, event_: Any) -> None:
        """Not listened for."""


def _forget(kernel: Any, source: Path, function: Callable[..., Any], newest: float) -> None:
    """Drops what is on disk and older than a function that is called: Numba looks at the caller's own source only."""
    for index in Path(kernel.stats.cache_path).glob(f"{source.stem}.{function.__qualname__}-*.nbi"):
        if index.stat().st_mtime < newest:
            index.unlink(missing_ok=True)
