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
        "'collar': two rows on a hexagonal prism around the shaft, under the handle; 'plates': six small plates around "
        "the handle's lower part, below the fingers.",
        f"found by trial: the hand never covers either, and always the handle's upper end; {PAPER}, Fig. 5 has plates",
    )
    dictionary: str = key(
        "4X4_50", "-", "ArUco dictionary, by OpenCV's name without DICT_.", "the largest cells, so the farthest seen"
    )
    collar: float = key(
        0.026, "m", "Distance between opposite faces of the collar.", "free choice: slimmer than the handle",
        ge=0.016, le=0.06,
    )  # fmt: skip
    plate: float = key(
        0.010, "m", "Side of the marker on a plate.", f"assumed: as {PAPER}, Fig. 5 looks like", ge=0.006, le=0.02
    )


class Camera(Table):
    """The camera that `vision.source = "rendered"` draws: Azure Kinect's colour camera, 3840 x 2160 px, 90 x 59 deg."""

    distance: float = key(
        0.65, "m", "Distance from the handle's middle.", f"{PAPER}, Fig. 5: as a user would place it", ge=0.2, le=3.0
    )
    azimuth: float = key(
        math.radians(75.0),
        "rad",
        "Direction of view, about z of W from x.",
        "found by trial: past the fingers, lit from behind the camera",
        ge=-math.pi,
        le=math.pi,
    )
    elevation: float = key(
        math.radians(-20.0), "rad", "Direction of view above the horizon.", "a tripod on the bench", ge=-1.5, le=1.5
    )
    exposure: float = key(
        1.0, "-", "Gain on the light; 2 burns out what is brighter than half.", "well exposed", ge=0.05, le=20.0
    )
    shutter: float = key(
        0.008, "s", "Exposure time, over which motion blurs.", "assumed: 1/125 s, indoors", ge=0.0, le=0.033
    )
    defocus: float = key(
        0.7, "px", "Blur of the lens, sigma.", "assumed: a lens about as sharp as its sensor", ge=0.0, le=10.0
    )
    noise: float = key(
        1.0, "-", "Noise of the read-out in grey levels of 255, sigma; photons add theirs.", "assumed", ge=0.0, le=50.0
    )
    corners: Literal["edges", "opencv"] = key(
        "edges",
        "-",
        "'edges': corners are crossings of edges fitted to steepest brightness; 'opencv': as OpenCV refines them.",
        "found by trial: half the noise, and none of the two millimetres' bias of depth",
    )
    calibration: str = key(
        "", "-", 'Calibration file that is believed; "" is the camera as built.', "a camera calibrated well"
    )
    position_error: float = key(
        0.0, "m", "Constant error of the believed camera position along each axis, sigma.",
        "sense.calibration_error stands for it", ge=0.0, le=0.02,
    )  # fmt: skip
    rotation_error: float = key(
        0.0, "rad", "Constant error of the believed camera orientation about each axis, sigma.",
        "sense.calibration_error stands for it", ge=0.0, le=0.05,
    )  # fmt: skip


class Sense(Table):
    """Errors of the robot's own sensors; offsets are drawn once a run."""

    encoder_noise: float = key(
        math.radians(0.05),
        "rad",
        "Noise of each reading of the hand's joints, sigma.",
        "assumed: a Hall sensor in each joint",
        ge=0.0,
        le=0.02,
    )
    arm_encoder_noise: float = key(
        2.0 * math.pi / (4096 * 18),
        "rad",
        "Noise of each reading of the arm's joints, sigma.",
        "one count of a motor's encoder in WAMJ4, 4096 a turn over a ratio of 18 (Barrett, WAM Arm User's Manual)",
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
    offset: float = key(0.05, "N.m", "Constant offset of a gauge before calibration, sigma.", "assumed", ge=0.0, le=0.2)
    hysteresis: float = key(
        0.14,
        "-",
        "Slow relative error of a reading, sigma: friction between joint and gauge, which no calibration removes.",
        f"found by trial: 95 % of steady contact forces err by less than 25 %, as {PAPER}, footnote 7",
        ge=0.0,
        le=0.4,
    )
    drift: float = key(
        0.005,
        "N.m",
        "Slow drift of a reading, sigma.",
        "assumed: half a percent of the drives' .9 N.m",
        ge=0.0,
        le=0.02,
    )
    noise: float = key(
        0.005,
        "N.m",
        "White noise of a reading averaged over a tick, sigma.",
        "assumed: half a percent of the drives' .9 N.m",
        ge=0.0,
        le=0.02,
    )
    loads: int = key(
        6, "-", "Known loads at the calibration, from -.3 to .3 N.m.", "assumed: three weights, both ways", ge=2, le=100
    )
    load_accuracy: float = key(
        0.05, "-", "Relative error of a known load, sigma.", "assumed: a lever measured by ruler", ge=0.0, le=0.2
    )


class Force(Table):
    """The estimate of the fingertip forces."""

    gauges: Gauges = Gauges()

    source: Literal["tip", "strain"] = key(
        "tip",
        "-",
        "Where it comes from.",
        f"{PAPER}, section V-A: read from the simulator",
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
        le=1.1,
    )


class Estimation(Table):
    """How the tool's pose is refined."""

    solver: Literal["sqp", "ipopt", "map"] = key(
        "sqp",
        "-",
        "Who solves the pose problem (1)-(6) at each camera frame: 'sqp', a real-time solver; 'ipopt', the paper's; "
        "'map', nobody: the filter's pose is handed on as it is.",
        f"found by trial: IPOPT's optimum in a tenth of its time; {PAPER} takes IPOPT",
    )
    reference: Literal["filter", "camera"] = key(
        "filter",
        "-",
        "Orientation that (6) stays close to: the filter's, which has heard all frames, or the camera's last.",
        f"found by trial: a third of the yaw error; {PAPER} takes the camera's",
    )
