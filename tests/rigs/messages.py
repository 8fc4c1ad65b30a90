"""Messages with everything at rest, changed where a test needs it."""

from __future__ import annotations

import numpy as np

from turnscrew.signals import Estimate, Goal, Role

ANGLES = np.radians([180.0, 80.0, 10.0, -90.0, 45.0])
RADIUS, HEIGHT = 0.018, 0.15


def estimate_of(**changes: object) -> Estimate:
    """An upright tool at W's origin, five fingertips around the handle, level, nothing touching."""
    n = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(5)])
    rest: dict[str, object] = {
        "time": 0.0, "q": np.zeros(28), "v": np.zeros(28), "offset": np.zeros(28),
        "p_WT": np.zeros(3), "R_WT": np.eye(3),
        "nu": np.zeros(6), "radius": RADIUS, "p_WS": np.zeros(3), "theta": 0.0,
        "touching": np.zeros(5, dtype=bool), "f_W": np.zeros((5, 3)), "c_W": RADIUS * n + [0, 0, HEIGHT], "n_W": n,
        "gap": np.full(5, 0.01), "F_s": np.zeros(6), "stiffness": 0.02, "tip_slip": 0.0,
        "finger_slip": np.zeros(5), "grip": np.ones(5), "hung": np.zeros(5, dtype=bool),
        "P": np.zeros((6, 6)), "frame": "none", "status": "none",
    }  # fmt: skip
    seen = {"p_WT_seen": np.zeros(3), "R_WT_seen": np.eye(3), "p_WT_refined": np.zeros(3), "R_WT_refined": np.eye(3)}
    return Estimate(**{**rest, **seen, **changes})


def goal_of(**changes: object) -> Goal:
    """Nothing wanted."""
    rest: dict[str, object] = {
        "phase": "roll", "round": 0, "vain": 0, "roles": np.full(5, Role.FREE), "share": np.zeros(5),
        "squeeze": np.zeros(5), "approach": np.zeros((5, 3)), "q_free": np.zeros(28), "q_guide": np.zeros(28),
        "turn_rate": 0.0, "tip_force": 0.0, "V_palm": np.zeros(6),
    }  # fmt: skip
    return Goal(**{**rest, **changes})
