"""The import law: downwards only, rooms apart, and each heavy library in the rooms that may use it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "turnscrew"
FILES = sorted(SOURCE.rglob("*.py"))

LAYERS = (
    {"errors", "values"},
    {"geometry"},
    {"robot", "contact"},
    {"signals"},
    {"sense", "estimate", "decide", "control", "actuate", "plant"},
    {"task"},
    {"study", "env", "show"},
    {"cli"},
    {"__main__"},
)
ROOMS = {"sense", "estimate", "decide", "control", "actuate", "plant"}
LIBRARIES = {
    "mujoco": {"plant", "robot", "show"},
    "cv2": {"sense"},
    "numba": {"geometry"},
    "casadi": {"geometry", "estimate", "decide"},
    "gymnasium": {"env"},
    "gymnasium_robotics": set(),
    "rich": {"cli", "show"},
    "typer": {"cli"},
    "av": {"show"},
    "PIL": {"show"},
    "matplotlib": {"show"},
    "duckdb": {"task", "study", "show"},
}
TORQUE_FREE_ROOT = "__init__"


def part(path: Path) -> str:
    """The top-level part of the package that a file belongs to."""
    return path.relative_to(SOURCE).parts[0].removesuffix(".py")


def imported(tree: ast.AST) -> Iterator[str]:
    """Full names of everything that a module imports, lazily or not."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports name their module in full"
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def own_parts(tree: ast.AST) -> set[str]:
    names = (name.split(".") for name in imported(tree))
    return {name[1] for name in names if name[0] == "turnscrew" and len(name) > 1 and name[1] != "__version__"}


def level(name: str) -> int:
    return next(index for index, layer in enumerate(LAYERS) if name in layer)


def breaches(path: Path, tree: ast.AST) -> list[str]:
    """What a file imports against the law."""
    here = part(path)
    if here == "__init__":
        return [f"the package itself imports {name}" for name in own_parts(tree)]
    found = []
    for other in own_parts(tree) - {here}:
        if level(other) > level(here):
            found.append(f"{here} imports {other}, which lies above it")
        if other in ROOMS and here in ROOMS:
            found.append(f"{here} imports {other}: rooms meet in task only")
    libraries = {name.partition(".")[0] for name in imported(tree)}
    found += [
        f"{here} imports {library}"
        for library in libraries & LIBRARIES.keys()
        if here not in LIBRARIES[library] | {"__main__"}
    ]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_file_keeps_the_import_law(path: Path) -> None:
    assert breaches(path, ast.parse(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    ("here", "code"),
    [
        ("geometry/x.py", "import turnscrew.signals"),
        ("estimate/x.py", "from turnscrew import plant"),
        ("decide/x.py", "def late():\n    from turnscrew.control.servo import HybridServo"),
        ("task/x.py", "import mujoco"),
        ("plant/x.py", "import gymnasium_robotics"),
        ("signals.py", "from turnscrew.task.record import Recorder"),
    ],
)
def test_law_sees_a_breach(here: str, code: str) -> None:
    assert breaches(SOURCE / here, ast.parse(code))


def test_every_part_has_its_layer() -> None:
    known = set.union(*LAYERS) | {"__init__"}
    assert {part(path) for path in FILES} <= known
