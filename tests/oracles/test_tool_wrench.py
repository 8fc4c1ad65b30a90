"""III-B against momentum balances of a rigid body whose motion is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from turnscrew.contact.tool_dynamics import ToolInertia
from turnscrew.estimate.biased_load import BiasedLoad
from turnscrew.estimate.tip_wrench import TipWrench
from turnscrew.geometry.rotations import exp_so3

PITCH = 0.0005
G = np.array([0.0, 0.0, -9.81])
TOOL = ToolInertia(
    0.09, np.array([0.002, -0.001, 0.11]), np.array([[2e-4, 1e-5, 0], [1e-5, 1.8e-4, 2e-5], [0, 2e-5, 3e-5]])
)


class Motion:
    """A tool turning and tilting as the screw lets it: body rates (w_x(t), w_y = const, w_z(t)), v_z = p/2pi w_z.

    The pose is integrated in steps of 10 us with the mid-step rates; only differences over 1 ms are used.
    """

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.a, self.b, self.c = rng.normal(0.0, 1.0, 3), rng.normal(0.0, 2.0, 3), float(rng.normal(0.0, 0.2))
        self.R0 = exp_so3(rng.normal(0.0, 0.3, 3))

    def rates(self, t: float) -> np.ndarray:
        w_x = self.a[0] + self.b[0] * t + self.a[1] * np.sin(3.0 * t)
        w_z = -1.0 + self.b[2] * t + self.a[2] * np.sin(5.0 * t)
        return np.array([0.0, 0.0, PITCH / (2 * np.pi) * w_z, w_x, self.c, w_z])

    def poses(self, t: float, h: float) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """(p, R, nu) at t - h, t, t + h."""
        out = [(np.zeros(3), self.R0, self.rates(t - h))]
        steps = 200
        for half in (0, 1):
            p, R, _ = out[-1]
            for i in range(steps):
                middle = self.rates(t - h + (half + (i + 0.5) / steps) * h)
                half_turn = exp_so3(middle[3:] * 0.5 * h / steps)
                p = p + R @ half_turn @ middle[:3] * h / steps
                R = R @ half_turn @ half_turn
            out.append((p, R, self.rates(t - h + (half + 1) * h)))
        return out


def total_wrench(motion: Motion, t: float, h: float = 5e-4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wrench of hand and screw together at the tip, in T, from the rates of change of momentum in W."""
    momenta = []
    for p, R, nu in motion.poses(t, h):
        omega = R @ nu[3:]
        com = p + R @ TOOL.com
        linear = TOOL.mass * (R @ nu[:3] + np.cross(omega, R @ TOOL.com))
        angular = R @ TOOL.inertia @ nu[3:] + np.cross(com, linear)
        momenta.append((linear, angular))
    p, R, nu = motion.poses(t, h)[1]
    force = (momenta[2][0] - momenta[0][0]) / (2 * h) - TOOL.mass * G
    about_origin = (momenta[2][1] - momenta[0][1]) / (2 * h) - np.cross(p + R @ TOOL.com, TOOL.mass * G)
    torque = about_origin - np.cross(p, force)
    return np.concatenate([R.T @ force, R.T @ torque]), R, nu


@pytest.mark.parametrize("seed", range(8))
def test_screws_wrench_and_accelerations_are_recovered(seed: int) -> None:
    motion, rng, t = Motion(seed), np.random.default_rng(100 + seed), 0.3
    total, R, nu = total_wrench(motion, t)
    theta, k_s = 1.2, 0.1
    F_s = np.array([*rng.normal(0.0, 3.0, 3), 0.0, rng.normal(0.0, 0.01), k_s * theta])
    found, acceleration = TipWrench(TOOL, PITCH).solve(total - F_s, R, nu, k_s * theta)
    # central differences over .5 ms: third derivatives (about 125 rad/s4 x 1e-3 kg.m2 at 1.1e-3 kg.m2 about the tip)
    # x h^2 / 6 = 4e-8 relative; the integrator's steps of 2.5 us are finer still
    np.testing.assert_allclose(found, F_s, atol=2e-6)
    h = 1e-6
    expected = (motion.rates(t + h)[[3, 5]] - motion.rates(t - h)[[3, 5]]) / (2 * h)
    # torque errors of 1e-7 N.m over the smallest inertia, 3e-5 kg.m2
    np.testing.assert_allclose(acceleration, expected, atol=2e-2)


