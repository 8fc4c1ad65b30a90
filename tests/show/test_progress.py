"""Progress: plain lines where there is no terminal, a live table where there is one."""

from __future__ import annotations

import io
from dataclasses import replace

from rich.console import Console

from turnscrew.show.progress import ProgressView, cells
from turnscrew.task.summary import Progress

NOW = Progress(12.34, "relocate", 2, 2.0, 0.04, 5.25, 0.02, 1.75)


def test_every_figure_is_shown_with_its_unit() -> None:
    assert cells(NOW) == {
        "time": "12.3 s", "phase": "relocate", "round": "3", "screw": "114.6 deg", "torque": "0.040 N.m",
        "tip force": "5.2 N", "tilt": "1.15 deg", "real time": "x 1.75",
    }  # fmt: skip


def test_plain_lines_come_once_a_second() -> None:
    text = io.StringIO()
    with ProgressView(Console(file=text)) as view:
        for tick in range(1001):
            view.show(replace(NOW, time=tick * 0.005))
    lines = text.getvalue().splitlines()
    assert len(lines) == 6
    assert "\x1b" not in text.getvalue()
    assert lines[0].startswith("time 0.0 s  phase relocate  round 3")


def test_terminal_gets_a_live_table() -> None:
    text = io.StringIO()
    with ProgressView(Console(file=text, force_terminal=True, width=120)) as view:
        view.show(NOW)
    assert "relocate" in text.getvalue()
    assert "\x1b" in text.getvalue()
