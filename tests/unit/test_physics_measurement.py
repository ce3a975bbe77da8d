"""The measurement model against the time derivative of the geometry, by SymPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy

from echobeam.physics.measurement import closing_speed, measure, velocity_from_doppler
from echobeam.units import SPEED_OF_LIGHT

CARRIER = 30e9


def doppler_from_geometry():
    """mu = -(2 f_c / c) dd/dt of a straight flight over a straight road, as a function."""
    t, x, h, v, vu, tu = sympy.symbols("t x h v v_u theta_u", real=True)
    east = x + (v - vu * sympy.cos(tu)) * t
    up = h + vu * sympy.sin(tu) * t
    range_rate = sympy.diff(sympy.sqrt(east**2 + up**2), t).subs(t, 0)
    mu = -2 * CARRIER / SPEED_OF_LIGHT * range_rate
    return sympy.lambdify((x, h, v, vu, tu), mu, "numpy")


def test_doppler_is_the_time_derivative_of_the_distance():
    rng = np.random.default_rng(9)
    theta, d = rng.uniform(0.05, 3.1, 200), rng.uniform(20, 300, 200)
    v, speed = rng.normal(0, 30, 200), rng.uniform(0, 20, 200)
    heading = rng.uniform(-np.pi, np.pi, 200)
    expected = doppler_from_geometry()(d * np.cos(theta), d * np.sin(theta), v, speed, heading)
    actual = measure(theta, d, v, speed, heading, CARRIER)[..., 2]
    np.testing.assert_allclose(actual, expected, rtol=1e-11, atol=1e-9)


def test_angle_and_delay_are_what_they_say():
    z = measure(np.array([1.0]), np.array([149.896229]), np.array([0.0]), 0.0, 0.0, CARRIER)
    assert z[0, 0] == 1.0
    assert z[0, 1] == pytest.approx(1e-6, rel=1e-15, abs=0)  # 299.792458 m there and back
    assert z[0, 2] == 0.0


def test_approach_is_positive():
    ahead, behind = math.radians(60), math.radians(120)
    assert closing_speed(ahead, -30.0, 0.0, 0.0) == pytest.approx(15.0)
    assert closing_speed(behind, -30.0, 0.0, 0.0) == pytest.approx(-15.0)
    sinking = closing_speed(np.pi / 2, 0.0, 15.0, -np.pi / 2)
    assert sinking == pytest.approx(15.0)


def test_velocity_comes_back_from_the_doppler():
    rng = np.random.default_rng(10)
    theta = np.concatenate([rng.uniform(0.05, 1.5, 50), rng.uniform(1.65, 3.1, 50)])
    v = rng.normal(0, 30, 100)
    mu = measure(theta, np.full(100, 80.0), v, 15.0, -1.2, CARRIER)[..., 2]
    np.testing.assert_allclose(
        velocity_from_doppler(mu, theta, 15.0, -1.2, CARRIER), v, rtol=1e-11, atol=1e-11
    )


def test_velocity_straight_under_the_uav_is_not_observable():
    under = np.pi / 2
    own = measure(under, 100.0, 30.0, 15.0, 0.3, CARRIER)[2]
    assert velocity_from_doppler(own + 1.0, under, 15.0, 0.3, CARRIER) == -np.inf
    assert velocity_from_doppler(own - 1.0, under, 15.0, 0.3, CARRIER) == np.inf
    assert np.isnan(velocity_from_doppler(0.0, under, 0.0, 0.0, CARRIER))


def test_absent_and_no_objects():
    theta = np.array([np.nan, 1.0])
    z = measure(theta, np.array([np.nan, 50.0]), np.array([np.nan, 3.0]), 15.0, -1.0, CARRIER)
    assert np.isnan(z[0]).all()
    np.testing.assert_array_equal(z[1], measure(1.0, 50.0, 3.0, 15.0, -1.0, CARRIER))
    empty = np.zeros((5, 0))
    assert measure(empty, empty, empty, 15.0, -1.0, CARRIER).shape == (5, 0, 3)
