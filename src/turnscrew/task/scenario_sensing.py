"""The scenario's keys of sensors and estimation."""

from __future__ import annotations

import math
from typing import Literal

from turnscrew.task.scenario_tables import PAPER, Table, Triple, key


class Markers(Table):
    """Fiducial markers on the tool, for `vision.source = "rendered"`."""

    place: Literal["collar", "plates"] = key(
        "collar",
        "-",
        "'collar': on a prism around the handle's end; 'plates': on small plates on the handle, between the fingers.",
        f"found by trial: a collar is seen from all sides and flips no pose; {PAPER}, Fig. 5 has plates",
    )
    dictionary: str = key("4X4_50", "-", "ArUco dictionary, by OpenCV's name without DICT_.", "the smallest one")


class Camera(Table):
    """The camera that `vision.source = "rendered"` draws: Azure Kinect's colour camera by default."""

    distance: float = key(
        0.65, "m", "Distance from the handle's middle.", f"{PAPER}, Fig. 5: as a user would place it", ge=0.2, le=3.0
    )
    azimuth: float = key(
        math.radians(75.0), "rad", "Direction of view, about z of W.", "found by trial", ge=-math.pi, le=math.pi
    )
    elevation: float = key(
        math.radians(-20.0), "rad", "Direction of view above the horizon.", "found by trial", ge=-1.5, le=1.5
    )


class Sense(Table):
    """Errors of the robot's own sensors; offsets are drawn once a run."""

    encoder_noise: float = key(
        math.radians(0.05),
        "rad",
        "Noise of each joint reading, sigma.",
        "assumed: a Hall sensor in each joint",
        ge=0.0,
        le=0.02,
    )
    joint_offset: float = key(
        math.radians(0.57),
        "rad",
        "Constant offset of each hand joint, sigma.",
        "assumed: joints calibrated to 0.01 rad",
        ge=0.0,
        le=0.1,
    )
    calibration_error: Triple = key(
        (0.0015, 0.0015, 0.002),
        "m",
        "Constant error of the hand-to-screw calibration along x, y, z of W, sigma.",
        "assumed: hand-eye calibration at 0.7 m",
    )
    radius_error: float = key(
        0.0005,
        "m",
        "Constant error of the handle radius the robot believes in, sigma.",
        "assumed: a handle measured with calipers",
        ge=0.0,
        le=0.005,
    )


class Vision(Table):
    """The camera's estimate of the tool pose."""

    camera: Camera = Camera()

    source: Literal["noisy-truth", "rendered"] = key(
        "noisy-truth",
        "-",
        "Where it comes from.",
        f"{PAPER}, section V-A: pose read from the simulator, random noise added",
        later={"rendered": "comes with the rendered camera"},
    )
    rate: float = key(30.0, "Hz", "Frames a second.", f"{PAPER}: Azure Kinect, colour camera", ge=1.0, le=200.0)
    position_noise: float = key(
        0.003,
        "m",
        "Noise of each axis of the position, sigma.",
        "assumed: markers on the handle seen from 0.7 m",
        ge=0.0,
        le=0.05,
    )
    rotation_noise: float = key(
        math.radians(2.0),
        "rad",
        "Noise of the rotation about each axis, sigma.",
        "assumed: markers on the handle seen from 0.7 m",
        ge=0.0,
        le=0.5,
    )
    latency: float = key(1 / 30, "s", "From exposure to arrival.", "one frame at 30 Hz", ge=0.0, le=0.5)
    dropout: float = key(0.0, "-", "Share of frames that never arrive.", "free choice", ge=0.0, le=0.95)


class Gauges(Table):
    """Strain gauges of the hand's drives, for `force.source = "strain"`; errors are drawn once a run."""

    gain_error: float = key(
        0.2, "-", "Relative error of a gauge's gain before calibration, sigma.", "assumed", ge=0.0, le=0.5
    )
    offset: float = key(0.05, "N.m", "Constant offset of a gauge before calibration, sigma.", "assumed", ge=0.0, le=0.5)
    noise: float = key(0.005, "N.m", "White noise of a reading, sigma.", "assumed", ge=0.0, le=0.1)


class Force(Table):
    """The estimate of the fingertip forces."""

    gauges: Gauges = Gauges()

    source: Literal["tip", "strain"] = key(
        "tip",
        "-",
        "Where it comes from.",
        f"{PAPER}, section V-A: read from the simulator",
        later={"strain": "comes with the gauges"},
    )
    noise: float = key(
        0.25, "-", "Largest relative error of the magnitude.", f"{PAPER}, footnote 7: within 25 %", ge=0.0, le=0.9
    )
    direction_noise: float = key(
        math.radians(30.0),
        "rad",
        "Largest error of the direction.",
        f"{PAPER}, footnote 7: within 30 deg",
        ge=0.0,
        le=1.0,
    )


class Estimation(Table):
    """How the tool's pose is refined."""

    solver: Literal["sqp", "ipopt", "map"] = key(
        "ipopt",
        "-",
        "Who solves the pose problem (1)-(6) at each camera frame: 'sqp', a real-time solver; 'ipopt', the paper's; "
        "'map', nobody: the filter's pose is handed on as it is.",
        f"{PAPER}: IPOPT",
    )
    reference: Literal["filter", "camera"] = key(
        "filter",
        "-",
        "Orientation that (6) stays close to: the filter's, which has heard all frames, or the camera's last.",
        f"found by trial: a third of the yaw error; {PAPER} takes the camera's",
    )
