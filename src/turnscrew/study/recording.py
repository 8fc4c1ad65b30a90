"""A run's record, read back as what the estimator was given and what was true."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from turnscrew.decide.plan import GaitPlan
from turnscrew.estimate.estimator import ToolEstimator
from turnscrew.geometry.arrays import Array, Flags
from turnscrew.geometry.rotations import exp_so3
from turnscrew.plant.log import read_log
from turnscrew.plant.playback import Playback
from turnscrew.robot.joints import DRIVEN, FINGERS, JOINTS
from turnscrew.robot.model import RobotModel
from turnscrew.sense.sensors import Sensors
from turnscrew.signals import Measurement, Vision
from turnscrew.task.record import SCENARIO
from turnscrew.task.scenario import load
from turnscrew.task.scenario_keys import Scenario
from turnscrew.task.signal_table import column, read_signals
from turnscrew.task.start import Start, draw_start, plan_of
from turnscrew.task.wiring import believed_inertia, build_cell, build_estimator, build_sensors, generators
from turnscrew.values import changed

AGAIN = ("vision", "force", "sense")
"""Tables of a scenario that describe sensors: with other values there, or other markers, the run is measured again."""


@dataclass(frozen=True)
class Truth:
    """What was so at each of n ticks.

    Attributes:
        time: (n,) [s].
        p_WT: (n, 3) tip position in W [m].
        R_WT: (n, 3, 3) orientation of the tool.
        F_s: (n, 6) wrench of the screw on the tool, in T, force first [N, N.m].
        held: (n,) whether at least two fingertips touched.
        turning: (n,) whether the tool was being turned.
    """

    time: Array
    p_WT: Array
    R_WT: Array
    F_s: Array
    held: Flags
    turning: Flags


@dataclass(frozen=True)
class Recording:
    """A run to be estimated again.

    Attributes:
        name: Of its folder.
        scenario: It was made with, overrides on top.
        measurements: Of each tick.
        sent: (n, 28) motion that the joints were told to make before each [rad].
        truth: Beside them.
        estimator: As the loop had it, with what the robot was told.
        p_WT: (3,) where the robot believed the tip to be at the start, in W [m].
        R_WT: (3, 3) how it believed the tool to stand.
    """

    name: str
    scenario: Scenario
    measurements: tuple[Measurement, ...]
    sent: Array
    truth: Truth
    estimator: ToolEstimator
    p_WT: Array
    R_WT: Array

    @property
    def dt(self) -> float:
        """Period of the tick [s]."""
        return 1.0 / self.scenario.rate.control


def read(folder: Path, overrides: Sequence[str] = ()) -> Recording:
    """Reads a run, and measures it again where overrides change its sensors.

    Args:
        folder: Of the run.
        overrides: `key=value` each, as `turnscrew fasten --set` takes them; of the tables `vision`, `force`, `sense`
            and `estimate`.

    Raises:
        RecordError: the folder holds no whole record.
        ScenarioError: an override is wrong.
    """
    log = read_log(folder)
    made = load(folder / SCENARIO)
    scenario = load(folder / SCENARIO, list(overrides))
    columns = read_signals(folder)
    robot = RobotModel()
    # what is true of the run was drawn when it was made; overrides change what is measured of it
    start, plan = _start(made, robot)
    truth = _truth(columns)
    same = all(getattr(made, table) == getattr(scenario, table) for table in AGAIN)
    same = same and made.tool.markers == scenario.tool.markers
    if same:
        measurements = _recorded(columns)
    else:
        with build_cell(scenario, start, plan) as cell:
            measurements = _measured(build_sensors(scenario, plan), scenario.seed, Playback(cell, log), truth.time)
    # other sensors do not change what the drives were sent
    pairs = zip(measurements, _driven(columns, len(truth.time)), strict=True)
    measurements = tuple(changed(measurement, tau_sent=tau) for measurement, tau in pairs)
    inertia = believed_inertia(scenario, start.believed_radius)
    return Recording(
        name=folder.name,
        scenario=scenario,
        measurements=measurements,
        sent=_sent(columns, made),
        truth=truth,
        estimator=build_estimator(scenario, plan, robot, inertia, start.believed_radius),
        p_WT=plan.p_WS,
        R_WT=exp_so3(np.array([0.0, 0.0, scenario.screw.slot_yaw])),
    )


def _start(scenario: Scenario, robot: RobotModel) -> tuple[Start, GaitPlan]:
    """Plan and start of a run, drawn as they were."""
    plan = plan_of(scenario)
    return draw_start(scenario, plan, robot, generators(scenario.seed)["start"]), plan


def _truth(columns: Mapping[str, np.ndarray]) -> Truth:
    touching = column(columns, "truth.touching", len(FINGERS)) > 0
    return Truth(
        time=column(columns, "time"),
        p_WT=column(columns, "truth.p_WT", 3),
        R_WT=column(columns, "truth.R_WT", 3, 3),
        F_s=column(columns, "truth.F_s", 6),
        held=touching.sum(axis=1) >= 2,
        turning=column(columns, "goal.turn_rate") != 0.0,
    )


def _sent(columns: Mapping[str, np.ndarray], scenario: Scenario) -> Array:
    """What had been sent when each tick's measurement was taken: nothing before the first."""
    if scenario.robot.actuation == "torque":
        return np.zeros((len(column(columns, "time")), len(JOINTS)))
    motion = column(columns, "command.motion", len(JOINTS))
    return np.concatenate([np.zeros((1, len(JOINTS))), motion[:-1]])


