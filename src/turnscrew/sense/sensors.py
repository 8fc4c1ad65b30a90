"""The room's block: all sensors read at one tick."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.random import Generator

from turnscrew.geometry.arrays import Array
from turnscrew.sense.encoders import Encoders, EncoderState
from turnscrew.sense.fingertip_force import FingertipForce, ForceState
from turnscrew.sense.vision import NoisyTruthVision, VisionState
from turnscrew.signals import Measurement


@dataclass(frozen=True, slots=True)
class SensorState:
    """States of the sensors."""

    encoders: EncoderState
    force: ForceState
    camera: VisionState


@dataclass(frozen=True)
class Sensors:
    """Encoders, fingertip forces and camera, in simulation."""

    encoders: Encoders
    force: FingertipForce
    camera: NoisyTruthVision

    def init(self, encoders: Generator, force: Generator, camera: Generator) -> SensorState:
        """Draws this robot's constant errors, each sensor from its own stream."""
        return SensorState(self.encoders.init(encoders), self.force.init(force), self.camera.init(camera))

    def update(
        self, state: SensorState, time: float, q: Array, f_F: Array, p_WT: Array, R_WT: Array
    ) -> tuple[SensorState, Measurement]:
        """Reads all sensors.

        Args:
            state: Of the last tick.
            time: Now [s].
            q: (28,) true joint angles [rad].
            f_F: (5, 3) true forces of the fingertips on what they touch, in F [N].
            p_WT: (3,) true tip position in W [m].
            R_WT: (3, 3) true orientation of the tool.
        """
        encoders, (angles, speeds) = self.encoders.update(state.encoders, q, time)
        force, forces = self.force.update(state.force, f_F, time)
        camera, frame = self.camera.update(state.camera, p_WT, R_WT, time)
        return SensorState(encoders, force, camera), Measurement(time, angles, speeds, forces, frame)
