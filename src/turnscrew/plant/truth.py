"""Reading the simulator's state: fingertip forces for the sensors, the whole truth for the recorder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.rotations import cross
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


class Touch(NamedTuple):
    """A contact: its geoms, its point in W [m], and the force of the first on the second in W [N]."""

    one: int
    other: int
    point: Array
    force: Array


class ContactReader:
    """Finds the contacts of fingertips, tool and screw in a state."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self.tool_body = model.body("tool").id
        self._tip_bodies = [model.body(f"{finger.lower()}distal").id for finger in FINGERS]
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
        self._force = np.zeros(6)
        self._time = np.nan
        self._found: list[Touch] = []

    def _contacts(self, data: mujoco.MjData) -> list[Touch]:
        """Contacts of fingertips and tool in this state; worked out once a state."""
        if data.time != self._time:
            self._time = data.time
            pairs = data.contact.geom
            frames, points = data.contact.frame, data.contact.pos
            self._found = []
            for index in np.flatnonzero(self._watched[pairs].any(axis=1)).tolist():
                mujoco.mj_contactForce(self._model, data, index, self._force)
                one, other = pairs[index].tolist()
                force = self._force[:3] @ frames[index].reshape(3, 3)
                self._found.append(Touch(one, other, points[index].copy(), force))
        return self._found

    def forget(self) -> None:
        """Contacts are worked out again, whatever the time."""
        self._time = np.nan

    def fingertip_forces(self, data: mujoco.MjData) -> Array:
        """Force (5, 3) of each fingertip on whatever it touches, in its frame F [N]."""
        forces = np.zeros((5, 3))
        for touch in self._contacts(data):
            if self._row[touch.one] >= 0:
                forces[self._row[touch.one]] += touch.force
            if self._row[touch.other] >= 0:
                forces[self._row[touch.other]] -= touch.force
        R = data.xmat[self._tip_bodies].reshape(5, 3, 3)
        return np.asarray(np.matmul(forces[:, None, :], R)[:, 0])

    def truth(self, data: mujoco.MjData) -> Truth:
        """The whole truth at a state."""
        p_WT, R_WT = data.xpos[self.tool_body].copy(), data.xmat[self.tool_body].reshape(3, 3).copy()
        p_WS = data.xpos[self._screw_body].copy()
        f_W, wrench, c_W = np.zeros((5, 3)), np.zeros(6), np.full((5, 3), np.nan)
        for touch in self._contacts(data):
            toucher, force = touch.one, touch.force
            if self._is_tool[touch.one]:
                toucher, force = touch.other, -force
            elif not self._is_tool[touch.other]:
                continue
            if self._row[toucher] >= 0:
                f_W[self._row[toucher]] += force
                c_W[self._row[toucher]] = touch.point
            elif self._is_slot[toucher]:
                wrench[:3] += force
                wrench[3:] += cross(touch.point - p_WT, force)
        in_slot = (p_WT - p_WS) @ data.xmat[self._screw_body].reshape(3, 3)
        return Truth(
            p_WT=p_WT,
            R_WT=R_WT,
            p_WS=p_WS,
            theta=-float(data.qpos[self._hinge]),
            advance=-float(data.qpos[self._slide]),
            thread_torque=float(data.ctrl[self._thread]),
            F_s=np.concatenate([wrench[:3] @ R_WT, wrench[3:] @ R_WT]),
            f_W=f_W,
            touching=np.linalg.norm(f_W, axis=1) > TOUCH_FORCE,
            tip_in_drive=bool(abs(in_slot[2]) < self._depth and float(np.hypot(in_slot[0], in_slot[1])) < IN_DRIVE),
            V_WT=self._velocity(data, self.tool_body),
            p_WF=data.xpos[self._tip_bodies].copy(),
            V_WF=np.array([self._velocity(data, body) for body in self._tip_bodies]),
            c_W=c_W,
        )

    def _velocity(self, data: mujoco.MjData, body: int) -> Array:
        """Velocity (6,) of a body's origin in W, linear first."""
        V = np.empty(6)
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, V, 0)
        return np.concatenate([V[3:], V[:3]])


TOUCH_FORCE = 0.05
"""A fingertip that presses with less does not count as touching [N]: an eighth of what a guarded contact seeks."""

IN_DRIVE = 0.002
"""Farther from the drive's centre than this, the tip is out of it [m]: twice the slip that a run may show."""
