"""One exception family.  Each message names the thing that is wrong and what would be right."""

from __future__ import annotations


class TurnscrewError(Exception):
    """A broken contract.  The command line prints its message as one line and exits with status 2."""


class ScenarioError(TurnscrewError):
    """A scenario key is unknown, of the wrong type or out of its range, or its file cannot be read."""


class ModelError(TurnscrewError):
    """A robot, tool or screw cannot be built from its description."""


class PlanError(TurnscrewError):
    """No gait plan fits the handle and hand that were asked for."""


class RecordError(TurnscrewError):
    """A run's folder cannot be written, or what it holds cannot be read."""


class RenderError(TurnscrewError):
    """Pictures were asked for on a machine that cannot draw them."""


class CameraError(TurnscrewError):
    """A camera's calibration, markers or pictures cannot be used."""
