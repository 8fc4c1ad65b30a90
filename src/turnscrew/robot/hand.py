"""The Shadow Dexterous Hand, from gymnasium-robotics' description with its placeholders replaced.

Kept: kinematics, collision shapes, masses, joint ranges, damping and friction, skins.  Replaced: servos (ours are
in `turnscrew.plant.servos`), the tendons that couple J1 and J2 with slack (a joint equality), finger inertias
(1e-5 kg.m2 everywhere, ten times too large at the tips; here from mass and shape), hand-picked contact pairs (all
links may touch each other and the tool).  Joints get Shadow's own names, one up from the description's.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from turnscrew.errors import ModelError
from turnscrew.robot.joints import COUPLED, JOINTS

SKIN = (0.78, 0.79, 0.82, 1.0)

TORQUE_LIMITS = {
    "WRJ2": 4.79, "WRJ1": 2.18, "THJ5": 2.37, "THJ4": 1.45, "THJ3": 0.99, "THJ2": 0.99, "THJ1": 0.81,
    "J4": 0.9, "J3": 0.9, "J2": 0.72, "LFJ5": 0.9,
}  # fmt: skip
"""Peak torque of each drive [N.m], from gymnasium-robotics' force ranges; Shadow's URDF allows 2 N.m for fingers,
so these are the stricter."""

TIP_RADIUS = {"TH": 0.00918, "FF": 0.00705, "MF": 0.00705, "RF": 0.00705, "LF": 0.00705}
"""Radius of the distal capsules [m]."""

SMALL_BODY_RADIUS = 0.008
"""Radius of the sphere whose inertia the shapeless knuckles and hubs get [m]: half a finger's width."""

PREFIX = "shadow_"

NEVER_TOUCH = (
    ("forearm", "palm"), ("palm", "ffproximal"), ("palm", "mfproximal"), ("palm", "rfproximal"),
    ("palm", "lfproximal"), ("lfmetacarpal", "lfproximal"), ("lfmetacarpal", "rfproximal"),
    ("palm", "thproximal"), ("thproximal", "thmiddle"), ("lfmetacarpal", "wrist"),
)  # fmt: skip
"""Neighbours one joint apart whose collision shapes overlap by construction."""


def torque_limit(joint: str) -> float:
    """Peak torque [N.m] of a hand joint's drive."""
    return TORQUE_LIMITS.get(joint, TORQUE_LIMITS.get(joint[2:], 0.0))


def asset_folder() -> Path:
    """Folder with the hand's files.

    Raises:
        ModelError: gymnasium-robotics is not installed.
    """
    # find_spec does not run the package, which would pull in Gymnasium and take seconds
    spec = importlib.util.find_spec("gymnasium_robotics")
    if spec is None or not spec.submodule_search_locations:
        raise ModelError("the Shadow Hand's files are missing: install gymnasium-robotics==1.4.2")
    return Path(next(iter(spec.submodule_search_locations))) / "envs" / "assets"


def _new_name(name: str) -> str:
    name = name.removeprefix("robot0:")
    is_joint = len(name) == 4 and name[2] == "J"
    return f"{name[:3]}{int(name[3]) + 1}" if is_joint else name


def hand_spec() -> mujoco.MjSpec:
    """The hand as a spec of its own, its root body `hand` at the mounting plate.

    Raises:
        ModelError: gymnasium-robotics is not installed.
    """
    assets = asset_folder()
    spec = mujoco.MjSpec.from_string(f"""
        <mujoco>
          <compiler angle="radian" meshdir="{assets / "stls" / "hand"}" texturedir="{assets / "textures"}"/>
          <include file="{assets / "hand" / "shared.xml"}"/>
          <asset><include file="{assets / "hand" / "shared_asset.xml"}"/></asset>
          <worldbody><include file="{assets / "hand" / "robot.xml"}"/></worldbody>
        </mujoco>""")
    for elements in (spec.pairs, spec.tendons, spec.actuators, spec.sensors, spec.sites, spec.excludes):
        for element in list(elements):
            spec.delete(element)
    for elements in (spec.bodies[1:], spec.joints, spec.geoms, spec.meshes):
        for element in elements:
            element.name = _new_name(element.name)
    for geom in spec.geoms:
        geom.meshname = _new_name(geom.meshname)
    spec.njmax = spec.nconmax = spec.nuser_jnt = spec.nuser_site = -1
    spec.nuser_tendon = spec.nuser_actuator = spec.nuser_sensor = -1
    spec.body("hand mount").name = "hand"
    _set_materials(spec)
    _set_inertias(spec)
    _set_contacts(spec)
    for follower, leader in COUPLED.items():
        spec.add_equality(
            name=f"{follower}={leader}", type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=follower, name2=leader, data=[0, 1, *[0] * 10],
        )  # fmt: skip
    return spec


