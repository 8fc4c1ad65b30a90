"""From a scenario to the rendered marker camera: what is on the tool, where the camera stands, what it makes of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from turnscrew.geometry.arrays import Array
from turnscrew.geometry.marker_board import MarkerBoard, Plates, collar_below
from turnscrew.geometry.pinhole import CameraPose, looking_at
from turnscrew.geometry.rotations import exp_so3
from turnscrew.plant.camera import SceneCamera
from turnscrew.plant.markers import Markers
from turnscrew.sense.board import BoardPose
from turnscrew.sense.calibration_file import read_calibration
from turnscrew.sense.fiducials import Fiducials
from turnscrew.sense.lens import Calibration
from turnscrew.sense.marker_camera import MarkerCamera
from turnscrew.sense.photograph import Photograph
from turnscrew.sense.shutter import Shutter
from turnscrew.sense.sight import MarkerSight
from turnscrew.task.scenario_keys import Scenario

PLATES_ABOVE_END = 0.013
"""Height of the plates' middles above the handle's lower end [m]: below the fingers, with the plates' edge inside."""


def build_board(scenario: Scenario) -> MarkerBoard:
    """Where the tool's markers are.

    Raises:
        ModelError: there is no room for them on this tool.
    """
    tool, markers = scenario.tool, scenario.tool.markers
    end = tool.contact_height - tool.handle.length / 2
    if markers.place == "collar":
        return collar_below(end, markers.collar)
    return Plates(tool.handle.radius, end + PLATES_ABOVE_END, markers.plate)


def build_fiducials(scenario: Scenario) -> Fiducials:
    """The markers' dictionary and how their corners are found.

    Raises:
        CameraError: OpenCV is missing or knows no such dictionary.
    """
    return Fiducials(scenario.tool.markers.dictionary, scenario.vision.camera.corners == "edges")


def build_markers(scenario: Scenario) -> Markers | None:
    """What is printed on the tool: nothing unless a camera has to see it."""
    if scenario.vision.source != "rendered":
        return None
    board = build_board(scenario)
    return Markers(board, build_fiducials(scenario).cells(board.ids))


def camera_pose(scenario: Scenario, p_WS: Array) -> CameraPose:
    """Where the camera stands, aimed at the handle's middle.

    Args:
        scenario: With distance and direction.
        p_WS: (3,) the drive's bottom centre as planned, in W [m].
    """
    camera = scenario.vision.camera
    middle = p_WS + np.array([0.0, 0.0, scenario.tool.contact_height])
    return looking_at(middle, camera.distance, camera.azimuth, camera.elevation)


def build_scene_camera(scenario: Scenario, p_WS: Array) -> SceneCamera | None:
    """The camera in the cell, if anything looks through it."""
    return SceneCamera(camera_pose(scenario, p_WS)) if scenario.vision.source == "rendered" else None


def build_marker_camera(scenario: Scenario, p_WS: Array) -> MarkerCamera:
    """The camera as a sensor.

    Args:
        scenario: What is wired.
        p_WS: (3,) the drive's bottom centre as planned, near which the tool is looked for, in W [m].

    Raises:
        CameraError: the calibration file or the markers cannot be used.
    """
    vision, camera = scenario.vision, scenario.vision.camera
    lens = Calibration(camera_pose(scenario, p_WS))
    believed = read_calibration(Path(camera.calibration)) if camera.calibration else lens
    fiducials = build_fiducials(scenario)
    expected = (p_WS, exp_so3(np.array([0.0, 0.0, scenario.screw.slot_yaw])))
    return MarkerCamera(
        sight=MarkerSight(fiducials, BoardPose(build_board(scenario), believed, fiducials.noise), expected),
        lens=lens,
        photograph=Photograph(camera.exposure, camera.shutter, camera.defocus, camera.noise),
        shutter=Shutter(vision.rate, vision.latency, vision.dropout),
        position_error=camera.position_error,
        rotation_error=camera.rotation_error,
    )
