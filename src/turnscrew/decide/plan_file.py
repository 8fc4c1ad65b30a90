"""Gait plans as readable JSON files.

Angles are in radians and lengths in metres, as in `GaitPlan`.  `format` is the version of the layout; a file of
another version is refused, since a plan that is misread would drive the fingers into the tool.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from turnscrew.decide.plan import GaitPlan, Handle
from turnscrew.errors import PlanError

FORMAT = 2
DECIMALS = 7
"""Digits kept: 1e-7 rad moves a fingertip by 10 nm, 1e-7 m is a tenth of a micron."""

_TABLES = ("roll", "relocation", "hold", "retreat", "parked")
_ARRAYS = ("p_WS", "R_WT", "arm")
_HANDLE = ("radius", "length", "middle", "shaft_radius")


def to_json(plan: GaitPlan) -> str:
    """The plan as JSON text, one posture a line."""
    content: dict[str, Any] = {"format": FORMAT, "command": plan.command}
    content["handle"] = {name: _rounded(getattr(plan.handle, name)) for name in _HANDLE}
    content["stroke"] = _rounded(plan.stroke)
    content["contact_heights"] = _rounded(dict(plan.contact_heights))
    content |= {name: _rounded(getattr(plan, name)) for name in _ARRAYS}
    content |= {name: {f: _rounded(rows) for f, rows in getattr(plan, name).items()} for name in _TABLES}
    content["margins"] = _rounded(dict(plan.margins))
    return _layout(content, 0) + "\n"


def save(plan: GaitPlan, path: Path) -> None:
    """Writes the plan to a file; its folder is made when missing.  The file appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(to_json(plan), encoding="utf-8")
    part.replace(path)


def from_json(text: str, source: str) -> GaitPlan:
    """The plan in a JSON text.

    Args:
        text: What `to_json` wrote.
        source: Where the text comes from, for messages.

    Raises:
        PlanError: The text is no plan of this version.
    """
    try:
        content = json.loads(text)
        if content["format"] != FORMAT:
            raise PlanError(f"{source}: plan format {content['format']}, this version reads {FORMAT}: plan again")
        arrays = {name: np.array(content[name], dtype=float) for name in _ARRAYS}
        tables = {name: {f: np.array(rows, dtype=float) for f, rows in content[name].items()} for name in _TABLES}
        return GaitPlan(
            handle=Handle(**{name: float(content["handle"][name]) for name in _HANDLE}),
            stroke=float(content["stroke"]),
            contact_heights=content["contact_heights"],
            p_WS=arrays["p_WS"],
            R_WT=arrays["R_WT"],
            arm=arrays["arm"],
            roll=tables["roll"],
            relocation=tables["relocation"],
            hold=tables["hold"],
            retreat=tables["retreat"],
            parked=tables["parked"],
            margins=content["margins"],
            command=content["command"],
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise PlanError(f"{source}: not a gait plan ({type(error).__name__}: {error})") from error


def load(path: Path) -> GaitPlan:
    """The plan in a file.

    Raises:
        PlanError: The file cannot be read or holds no plan of this version.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise PlanError(f"{path}: cannot read the gait plan ({error})") from error
    return from_json(text, str(path))


def _rounded(values: Any) -> Any:
    if isinstance(values, dict):
        return {key: _rounded(value) for key, value in values.items()}
    if isinstance(values, np.ndarray):
        # adding zero turns -0.0 into 0.0
        return (np.round(values, DECIMALS) + 0.0).tolist()
    return round(float(values), DECIMALS)


def _layout(value: Any, depth: int) -> str:
    """JSON with numbers of one vector on one line, which `json.dumps` cannot do."""
    pad, inner = "  " * depth, "  " * (depth + 1)
    if isinstance(value, dict):
        rows = [f"{inner}{json.dumps(key)}: {_layout(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(rows) + f"\n{pad}}}"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"{inner}{_layout(item, depth + 1)}" for item in value) + f"\n{pad}]"
    return json.dumps(value)