@pytest.mark.parametrize("seed", range(3))
def test_equation_seven_is_newton_and_euler(seed: int) -> None:
    motion, t, h = Motion(seed), 0.7, 1e-6
    total, R, nu = total_wrench(motion, t)
    nudot = (motion.rates(t + h) - motion.rates(t - h)) / (2 * h)
    np.testing.assert_allclose(TOOL.M @ nudot + TOOL.bias(R, nu), total, atol=2e-6)


HELD = ToolInertia(0.08, np.array([0.0, 0.0, 0.1]), np.diag([1e-4, 1e-4, 1e-5]))


def test_resting_tool_hands_its_weight_and_the_hands_push_to_the_screw() -> None:
    # pressed down by 5 N and turned by -.1 N.m (fastening); the screw holds with k_s theta = .05 x 2
    F_s, acceleration = TipWrench(HELD, PITCH).solve(np.array([0, 0, -5.0, 0, 0, -0.1]), np.eye(3), np.zeros(6), 0.1)
    # rounding only
    np.testing.assert_allclose(F_s, [0, 0, 5.0 + 0.08 * 9.81, 0, 0, 0.1], atol=1e-12)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-9)


def test_torque_that_the_screw_does_not_take_turns_the_tool() -> None:
    _, acceleration = TipWrench(HELD, PITCH).solve(np.array([0, 0, -5.0, 0, 0, -0.1]), np.eye(3), np.zeros(6), 0.09)
    # the tool alone, for the thread couples only its 80 g to the turn: .08 x (1e-4)^2 against 1e-5 kg.m2
    np.testing.assert_allclose(acceleration[1], -0.01 / 1e-5, rtol=1e-3)


def held(wrench: TipWrench, F_h: np.ndarray, ticks: int, theta: float = 0.0) -> np.ndarray:
    """Wrenches (ticks, 6) estimated from a constant one of the hand, two fingers pressing with 4 N, at 200 Hz."""
    state, history = wrench.init(), []
    squeeze = np.array([4.0, 0.0, 4.0, 0.0, 0.0])
    for _ in range(ticks):
        state, F_s = wrench.update(state, F_h, squeeze, 0.018, np.eye(3), np.zeros(6), theta, 0.005)
        history.append(F_s)
    return np.array(history)


def test_torque_of_the_slot_is_low_passed_and_clamped() -> None:
    wrench = TipWrench(HELD, PITCH)
    history = held(wrench, np.array([0, 0, 0, 0, -0.01, 0]), 400)[:, 4]
    # after .05 s a first-order lag with steps of a tenth of it has 1 - (10/11)^10 = .614
    np.testing.assert_allclose(history[9], 0.00614, atol=1e-5)
    np.testing.assert_allclose(history[-1], 0.01, atol=1e-9)
    assert held(wrench, np.array([0, 0, 0, 0, -0.1, 0]), 400)[-1, 4] == wrench.tau_y_limit


def test_good_fingertips_are_believed_at_the_stated_bandwidth() -> None:
    exact = BiasedLoad(offset=5.0, slope=0.0, drift=3.0, noise=0.1, direction_error=0.0, surprise=np.inf)
    history = held(TipWrench(HELD, PITCH, axial=exact), np.array([0, 0, -5.0, 0, 0, 0]), 100)[:, 2]
    # settled, a gain of q / r at q = 3 N sqrt(5 ms), r = .1 N: .88 by the scalar Riccati equation, so 5 N to rounding
    np.testing.assert_allclose(history[-1], 5.0 + 0.08 * 9.81, atol=1e-6)
    # and 5 Hz are 30 ms: six ticks leave less than 1/e of the step
    assert abs(history[6] - history[-1]) < 5.0 / np.e


def test_torque_is_none_before_the_blade_has_met_the_slot() -> None:
    history = held(TipWrench(HELD, PITCH), np.array([0, 0, -5.0, 0, 0, -0.03]), 50)
    np.testing.assert_array_equal(history[:, 5], 0.0)


def test_thread_couples_travel_to_turn() -> None:
    wrench = TipWrench(TOOL, PITCH)
    # a full turn of fastening, which is negative yaw, sinks the tip by one pitch
    np.testing.assert_allclose(wrench.advance(-2 * np.pi), -PITCH, atol=1e-15)
