"""What is said about a run: `Progress` while it goes on, `Summary` when it has ended."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from platform import python_version

from pydantic import BaseModel, ConfigDict, Field

from turnscrew import __version__


@dataclass(frozen=True, slots=True)
class Progress:
    """The state of a run, for whoever watches it.

    Attributes:
        time: Simulated time [s].
        phase: Name of the phase of the gait.
        round: Rounds completed so far.
        screw_angle: Angle by which the screw has been turned in, as estimated [rad].
        torque: Torque about the screw's axis, as estimated [N.m].
        tip_force: Force of the screw on the tip along the tool's axis, as estimated [N].
        tilt: Angle of the tool's axis from the screw's, as estimated [rad].
        real_time_factor: Simulated time over wall time so far.
    """

    time: float
    phase: str
    round: int
    screw_angle: float
    torque: float
    tip_force: float
    tilt: float
    real_time_factor: float


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Spread(_Part):
    """Size of an error over the run; null where it was never defined."""

    rms: float | None = Field(description="root mean square")
    max: float | None = Field(description="largest")


class PoseErrorOf(_Part):
    """Error of one estimate of the tool pose against the truth."""

    position_mm: Spread = Field(description="distance of the tip [mm]")
    tilt_deg: Spread = Field(description="angle between the tool's axes [deg]")
    yaw_deg: Spread = Field(description="rotation about the tool's axis [deg]")


class PoseError(_Part):
    """Error of the tool pose before and after refinement."""

    raw: PoseErrorOf = Field(description="as the camera gave it, late")
    refined: PoseErrorOf = Field(description="as the loop used it")


class WrenchError(_Part):
    """Error of the estimated wrench of the screw on the tip."""

    force_n: Spread = Field(description="norm of the force error [N]")
    torque_nm: Spread = Field(description="error of the torque about the screw's axis [N.m]")


class ForceError(_Part):
    """Error of the estimated fingertip forces, over fingers in contact."""

    magnitude_n: Spread = Field(description="error of the magnitude [N]")
    direction_deg: Spread = Field(description="angle between estimate and truth [deg]")


class FaultEntry(_Part):
    """One fault that the supervisor named."""

    kind: str = Field(description="name of the fault")
    time_s: float = Field(description="when it was named [s]")
    evidence: str = Field(description="the figure that was exceeded, in a sentence")


class RecoveryEntry(_Part):
    """One recovery that was tried."""

    fault: str = Field(description="name of the fault it answers")
    time_s: float = Field(description="when it began [s]")
    action: str = Field(description="what was done")


class Summary(_Part):
    """What `summary.json` holds."""

    outcome: str = Field(description='"goal", or the name of the fault that ended the run, or "interrupted"')
    rounds: int = Field(description="rounds completed")
    turned_deg: float = Field(description="angle by which the screw was turned in, true [deg]")
    advance_mm: float = Field(description="advance of the screw along its axis, true [mm]")
    final_torque_nm: float = Field(description="torque of the thread at the end, true [N.m]")
    max_tilt_deg: float = Field(description="largest angle of the tool's axis from the screw's, true [deg]")
    tip_slip_mm: float = Field(
        description="largest distance of the tip's edge centre from the drive's centre, true [mm]"
    )
    finger_slip_mm: float = Field(description="largest sliding path of a fingertip in one holding phase, true [mm]")
    sim_time_s: float = Field(description="simulated time [s]")
    wall_time_s: float = Field(description="wall time of the loop [s]")
    real_time_factor: float = Field(description="sim_time_s / wall_time_s")
    pose_error: PoseError = Field(description="tool pose against the truth")
    wrench_error: WrenchError = Field(description="wrench of the screw on the tip against the truth")
    force_error: ForceError = Field(description="fingertip forces against the truth")
    support_fraction: float = Field(description="share of the turning time with at least two fingers in contact, true")
    faults: list[FaultEntry] = Field(description="faults, in order of time")
    recoveries: list[RecoveryEntry] = Field(description="recoveries, in order of time")
    seed: int = Field(description="seed of the run")
    versions: dict[str, str] = Field(description="versions of everything that the result depends on")


def versions() -> dict[str, str]:
    """Versions of turnscrew, Python and the packages that a run's result depends on."""
    found = {"turnscrew": __version__, "python": python_version()}
    for name in ("mujoco", "gymnasium-robotics", "numpy", "scipy", "casadi", "daqp"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found
