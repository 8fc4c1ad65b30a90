"""What `turnscrew envelope` shows and writes, and its one line for whatever is wrong."""

from __future__ import annotations

import sys
from pathlib import Path

import duckdb
import pytest

from turnscrew import cli
from turnscrew.show.envelope_plots import kind


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path):
    """Runs `turnscrew envelope` in an empty folder; returns status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["turnscrew", "envelope", *words])
        status = cli.main()
        shown = capsys.readouterr()
        return status, shown.out, shown.err

    return run


def test_one_handle_is_shown_angle_by_angle(call) -> None:
    status, out, _ = call("--angles", "3", "--out", "out")
    assert status == 0
    assert "angle [deg]" in out
    assert "MF squeeze" in out
    assert "up to M3" in out
    assert Path("out/envelope.parquet").is_file()


def test_several_handles_and_frictions_are_told_apart(call) -> None:
    pytest.importorskip("matplotlib")
    status, out, _ = call(
        "--angles", "2", "--radius", "0.01", "--radius", "0.018", "--friction", "0.6", "--friction", "1"
    )
    assert status == 0
    assert "angle [deg]" not in out
    rows = duckdb.sql(
        "SELECT radius, friction, grasp, min(torque), max(torque) FROM 'runs/envelope/envelope.parquet' GROUP BY ALL"
    ).fetchall()
    assert len(rows) == 2 * 2 * 3
    assert all(0.05 < low <= high < 1.0 for *_, low, high in rows)
    assert Path("runs/envelope/envelope.png").is_file()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--squeeze", "0"), "largest squeeze 0: must be a force above 0 N"),
        (("--radius", "2"), "tool.handle.radius = 2: must be a number, at least 0.005 m and at most 0.05 m"),
        (("--friction", "7"), "contact.finger_friction = 7: must be a number, at least 0.3 and at most 1.5"),
        (("--set", "tool.handle.radios=1"), "tool.handle.radios: unknown key; the nearest is tool.handle.radius"),
        (("--angles", "1"), "Invalid value for '--angles'"),
    ],
)
def test_bad_input_is_one_line(call, words: tuple[str, ...], line: str) -> None:
    status, out, err = call(*words)
    assert status == 2
    assert out == ""
    assert err.startswith(f"turnscrew: {line}")
    assert err.count("\n") == 1
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("name", "expected"),
    [("MFJ2", "drive"), ("TH friction", "friction"), ("RF squeeze", "squeeze"), ("tip side force", "tip"),
     ("tip lean", "tip")],
)  # fmt: skip
def test_kinds_of_limits(name: str, expected: str) -> None:
    assert kind(name) == expected
