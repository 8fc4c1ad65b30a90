"""Names, order and coupling of the robot's 28 joints: the order of every joint vector in the project."""

from __future__ import annotations

FINGERS = ("TH", "FF", "MF", "RF", "LF")
"""Thumb, first (the paper's index), middle, ring and little finger: the row order of per-finger arrays."""

ARM = ("WAMJ1", "WAMJ2", "WAMJ3", "WAMJ4")
WRIST = ("WRJ2", "WRJ1")
"""Shadow's names: WRJ2 swings the hand sideways, WRJ1 flexes it; from the forearm outwards."""

HAND_FINGERS = {
    "FF": ("FFJ4", "FFJ3", "FFJ2", "FFJ1"),
    "MF": ("MFJ4", "MFJ3", "MFJ2", "MFJ1"),
    "RF": ("RFJ4", "RFJ3", "RFJ2", "RFJ1"),
    "LF": ("LFJ5", "LFJ4", "LFJ3", "LFJ2", "LFJ1"),
    "TH": ("THJ5", "THJ4", "THJ3", "THJ2", "THJ1"),
}
"""Joints of each finger from the palm outwards; J1 is the distal one."""

JOINTS = (*ARM, *WRIST, *(joint for finger in HAND_FINGERS.values() for joint in finger))
INDEX = {name: index for index, name in enumerate(JOINTS)}

COUPLED = {f"{finger}J1": f"{finger}J2" for finger in ("FF", "MF", "RF", "LF")}
"""One tendon drives J1 and J2 of each finger but the thumb's: here J1 = J2 always.

The real hand keeps J1 <= J2 with the split left to contact; equal angles are what an unloaded tendon gives.
"""

DRIVEN = tuple(name for name in JOINTS if name not in COUPLED)
"""The 24 joints that have a position command of their own; a coupled pair is commanded through its J2."""


def finger_joints(finger: str) -> tuple[int, ...]:
    """Indices of a finger's driven joints in the joint vector, palm outwards."""
    return tuple(INDEX[name] for name in HAND_FINGERS[finger] if name not in COUPLED)
