"""Steering vectors against complex step, explicit phases and the folding of the sine."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.physics.array import (
    array_response,
    directional_sine,
    directional_slope,
    steering_derivative,
    steering_vector,
)

ANGLES = np.radians([0.0, 10.0, 45.0, 75.0, 90.0, 135.0, 180.0])


@pytest.mark.parametrize(("axis", "project"), [("vertical", math.sin), ("horizontal", math.cos)])
@pytest.mark.parametrize("spacing", [0.5, 0.3])
def test_steering_vector_is_the_phase_of_each_antennas_extra_path(axis, project, spacing):
    a = steering_vector(ANGLES, 6, spacing, axis)
    expected = [
        [cmath.exp(2j * math.pi * spacing * m * project(angle)) for m in range(6)]
        for angle in ANGLES
    ]
    np.testing.assert_allclose(a, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("axis", "project"), [("vertical", np.sin), ("horizontal", np.cos)])
def test_derivative_agrees_with_complex_step(axis, project):
    step, positions = 1e-30, np.arange(8)
    phase = 2 * np.pi * 0.4 * positions * project(ANGLES + 1j * step)[:, None]
    by_parts = np.imag(np.cos(phase)) / step + 1j * np.imag(np.sin(phase)) / step
    derivative = steering_derivative(ANGLES, 8, 0.4, axis)
    np.testing.assert_allclose(derivative, by_parts, rtol=1e-13, atol=1e-13)


def test_vertical_array_cannot_tell_ahead_from_behind():
    np.testing.assert_allclose(
        steering_vector(ANGLES, 30), steering_vector(np.pi - ANGLES, 30), atol=1e-13
    )


def test_horizontal_array_can_tell_ahead_from_behind():
    a = steering_vector(math.radians(75), 30, axis="horizontal")
    b = steering_vector(math.radians(105), 30, axis="horizontal")
    assert abs(np.vdot(a, b)) / 30 < 0.1


def test_asymptotic_orthogonality_is_as_weak_as_a_dirichlet_kernel_says():
    # |sin(N x) / (N sin x)|, x = pi spacing (sin t1 - sin t2): 0.0305 and 0.126 at N = 30
    for first, second, rounded in [(75, 135, 0.0305), (45, 120, 0.126)]:
        a, b = steering_vector(np.radians([first, second]), 30)
        x = math.pi * 0.5 * (math.sin(math.radians(first)) - math.sin(math.radians(second)))
        kernel = abs(math.sin(30 * x) / (30 * math.sin(x)))
        assert abs(np.vdot(a, b)) / 30 == pytest.approx(kernel, rel=1e-12)
        assert kernel == pytest.approx(rounded, abs=5e-4)


def test_slope_is_exactly_zero_where_the_array_is_blind():
    assert directional_slope(np.pi / 2) == 0.0
    assert directional_slope(np.pi, "horizontal") == 0.0
    assert np.all(steering_derivative(np.pi / 2, 5) == 0.0)
    assert directional_slope(np.pi / 2 - 1e-15) > 0.0


def test_exact_functions_are_sine_and_cosine_elsewhere():
    np.testing.assert_array_equal(exact_cosine(ANGLES[:4]), np.cos(ANGLES[:4]))
    np.testing.assert_array_equal(exact_sine(ANGLES[:6]), np.sin(ANGLES[:6]))
    assert exact_cosine(-np.pi / 2) == 0.0
    assert exact_sine(-np.pi) == 0.0


def test_single_antenna_sees_every_direction_alike():
    np.testing.assert_array_equal(steering_vector(ANGLES, 1), np.ones((7, 1)))
    np.testing.assert_array_equal(steering_derivative(ANGLES, 1), np.zeros((7, 1)))


def test_absent_object_gives_nan_and_leaves_the_others():
    theta = np.array([0.3, np.nan, 1.2])
    a = steering_vector(theta, 4)
    assert np.isnan(a[1]).all()
    np.testing.assert_array_equal(a[[0, 2]], steering_vector(theta[[0, 2]], 4))


def test_no_objects_and_any_leading_axes():
    assert steering_vector(np.zeros((3, 0)), 4).shape == (3, 0, 4)
    assert steering_derivative(np.zeros((2, 3, 5)), 4).shape == (2, 3, 5, 4)
    assert directional_sine(0.3).shape == ()


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
@pytest.mark.parametrize("n", [1, 2, 3, 16, 17, 30, 128])
def test_response_is_the_product_with_the_steering_vector(n, axis):
    rng = np.random.default_rng(n)
    beams = rng.standard_normal((2, 3, n)) + 1j * rng.standard_normal((2, 3, n))
    theta = rng.uniform(-np.pi, np.pi, (2, 3, 5))
    steering = steering_vector(theta, n, 0.7, axis)
    expected = np.einsum("...jn,...n->...j", np.conj(steering), beams)
    response = array_response(beams, theta, 0.7, axis)
    np.testing.assert_allclose(response, expected, rtol=0, atol=1e-13 * n)


def test_response_is_not_a_number_where_the_direction_is_not():
    response = array_response(np.ones(4, dtype=complex), np.array([0.5, np.nan]))
    assert np.isfinite(response[0])
    assert np.isnan(response[1])
