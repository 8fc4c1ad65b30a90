"""The rendered marker camera: pictures of the plant, taken as a real camera takes them, and the tool's pose in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.pinhole import Window
from turnscrew.geometry.rotations import exp_so3
from turnscrew.sense.lens import Calibration
from turnscrew.sense.opencv import opencv
from turnscrew.sense.photograph import Photograph
from turnscrew.sense.sensed import Image, Sensed
from turnscrew.sense.shutter import Frame, Shutter, ShutterState
from turnscrew.sense.sight import MarkerSight, Track
from turnscrew.signals import Vision


@dataclass(frozen=True, slots=True)
class CameraState:
    """What the camera remembers between ticks.

    Attributes:
        shutter: Its clock, with the frames on their way.
        track: Where the tool was last seen.
        shift: (3,) constant error of the believed camera position in W [m].
        turn: (3, 3) constant error of its orientation, a rotation in W.
        before: Time [s] and true pose of the tool at the last tick, for motion blur.
    """

    shutter: ShutterState
    track: Track
    shift: Array
    turn: Array
    before: tuple[float, Array, Array] | None = None


@dataclass(frozen=True)
class MarkerCamera:
    """A camera that looks at the tool's markers.

    Attributes:
        sight: Finds the pose, with the calibration that is believed.
        lens: The camera as built.
        photograph: What its sensor makes of light.
        shutter: Rate, latency and dropouts.
        position_error: Deviation of the believed camera position along each axis, drawn once a run [m].
        rotation_error: Deviation of the believed orientation about each axis, drawn once a run [rad].
    """

    sight: MarkerSight
    lens: Calibration
    photograph: Photograph
    shutter: Shutter
    position_error: float = 0.0
    rotation_error: float = 0.0

    def init(self, rng: Generator) -> CameraState:
        """Draws the calibration's error and the shutter's phase."""
        shutter = self.shutter.init(rng)
        shift, turn = rng.normal(0.0, self.position_error, 3), rng.normal(0.0, self.rotation_error, 3)
        return CameraState(shutter, self.sight.init(), shift, exp_so3(turn))

    def update(self, state: CameraState, plant: Sensed) -> tuple[CameraState, Vision | None, str]:
        """Exposes when due and hands out the newest frame that has arrived.

        Args:
            state: Of the last call.
            plant: What is seen.

        Returns:
            The new state; the frame that arrived since the last call, if it tells a pose; and why the newest that
            arrived told none.

        Raises:
            RenderError: The plant cannot be drawn on this machine.
        """
        time = plant.time
        p_WT, R_WT = plant.tool_pose()
        shutter, opened = self.shutter.opens(state.shutter, time)
        track = state.track
        if opened:
            motion = self._motion(state.before, time, p_WT, R_WT)
            track, vision, blind = self.sight.update(
                track, time, self.lens.pinhole.size, lambda window: self._take(plant, window, motion, shutter.rng)
            )
            shutter = self.shutter.send(shutter, Frame(time, self._believed(state, vision), blind))
        shutter, vision, blind = self.shutter.arrived(shutter, time)
        return CameraState(shutter, track, state.shift, state.turn, (time, p_WT, R_WT)), vision, blind

    def _take(self, plant: Sensed, window: Window, motion: Array, rng: Generator) -> Image:
        """A grey window of the picture as the camera hands it out."""
        cv2 = opencv()
        grey = cv2.cvtColor(plant.picture(*self.lens.needed(window)), cv2.COLOR_RGB2GRAY)
        return self.photograph.taken(self.lens.bent(grey, window), motion, rng)

    def _motion(self, before: tuple[float, Array, Array] | None, time: float, p_WT: Array, R_WT: Array) -> Array:
        """How far the markers nearest to the camera move in the picture while the shutter is open (2,) [px]."""
        if before is None or time <= before[0]:
            return np.zeros(2)
        corners = self.sight.solver.board.corners.reshape(-1, 3)
        near = np.argsort(self.lens.pose.seen(p_WT + corners @ R_WT.T)[:, 2])[:8]
        middle = corners[near].mean(axis=0)
        ends = self.lens.project(np.array([before[1] + before[2] @ middle, p_WT + R_WT @ middle]))
        return np.asarray((ends[1] - ends[0]) * self.photograph.shutter / (time - before[0]))

    def _believed(self, state: CameraState, vision: Vision | None) -> Vision | None:
        """A pose as it looks with the calibration's error: turned about the camera and shifted."""
        if vision is None:
            return None
        pivot, A = self.lens.pose.p_WK, state.turn
        turned = np.kron(np.eye(2), A)
        p_WT = pivot + state.shift + A @ (vision.p_WT - pivot)
        return Vision(vision.stamp, p_WT, A @ vision.R_WT, turned @ vision.P @ turned.T)
