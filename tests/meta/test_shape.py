"""The shape of the code: small files, small functions, no prints and no asserts on input."""

from __future__ import annotations

import ast
import statistics
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "turnscrew"
FILES = sorted(SOURCE.rglob("*.py"))

LONGEST_FILE = 400
LONGEST_BODY = 40
MEDIAN_FILE = 150
PRINTS = {"cli", "show", "__main__.py"}


def body_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function's body, its docstring left out."""
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    return 0 if not body else (body[-1].end_lineno or 0) - body[0].lineno + 1


def flaws(code: str, *, may_print: bool) -> list[str]:
    found = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and body_lines(node) >= LONGEST_BODY:
            found.append(f"line {node.lineno}: {node.name} has {body_lines(node)} lines")
        if isinstance(node, ast.Assert):
            found.append(f"line {node.lineno}: assert")
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print" and not may_print:
            found.append(f"line {node.lineno}: print")
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_file_is_in_shape(path: Path) -> None:
    code = path.read_text(encoding="utf-8")
    inside = path.relative_to(SOURCE)
    assert code.count("\n") <= LONGEST_FILE
    assert flaws(code, may_print=inside.parts[0] in PRINTS) == []


def test_median_file_is_short() -> None:
    lengths = [path.read_text(encoding="utf-8").count("\n") for path in FILES if path.name != "__init__.py"]
    assert statistics.median(lengths) < MEDIAN_FILE


def test_flaws_are_seen() -> None:
    long = "def f():\n" + "    x = 1\n" * LONGEST_BODY
    assert len(flaws(long + "assert x\nprint(x)\n", may_print=False)) == 3


def test_lock_files_name_no_address() -> None:
    locks = sorted(ROOT.glob("*.lock"))
    assert [lock.name for lock in locks] == ["requirements-dev.lock", "requirements.lock"]
    for lock in locks:
        text = lock.read_text(encoding="utf-8")
        assert "://" not in text
        assert "index-url" not in text
        assert "--hash=sha256:" in text


def test_docs_name_only_files_that_exist() -> None:
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for target in links(page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def links(text: str) -> list[str]:
    import re

    found = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text)
    return [target for target in found if "://" not in target]