def _recorded(columns: Mapping[str, np.ndarray]) -> tuple[Measurement, ...]:
    """The measurements as they were."""
    time = column(columns, "time")
    q, v = (column(columns, f"measurement.{name}", len(JOINTS)) for name in "qv")
    f_F = _optional(columns, "measurement.f_F", len(FINGERS), 3)
    tau = _optional(columns, "measurement.tau", len(DRIVEN))
    frames = _frames(columns, len(time))
    blind = columns.get("measurement.blind", np.full(len(time), ""))
    return tuple(
        Measurement(
            time=float(time[i]),
            q=q[i],
            v=v[i],
            f_F=None if f_F is None else f_F[i],
            tau=None if tau is None else tau[i],
            vision=frames[i],
            blind=str(blind[i]),
        )
        for i in range(len(time))
    )


def _driven(columns: Mapping[str, np.ndarray], ticks: int) -> list[Array | None]:
    """The torques (24,) that the drives had been sent at each tick, as the loop had them; none before the first."""
    tau = _optional(columns, "measurement.tau_sent", len(DRIVEN))
    return [None if tau is None or np.isnan(tau[i]).any() else tau[i] for i in range(ticks)]


def _optional(columns: Mapping[str, np.ndarray], path: str, *shape: int) -> Array | None:
    """A signal that a robot without the sensor does not have."""
    return column(columns, path, *shape) if any(name.startswith(f"{path}.") for name in columns) else None


def _frames(columns: Mapping[str, np.ndarray], ticks: int) -> list[Vision | None]:
    if "measurement.vision.stamp" not in columns:
        return [None] * ticks
    stamp = column(columns, "measurement.vision.stamp")
    p, R = column(columns, "measurement.vision.p_WT", 3), column(columns, "measurement.vision.R_WT", 3, 3)
    P = column(columns, "measurement.vision.P", 6, 6)
    return [None if np.isnan(stamp[i]) else Vision(float(stamp[i]), p[i], R[i], P[i]) for i in range(ticks)]


def _measured(sensors: Sensors, seed: int, playback: Playback, times: Array) -> tuple[Measurement, ...]:
    """The run as these sensors would have measured it; their errors are drawn from its seed."""
    streams = generators(seed)
    state = sensors.init(streams["encoders"], streams["force"], streams["camera"])
    out = []
    for time in times:
        state, measurement = sensors.update(state, playback.seek(float(time)))
        out.append(measurement)
    return tuple(out)
