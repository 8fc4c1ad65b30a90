"""Compiled functions: the same numbers as interpreted, kept on disk, and forgotten when what they call has changed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from turnscrew.geometry.compiled import compiled

LEAF = "from turnscrew.geometry.compiled import compiled\n\n\n@compiled\ndef leaf(x):\n    return {factor} * x\n"
MIDDLE = (
    "from leaf import leaf\nfrom turnscrew.geometry.compiled import compiled\n\n\n"
    "@compiled\ndef middle(x):\n    return leaf(x) + 1.0\n"
)
CALLER = (
    "from middle import middle\nfrom turnscrew.geometry.compiled import compiled, on_translation\n\n\n"
    "@compiled\ndef caller(x):\n    return 2.0 * middle(x)\n\n\n"
    "told = []\non_translation(lambda: told.append(1))\n"
    "print(caller(1.0), sum(caller.stats.cache_hits.values()), len(told))\n"
)


@compiled
def quotient(a: float, b: float) -> float:
    """Two numbers divided."""
    return a / b


def test_a_division_by_zero_is_an_infinity_as_in_numpy():
    assert quotient(1.0, 0.0) == np.inf
    assert np.isnan(quotient(0.0, 0.0))


def run(folder: Path) -> tuple[float, int, int]:
    """What the caller prints in a process of its own: its answer, how often it was found on disk, what it was told."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": ""}
    printed = subprocess.run(
        [sys.executable, "caller.py"], cwd=folder, capture_output=True, text=True, check=True, env=environment
    ).stdout.split()
    return float(printed[0]), int(printed[1]), int(printed[2])


def test_a_change_two_calls_down_is_seen_and_translations_are_told_of_once(tmp_path):
    (tmp_path / "leaf.py").write_text(LEAF.format(factor=3.0))
    (tmp_path / "middle.py").write_text(MIDDLE)
    (tmp_path / "caller.py").write_text(CALLER)
    assert run(tmp_path) == (8.0, 0, 1)
    assert run(tmp_path) == (8.0, 1, 0)
    # a file system that counts whole seconds must still tell the two apart
    changed = time.time() + 2.0
    (tmp_path / "leaf.py").write_text(LEAF.format(factor=5.0))
    os.utime(tmp_path / "leaf.py", (changed, changed))
    assert run(tmp_path) == (12.0, 0, 1)
