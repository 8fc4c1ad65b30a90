"""Forces put on fingertips in MuJoCo and read back from the servos' torques."""

from __future__ import annotations

import numpy as np
from rigs.pressed import ROBOT, Rig, presses

from turnscrew.actuate.position import DRIVEN_INDEX
from turnscrew.estimate.between_ticks import BetweenTicks, TorqueTrack
from turnscrew.estimate.driven_force import DrivenForce
from turnscrew.estimate.finger_force import ForceFromTorque
from turnscrew.geometry.arrays import Array
from turnscrew.robot.joints import DRIVEN, INDEX, JOINTS
from turnscrew.sense.encoders import Encoders

EXACT = ForceFromTorque(ROBOT, gauge_floor=0.0, gauge_share=0.0, model_floor=1e-4)
FINGER_DRIVES = np.array([name not in ("WAMJ1", "WAMJ2", "WAMJ3", "WAMJ4", "WRJ2", "WRJ1") for name in DRIVEN])


def settled(rig: Rig, f_F: Array) -> Array:
    """The estimate (5, 3) after the finger has come to rest."""
    for _ in range(60):
        tau = rig.tick(f_F)
    tips, points = rig.pads()
    return EXACT.update(EXACT.init(), tau, rig.q, np.zeros(len(JOINTS)), tips, points, 0.01)[1]


def test_a_static_force_on_each_fingertip_is_read_from_the_torques() -> None:
    rig = Rig()
    f_F = presses(rig)
    # the prior's share of a doubt of 1e-4 N.m over 10 mm: (.01 N / 3 N)^2 of 5 N; and what has not settled in .6 s
    np.testing.assert_allclose(settled(rig, f_F), f_F, atol=1e-4)


def test_dry_friction_costs_what_it_can() -> None:
    rig = Rig(friction=0.001)
    f_F = presses(rig)
    # .001 N.m over the least lever of a pad's point in this posture, 10 mm
    np.testing.assert_allclose(settled(rig, f_F), f_F, atol=0.1)


def swing(lag: float, f_F: Array) -> tuple[Array, float]:
    """Errors (ticks, 5) of the estimate while all fingers swing by 3.4 deg at 3 Hz, and their highest speed."""
    rig = Rig()
    block = ForceFromTorque(ROBOT, gauge_floor=0.0, gauge_share=0.0, model_floor=1e-4, lag=lag)
    state, sensor = block.init(), Encoders(noise=np.zeros(len(JOINTS)), offset_sigma=np.zeros(len(JOINTS)))
    reading = sensor.init(np.random.default_rng(0))
    errors, fastest = [], 0.0
    for k in range(150):
        rig.data.ctrl[:] = rig.rest + FINGER_DRIVES * 0.06 * np.sin(6.0 * np.pi * 0.01 * k)
        tau = rig.tick(f_F)
        reading, (q, v) = sensor.update(reading, rig.q, rig.data.time)
        tips, points = rig.pads()
        state, f = block.update(state, tau, q, v, tips, points, 0.01)
        if k > 50:
            errors.append(np.linalg.norm(f - f_F, axis=1))
            fastest = max(fastest, float(np.abs(v).max()))
    return np.array(errors), fastest


def test_a_moving_finger_presses_with_no_more_than_it_does() -> None:
    f_F = presses(Rig())
    errors, fastest = swing(EXACT.lag, f_F)
    assert fastest > 0.8
    # a steady force, so the low-pass costs nothing; the acceleration's own lag of 15 ms at 3 Hz is .3 of an inertia
    # torque of .001 kg.m2 x 20 rad/s2, so 6 mN.m on levers of 15 to 70 mm
    assert np.sqrt(np.mean(errors**2)) < 0.3
    # without the torques' low-pass to match the speeds', damping of .1 N.m.s/rad is felt 20 ms late
    unmatched, _ = swing(1e-6, f_F)
    assert np.sqrt(np.mean(unmatched**2)) > 2.0 * np.sqrt(np.mean(errors**2))


def driven_swing(f_F: Array, torque_time: float = BetweenTicks.time) -> Array:
    """Errors (ticks, 5) of the observer in the same swing, told every torque and every angle as the loop is."""
    rig, joints_block = Rig(), BetweenTicks(ROBOT, 0.0007)
    torque_block = BetweenTicks(ROBOT, 0.0007, time=torque_time)
    observer = DrivenForce(EXACT)
    joints, track, state, errors = joints_block.init(rig.q), None, observer.init(), []

    def watch(tau: Array) -> None:
        nonlocal joints, track
        track = torque_block.sent(track, tau, 0.001)
        joints = joints_block.read(joints, rig.q, 0.001)

    for k in range(150):
        rig.data.ctrl[:] = rig.rest + FINGER_DRIVES * 0.06 * np.sin(6.0 * np.pi * 0.01 * k)
        rig.tick(f_F, watch)
        assert isinstance(track, TorqueTrack)
        tips, points = rig.pads()
        state = observer.update(state, track.tau, joints.q, joints.v, tips, points, 0.01)
        if k > 50:
            f_F_now = (state.f_W[:, None, :] @ tips.R_WF)[:, 0]
            errors.append(np.linalg.norm(f_F_now - f_F, axis=1))
    return np.array(errors)


def test_the_observer_follows_a_moving_finger_by_the_torques_sent() -> None:
    f_F = presses(Rig())
    errors = driven_swing(f_F)
    # torques, speeds and accelerations belong to the same moment; what is left is the posture's, which is 30 ms ahead
    assert np.sqrt(np.mean(errors**2)) < 0.15
    # torques that are not low-passed as the speeds are feel the damping 20 ms early
    unmatched = driven_swing(f_F, torque_time=1e-6)
    assert np.sqrt(np.mean(unmatched**2)) > 3.0 * np.sqrt(np.mean(errors**2))


def test_names_of_the_drives_are_the_joints() -> None:
    assert [INDEX[name] for name in DRIVEN] == DRIVEN_INDEX.tolist()
