"""Reading the simulator's state: fingertip forces for the sensors, the whole truth for the recorder."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.plant.touches import Touches, felt, on_tool, touches, velocities
from turnscrew.robot.joints import FINGERS

SLOT_GEOMS = ("slot_floor", "slot_left", "slot_right", "slot_front", "slot_back")


@dataclass(frozen=True, slots=True)
class Truth:
    """The simulator's state, for statistics only.

    Attributes:
        p_WT: (3,) tip position in W [m].
        R_WT: (3, 3) orientation of the tool.
        p_WS: (3,) centre of the slot's floor in W [m].
        theta: Angle turned in [rad].
        advance: How far the screw has sunk [m].
        thread_torque: Torque of the substrate on the screw about +z [N.m].
        F_s: (6,) wrench of the screw on the tool, in T, force first [N, N.m].
        f_W: (5, 3) force of each fingertip on the tool, in W [N].
        touching: (5,) which fingertips touch the tool.
        tip_in_drive: Whether the edge centre lies inside the slot.
        V_WT: (6,) velocity of the tool at T's origin in W, linear first [m/s, rad/s].
        p_WF: (5, 3) origins of the fingertips' bodies in W [m].
        V_WF: (5, 6) velocities of the fingertips there, in W, linear first [m/s, rad/s].
        c_W: (5, 3) where each fingertip touches the tool, in W [m]; not a number where none does.
    """

    p_WT: Array
    R_WT: Array
    p_WS: Array
    theta: float
    advance: float
    thread_torque: float
    F_s: Array
    f_W: Array
    touching: Flags
    tip_in_drive: bool
    V_WT: Array
    p_WF: Array
    V_WF: Array
    c_W: Array


class ContactReader:
    """Finds the contacts of fingertips, tool and screw in a state."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.tool_body = model.body("tool").id
        self._tip_bodies = np.array([model.body(f"{finger.lower()}distal").id for finger in FINGERS])
        self._moving = np.array([self.tool_body, *self._tip_bodies])
        self._roots = model.body_rootid[self._moving]
        self._row = np.full(model.ngeom, -1)
        for row, finger in enumerate(FINGERS):
            self._row[model.geom(f"C_{finger.lower()}distal").id] = row
        self._is_tool = np.zeros(model.ngeom, dtype=bool)
        self._is_tool[model.geom_bodyid == self.tool_body] = True
        self._is_slot = np.zeros(model.ngeom, dtype=bool)
        for name in SLOT_GEOMS:
            self._is_slot[model.geom(name).id] = True
        self._screw_body = model.body("screw").id
        self._hinge = int(model.joint("screw").qposadr[0])
        self._slide = int(model.joint("screw_advance").qposadr[0])
        self._thread = model.actuator("thread").id
        self._depth = 2 * float(model.geom("slot_left").size[2])
        self._watched = self._is_tool | (self._row >= 0)
        self._time = np.nan
        self._found = Touches(np.zeros((0, 2), np.intp), np.zeros((0, 3)), np.zeros((0, 3)))

    def _contacts(self, data: mujoco.MjData) -> Touches:
        """Contacts of fingertips and tool in this state; worked out once a state."""
        if data.time != self._time:
            self._time, found = data.time, data.contact
            self._found = Touches(
                *touches(found.geom, found.frame, found.pos, found.efc_address, data.efc_force, self._watched)
            )
        return self._found

    def forget(self) -> None:
        """Contacts are worked out again, whatever the time."""
        self._time = np.nan

    def fingertip_forces(self, data: mujoco.MjData) -> Array:
        """Force (5, 3) of each fingertip on whatever it touches, in its frame F [N]."""
        found = self._contacts(data)
        return felt(found.geoms, found.forces, self._row, data.xmat, self._tip_bodies)

    def truth(self, data: mujoco.MjData) -> Truth:
        """The whole truth at a state."""
        xpos, tool, screw = data.xpos, self.tool_body, self._screw_body
        p_WT, R_WT, p_WS = xpos[tool].copy(), data.xmat[tool].reshape(3, 3).copy(), xpos[screw].copy()
        f_W, c_W, touching, F_s = on_tool(
            *self._contacts(data), self._row, self._is_tool, self._is_slot, p_WT, R_WT, TOUCH_FORCE
        )
        V = velocities(xpos, data.cvel, data.subtree_com, self._moving, self._roots)
        x, y, z = ((p_WT - p_WS) @ data.xmat[screw].reshape(3, 3)).tolist()
        return Truth(
            p_WT=p_WT,
            R_WT=R_WT,
            p_WS=p_WS,
            theta=-float(data.qpos[self._hinge]),
            advance=-float(data.qpos[self._slide]),
            thread_torque=float(data.ctrl[self._thread]),
            F_s=F_s,
            f_W=f_W,
            touching=touching,
            tip_in_drive=abs(z) < self._depth and hypot(x, y) < IN_DRIVE,
            V_WT=V[0],
            p_WF=xpos[self._tip_bodies],
            V_WF=V[1:],
            c_W=c_W,
        )


TOUCH_FORCE = 0.05
"""A fingertip that presses with less does not count as touching [N]: an eighth of what a guarded contact seeks."""

IN_DRIVE = 0.002
"""Farther from the drive's centre than this, the tip is out of it [m]: twice the slip that a run may show."""