def _set_materials(spec: mujoco.MjSpec) -> None:
    for mesh in spec.meshes:
        mesh.file = str(asset_folder() / "stls" / "hand" / mesh.file)
    spec.meshdir = ""
    for geom in spec.geoms:
        geom.material = ""
        if geom.name.startswith("V_"):
            geom.rgba, geom.mass = SKIN, 0.0
    for name in ("DC_Hand", "D_Vizual"):
        spec.find_default(f"robot0:{name}").geom.material = ""
    for element in (*spec.materials, *spec.textures):
        spec.delete(element)


def _set_inertias(spec: mujoco.MjSpec) -> None:
    """Inertia of each finger link from its mass and its capsule; of shapeless links from a small sphere."""
    palm_side = ("hand", "forearm", "wrist", "palm")
    for body in spec.bodies[1:]:
        if body.name in palm_side:
            continue
        capsules = [geom for geom in body.geoms if geom.type == mujoco.mjtGeom.mjGEOM_CAPSULE]
        if capsules:
            body.iquat = np.array([1.0, 0, 0, 0])
            body.inertia = capsule_inertia(body.mass, capsules[0].size[0], 2 * capsules[0].size[1])
        else:
            body.inertia = np.full(3, 0.4 * body.mass * SMALL_BODY_RADIUS**2)


def capsule_inertia(mass: float, radius: float, length: float) -> NDArray[np.float64]:
    """Principal inertias (3,) [kg.m2] of a solid capsule about its centre, its axis along z.

    Args:
        mass: [kg].
        radius: Of cylinder and caps [m].
        length: Of the cylinder between the caps [m].
    """
    cylinder = mass * length / (length + 4 / 3 * radius)
    caps = mass - cylinder
    axial = cylinder * radius**2 / 2 + caps * 0.4 * radius**2
    # a half ball's centre sits 3/8 radius above its base: parallel-axis terms of both caps
    across = cylinder * (radius**2 / 4 + length**2 / 12) + caps * (
        0.4 * radius**2 + length**2 / 4 + 3 / 8 * radius * length
    )
    return np.array([across, across, axial])


def _set_contacts(spec: mujoco.MjSpec) -> None:
    for geom in spec.geoms:
        if geom.name.startswith("C_"):
            geom.contype, geom.conaffinity, geom.group = 1, 1, 3
        else:
            geom.contype, geom.conaffinity = 0, 0
    for one, other in NEVER_TOUCH:
        spec.add_exclude(bodyname1=one, bodyname2=other)


def attach_hand(spec: mujoco.MjSpec, plate: mujoco.MjsBody) -> None:
    """Fixes the hand on the arm's plate, turned by +90 deg about the forearm so that the palm can face down."""
    frame = plate.add_frame(quat=[np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)])
    hand = hand_spec()
    root = hand.body("hand")
    root.pos, root.quat = np.zeros(3), np.array([1.0, 0, 0, 0])
    root.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    # attaching without a prefix leaves an unnamed default class that cannot be saved: attach with one, then drop it
    frame.attach_body(root, PREFIX, "")
    for elements in (spec.bodies, spec.joints, spec.geoms, spec.meshes, spec.equalities, spec.excludes):
        for element in elements:
            element.name = element.name.removeprefix(PREFIX)
            for reference in ("meshname", "name1", "name2", "bodyname1", "bodyname2"):
                if hasattr(element, reference):
                    setattr(element, reference, getattr(element, reference).removeprefix(PREFIX))


def check_joint_order(model: mujoco.MjModel) -> None:
    """Raises `ModelError` unless the model's first 28 joints are `JOINTS` in order."""
    names = tuple(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, i) for i in range(len(JOINTS)))
    if names != JOINTS:
        raise ModelError(f"the robot's joints come in the order {names}, expected {JOINTS}")
