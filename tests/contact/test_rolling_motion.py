"""(17)'s right side against central differences along a motion of the tool."""

from __future__ import annotations

import numpy as np

from turnscrew.contact.grasp import grasp_matrix
from turnscrew.contact.rolling_motion import contact_accelerations
from turnscrew.geometry.rotations import exp_so3

STEP = 1e-5


def test_contacts_accelerate_as_the_differences_of_their_velocities_say():
    rng = np.random.default_rng(0)
    R_0, nu_0, alpha = exp_so3(rng.normal(size=3)), rng.normal(size=6), rng.normal(size=6)
    p_0, c_0, cdot = rng.normal(size=3) * 0.1, rng.normal(size=(3, 3)) * 0.1, rng.normal(size=(3, 3))

    def velocities(t):
        """Of the tool's material points where the contacts are at time t, to second order in t."""
        nu = nu_0 + t * alpha
        # a midpoint rotation and a parabola: exact to second order, as central differences need
        R = R_0 @ exp_so3(t * (nu_0[3:] + 0.5 * t * alpha[3:]))
        v_0 = R_0 @ nu_0[:3]
        a_0 = R_0 @ (alpha[:3] + np.cross(nu_0[3:], nu_0[:3]))
        p = p_0 + t * v_0 + 0.5 * t * t * a_0
        V = np.concatenate([R @ nu[:3], R @ nu[3:]])
        return grasp_matrix(c_0 + t * cdot, p).T @ V

    differences = (velocities(STEP) - velocities(-STEP)) / (2 * STEP)
    found = contact_accelerations(c_0, cdot, p_0, R_0, nu_0, alpha)
    # central differences of O(1) motions err by STEP^2, and by 1e-16 / STEP
    np.testing.assert_allclose(found, differences, atol=1e-8)
