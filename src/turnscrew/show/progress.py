"""A run as it goes on: a live line on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import math
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.table import Table

from turnscrew.task.summary import Progress

EVERY = 1.0
"""Simulated time between two plain lines [s]: some 25 lines for five rounds."""


class ProgressView:
    """Shows progress; a context manager whose `show` is called at every tick."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live = Live(console=console, refresh_per_second=8) if console.is_terminal else None
        self._next = 0.0
        self._told = False

    def show(self, progress: Progress) -> None:
        """Shows the newest state; cheap enough for every tick."""
        if progress.time < self._next:
            return
        if self._live is None:
            self._next = progress.time + EVERY
            self._console.print(line(progress), highlight=False, soft_wrap=True)
        else:
            # more often than the eye follows would only cost time
            self._next = progress.time + 0.1
            self._live.update(table(progress))

    def tell(self, what: str) -> None:
        """Shows how planning gets on before the run; elsewhere than on a terminal, that it has begun."""
        if self._live is not None:
            self._live.update(f"planning the gait for this handle: {what}")
        elif not self._told:
            self._told = True
            self._console.print("planning the gait for this handle (up to a minute; it is kept)", soft_wrap=True)

    def tell_of_translation(self) -> None:
        """Says why nothing moves for a while."""
        what = "making machine code of the numerical functions (once on this machine, up to a minute)"
        if self._live is not None:
            self._live.update(what)
        else:
            self._console.print(what, soft_wrap=True)

    def __enter__(self) -> ProgressView:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()


def cells(progress: Progress) -> dict[str, str]:
    """What is shown: name and value, with its unit."""
    return {
        "time": f"{progress.time:.1f} s",
        "phase": progress.phase,
        "round": f"{progress.round + 1}",
        "screw": f"{math.degrees(progress.screw_angle):.1f} deg",
        "torque": f"{progress.torque:.3f} N.m",
        "tip force": f"{progress.tip_force:.1f} N",
        "tilt": f"{math.degrees(progress.tilt):.2f} deg",
        "real time": f"x {progress.real_time_factor:.2f}",
    }


def line(progress: Progress) -> str:
    """The state as one plain line."""
    return "  ".join(f"{name} {value}" for name, value in cells(progress).items())


def table(progress: Progress) -> Table:
    """The state as a table of one row."""
    shown = Table(box=None, pad_edge=False, header_style="dim")
    for name in cells(progress):
        shown.add_column(name, min_width=9, no_wrap=True)
    shown.add_row(*cells(progress).values())
    return shown
