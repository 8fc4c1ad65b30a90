"""What a camera saw of the tool, in words and as JSON."""

from __future__ import annotations

import json

import numpy as np

from turnscrew.geometry.euler import tilt, yaw
from turnscrew.sense.shutter import Frame


def as_line(frame: Frame) -> str:
    """Time, tip position, tilt and yaw with the tip's standard deviation, or why there is no pose."""
    if frame.vision is None:
        return f"{frame.stamp:8.3f} s  no pose: {frame.blind}"
    x, y, z = 1e3 * frame.vision.p_WT
    sigma = 1e3 * float(np.sqrt(np.trace(frame.vision.P[:3, :3])))
    lean, turn = np.degrees(tilt(frame.vision.R_WT)), np.degrees(yaw(frame.vision.R_WT))
    return (
        f"{frame.stamp:8.3f} s  tip {x:8.2f} {y:8.2f} {z:8.2f} mm (sigma {sigma:.2f})  "
        f"tilt {lean:6.2f} deg  yaw {turn:7.2f} deg"
    )


def as_record(frame: Frame) -> str:
    """The same as JSON: `stamp` [s], `p_WT` [m], `R_WT`, `P`, `blind`; null where there is no pose."""
    vision = frame.vision
    known = {name: None if vision is None else getattr(vision, name).tolist() for name in ("p_WT", "R_WT", "P")}
    return json.dumps({"stamp": frame.stamp, **known, "blind": frame.blind})
