"""The ledger of equations: complete, and every name in it is real."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
NUMBERED = [f"({number})" for number in range(1, 19)]
UNNUMBERED = {
    "[.]x", "M", "C", "G", "F_h = diag(R', R') G f", "v_z = p/(2 pi) w_z", "tau_s,z = k_s theta", "(7) solved",
    "nu = Lambda xdot", "T", "U", "gamma_d", "rolling", "rolled", "V = G' R nu", "J qdot = G' R nu",
    "F'_d + k_f int F_e", "X_d", "X_c = X_d + k_m F'_d", "inverse Jacobian", "footnote 7",
}  # fmt: skip
"""The equations of the paper that have no number, by the names that the ledger gives them."""


class Entry(NamedTuple):
    equation: str
    meaning: str
    function: str
    test: str


def entries() -> list[Entry]:
    text = (ROOT / "docs" / "ledger.md").read_text(encoding="utf-8")
    rows = [line.strip("|").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    cells = [[cell.strip().strip("`") for cell in row] for row in rows]
    return [Entry(*row) for row in cells if row[0] != "equation"]


ENTRIES = entries()


def found(name: str) -> object:
    """What a dotted name stands for."""
    parts = name.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            thing: object = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError as error:
            if error.name is None or not name.startswith(error.name):
                raise
            continue
        for part in parts[cut:]:
            thing = getattr(thing, part)
        return thing
    raise LookupError(name)


def test_every_equation_has_one_entry() -> None:
    assert [entry.equation for entry in ENTRIES if re.fullmatch(r"\(\d+\)", entry.equation)] == NUMBERED
    others = [entry.equation for entry in ENTRIES if entry.equation not in NUMBERED]
    assert sorted(others) == sorted(UNNUMBERED)


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.equation)
def test_function_exists_and_tells_its_source(entry: Entry) -> None:
    thing = found(entry.function)
    assert callable(thing)
    assert getattr(thing, "__doc__", None), f"{entry.function} has no docstring"


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.equation)
def test_test_exists(entry: Entry) -> None:
    file, _, function = entry.test.partition("::")
    names = {
        node.name
        for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef)
    }
    assert function in names


def test_a_wrong_name_is_seen() -> None:
    with pytest.raises(AttributeError):
        found("turnscrew.geometry.rotations.no_such_function")
    with pytest.raises(AttributeError):
        found("turnscrew.no_such_module.f")
