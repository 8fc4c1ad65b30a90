"""Every derivative of every patch is the central difference of what it derives."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from turnscrew.geometry.profiles import Capsule, Cylinder, TurnedHandle, barrel, tapered

assert_close = partial(np.testing.assert_allclose, rtol=0.0)

FAMILY = {
    "cylinder": Cylinder(0.018, 0.08, 0.18),
    "finger": Capsule(0.00705, 0.02),
    "cone": tapered(0.08, 0.18, 0.012, 0.018),
    "barrel": barrel(0.08, 0.18, 0.012, 0.018),
    "turned": TurnedHandle((0.08, 0.10, 0.12, 0.15, 0.18), (0.012, 0.016, 0.013, 0.017, 0.015)),
}


@pytest.fixture(params=FAMILY)
def surface(request):
    return FAMILY[request.param]


def places(surface):
    """Parameters away from the seams, where second derivatives jump, with a step for each."""
    rng = np.random.default_rng(5)
    v_min, v_max = surface.domain
    step = 1e-5 * (v_max - v_min)
    seams = [0.0, *getattr(surface, "heights", ())]
    for _ in range(20):
        u, v = rng.uniform(-np.pi, np.pi), rng.uniform(v_min, v_max)
        if min(abs(v - seam) for seam in seams) > 10 * step:
            yield u, v, step


def central(function, u, v, step_v):
    step_u = 1e-5
    along_u = (function(u + step_u, v) - function(u - step_u, v)) / (2.0 * step_u)
    along_v = (function(u, v + step_v) - function(u, v - step_v)) / (2.0 * step_v)
    return along_u, along_v


# Central differences at 1e-5 of the range: truncation of 1e-10 and rounding of 1e-11 of the differentiated quantity;
# the steps of v may be 1e-6 m, so a normal's rounding of 1e-16 grows to 1e-10, and slopes are up to 140 / m.
CLOSE = {"rtol": 1e-7, "atol": 1e-8}


def test_tangents(surface):
    for u, v, step in places(surface):
        assert_close(surface.tangents(u, v), np.column_stack(central(surface.point, u, v, step)), **CLOSE)


def test_second_derivatives(surface):
    for u, v, step in places(surface):
        along_u, along_v = central(surface.tangents, u, v, step)
        uu, uv, vv = surface.second_derivatives(u, v).T
        assert_close(np.column_stack([uu, uv]), along_u, **CLOSE)
        assert_close(np.column_stack([uv, vv]), along_v, **CLOSE)


def test_normal_derivatives(surface):
    for u, v, step in places(surface):
        assert_close(surface.normal_derivatives(u, v), np.column_stack(central(surface.normal, u, v, step)), **CLOSE)
