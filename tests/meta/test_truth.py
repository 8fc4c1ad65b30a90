"""No truth in the loop: what the robot knows, it knows through its sensors."""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import pytest

from turnscrew import signals

SOURCE = Path(__file__).parents[2] / "src" / "turnscrew"
LOOP = ("estimate", "decide", "control", "actuate")
LOOP_FILES = sorted(path for room in LOOP for path in (SOURCE / room).rglob("*.py"))
TASK_FILES = sorted((SOURCE / "task").rglob("*.py"))

STATE = {"truth", "mjdata", "qacc_warmstart", "xpos", "xmat", "tool_pose", "fingertip_forces", "thread_torque"}
"""Names under which a plant gives its state away."""

MAY_JUDGE = {"judge.py", "fasten.py", "record.py"}
"""Files of `task` that may touch the truth: they record and judge; neither hands anything back to the loop."""

SENSING = {"loop.py": "_sense"}
"""The one function of the loop that reads the plant, for the sensors, which make a `Measurement` of it."""


def names(tree: ast.AST) -> Iterator[str]:
    """Every name that code reads, binds, calls or imports; prose does not count."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.arg | ast.keyword) and node.arg is not None:
            yield node.arg
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.name for alias in node.names)
            yield from str(getattr(node, "module", "")).split(".")


def leaks(code: str, forbidden: set[str]) -> set[str]:
    return {name for name in names(ast.parse(code)) if name.lower() in forbidden}


@pytest.mark.parametrize("path", LOOP_FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_loop_has_no_name_for_the_truth(path: Path) -> None:
    code = path.read_text(encoding="utf-8")
    assert leaks(code, STATE | {"mujoco", "plant", "sense", "task"}) == set()


@pytest.mark.parametrize("path", TASK_FILES, ids=lambda path: path.name)
def test_only_judges_and_wiring_touch_the_truth(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    if path.name in SENSING:
        tree = without(tree, SENSING[path.name])
    if path.name not in MAY_JUDGE:
        assert leaks(ast.unparse(tree), STATE) == set()


def without(tree: ast.Module, function: str) -> ast.Module:
    """The module with the body of one function taken out."""
    found = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name == function]
    assert len(found) == 1, f"{function} is the loop's only reader of the plant"
    (node,) = found
    made = node.returns
    assert made is not None
    assert "Measurement" in ast.unparse(made), "what leaves it is a measurement"
    node.body = [ast.Pass()]
    return tree


@pytest.mark.parametrize(
    "code", ["x = cell.truth()", "from turnscrew.plant.truth import Truth", "def f(truth): ...", "p = data.xpos[3]"]
)
def test_a_leak_is_seen(code: str) -> None:
    assert leaks(code, STATE)


def test_what_the_robot_measures_holds_no_tool_state() -> None:
    allowed = {"time", "q", "v", "f_F", "tau", "vision", "blind", "tau_sent"}
    assert {field.name for field in dataclasses.fields(signals.Measurement)} <= allowed
