"""The simulated cell: arm, hand, free tool and screw, stepped together.

Nothing but gravity, fingertips and the screw's drive acts on the tool.  What the robot may know of it leaves only
through the sensors; `truth` is for the recorder.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType

import mujoco
import numpy as np

from turnscrew.errors import ModelError
from turnscrew.geometry.arrays import Array
from turnscrew.geometry.pinhole import Window
from turnscrew.plant.camera import Image, Pictures, SceneCamera
from turnscrew.plant.contact import NOSLIP, Friction, rub, set_solver
from turnscrew.plant.drives import Drives
from turnscrew.plant.screw import Screw, add_screw
from turnscrew.plant.thread import Thread
from turnscrew.plant.tool import Tool, add_tool
from turnscrew.plant.truth import ContactReader, Truth
from turnscrew.robot.joints import JOINTS
from turnscrew.robot.model import robot_spec
from turnscrew.robot.motors import add_motors
from turnscrew.robot.servos import add_servos


@dataclass(frozen=True)
class CellDescription:
    """All that defines the plant.

    Attributes:
        tool: The screwdriver.
        screw: The screw.
        thread: How the substrate resists.
        friction: Of fingers and tip.
        p_WS: (3,) where the screw's drive really is, in W [m].
        slot_yaw: The slot's initial direction [rad].
        timestep: Plant step [s].
        mass_error: Relative error of the robot's masses against the loop's model.
        camera: What `picture` is seen by, if anything.
        passes: Of MuJoCo's second friction solver.
        motors: Whether the joints take torques; otherwise they have position servos.
        patience: Steps without a command after which drives hold their joints; None: they go on as they were told.
    """

    tool: Tool
    screw: Screw
    thread: Thread
    friction: Friction
    p_WS: Array
    slot_yaw: float
    timestep: float = 0.001
    mass_error: float = 0.0
    camera: SceneCamera | None = None
    motors: bool = False
    patience: int | None = None
    passes: int = NOSLIP


def cell_xml(cell: CellDescription, p_WT: Array, R_WT: Array) -> str:
    """The cell as MJCF, the tool's initial pose included."""
    spec = robot_spec()
    spec.modelname = "turnscrew"
    set_solver(spec, cell.timestep, cell.passes)
    for body in spec.bodies[1:]:
        body.mass *= 1.0 + cell.mass_error
        body.inertia = body.inertia * (1.0 + cell.mass_error)
    for geom in spec.geoms:
        if geom.name.startswith("C_"):
            rub(geom, cell.friction.finger, priority=0)
    (add_motors if cell.motors else add_servos)(spec)
    add_tool(spec, cell.tool, cell.friction, p_WT, R_WT)
    add_screw(spec, cell.screw, cell.friction, cell.p_WS, cell.slot_yaw)
    spec.worldbody.add_light(pos=[0.6, -0.8, 1.6], dir=[0.2, 0.6, -1.0], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1280, 720
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.compile()
    return str(spec.to_xml())


FINITE = [0, 0, 0]
"""How often MuJoCo has met positions, speeds and accelerations that are no numbers, while all is well."""


class Cell:
    """The plant: commands in, one step at a time; a context manager, since drawing holds OpenGL.

    The model is compiled from its own MJCF text, so that a saved copy of that text steps to the same last bit.

    Attributes:
        xml: The model's MJCF.
        model: MuJoCo's model.
        data: MuJoCo's state.
        drives: Of arm and hand.
        twist: The thread's state: how far its stick is bent [rad].
    """

    def __init__(self, description: CellDescription, q: Array, p_WT: Array, R_WT: Array) -> None:
        """Builds the cell.

        Args:
            description: Tool, screw, thread, friction.
            q: (28,) initial joint angles [rad].
            p_WT: (3,) initial tip position [m].
            R_WT: (3, 3) initial orientation of the tool.
        """
        self.xml = cell_xml(description, p_WT, R_WT)
        self.model = mujoco.MjModel.from_xml_string(self.xml)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[: len(JOINTS)] = q
        self._thread = description.thread
        self.twist = self._thread.init()
        hinge = self.model.joint("screw")
        self._screw_q, self._screw_v = int(hinge.qposadr[0]), int(hinge.dofadr[0])
        self._timestep = float(self.model.opt.timestep)
        self._thread_ctrl = self.model.actuator("thread").id
        self._contacts = ContactReader(self.model)
        # views of MuJoCo's memory, which every step looks at
        self._qpos, self._qvel, self._ctrl = self.data.qpos, self.data.qvel, self.data.ctrl
        # and of its own counts of positions, speeds and accelerations that were no numbers
        self._warned = self.data.warning.number[mujoco.mjtWarning.mjWARN_BADQPOS : mujoco.mjtWarning.mjWARN_BADQACC + 1]
        self.drives = Drives(self.data, description.patience)
        self._camera = description.camera
        self._pictures: Pictures | None = None
        mujoco.mj_forward(self.model, self.data)

    def write(self, command: Array) -> None:
        """Sends commands (24,) in the order of `DRIVEN`: positions [rad] to servos, torques [N.m] to motors."""
        self.drives.write(command)

    def prepare(self) -> None:
        """Sets what no command tells for the coming step, so that all controls of that step stand in `data.ctrl`."""
        self.drives.prepare()
        yaw, rate = self._qpos.item(self._screw_q), self._qvel.item(self._screw_v)
        self.twist, self._ctrl[self._thread_ctrl] = self._thread.update(self.twist, yaw, rate, self._timestep)

    def step(self) -> None:
        """One step of the plant."""
        mujoco.mj_step(self.model, self.data)
        self.drives.note()

    @property
    def diverged(self) -> bool:
        """Whether the integration has failed: MuJoCo met a number that is not finite, or beyond all measure."""
        return bool(self._warned.tolist() != FINITE)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    @property
    def q(self) -> Array:
        """True joint angles (28,) [rad], for the encoders."""
        return np.array(self._qpos[: len(JOINTS)])

    def fingertip_forces(self) -> Array:
        """True force (5, 3) of each fingertip on what it touches, in its frame F [N], for the force sensors."""
        return self._contacts.fingertip_forces(self.data)

    def forget(self) -> None:
        """To be called when the state has been changed from outside, at the same simulated time."""
        self._contacts.forget()

    def drive_torques(self) -> Array:
        """Mean torque (24,) of each drive since the last command, in the order of `DRIVEN` [N.m], for strain gauges."""
        return self.drives.torques()

    def tool_pose(self) -> tuple[Array, Array]:
        """True p_WT (3,) [m] and R_WT (3, 3), for the camera."""
        tool = self._contacts.tool_body
        return self.data.xpos[tool].copy(), self.data.xmat[tool].reshape(3, 3).copy()

    def picture(self, left: int, top: int, width: int, height: int) -> Image:
        """What the camera sees in a window of its full image: (height, width, 3), RGB, without the lens' distortion.

        Args:
            left: First column; the window may reach beyond the image [px].
            top: First row [px].
            width: Columns [px].
            height: Rows [px].

        Raises:
            ModelError: The cell has no camera.
            RenderError: This machine cannot draw.
        """
        if self._camera is None:
            raise ModelError("the cell has no camera: CellDescription.camera says where one stands")
        if self._pictures is None:
            self._pictures = Pictures(self.model, self._camera)
        return self._pictures.draw(self.data, Window(left, top, width, height))

    def close(self) -> None:
        """Gives back what drawing holds; the plant itself goes on."""
        if self._pictures is not None:
            self._pictures.close()
            self._pictures = None

    def __enter__(self) -> Cell:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def truth(self) -> Truth:
        """Everything that a judge of the run wants to know and the robot does not."""
        return self._contacts.truth(self.data)
