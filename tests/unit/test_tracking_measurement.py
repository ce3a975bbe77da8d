"""Expected measurements and their Jacobian against moving distances and complex steps."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.tracking.polar import PolarMeasurement

from ..forms import flying

C = 299_792_458.0
CARRIER = 30e9
DOWN = -np.pi / 2
STATES = np.array([[1.05, 115.0, 30.0], [2.4, 141.0, -3.0], [np.pi / 2, 100.0, 12.0]])


def expected_measurement(
    state: np.ndarray, speed: float, heading: float, duration: complex = 1e-40j
) -> np.ndarray:
    """Eq. (24) from positions: the Doppler by complex step of the distance over time."""
    theta, d, v = np.moveaxis(state, -1, 0)
    x = d * np.cos(theta) + (v - speed * np.cos(heading)) * duration
    depth = d * np.sin(theta) + speed * np.sin(heading) * duration
    range_rate = np.sqrt(x * x + depth * depth).imag / duration.imag
    return np.stack([theta, 2 * d / C, -2 * CARRIER / C * range_rate], axis=-1)


@pytest.mark.parametrize("heading", [DOWN, np.pi, 0.4])
def test_delay_and_doppler_are_those_of_a_moving_distance(heading: float) -> None:
    result = predict_measurement(STATES, 15.0, heading, CARRIER)
    expected = expected_measurement(STATES, 15.0, heading)
    np.testing.assert_allclose(result, expected, rtol=1e-12, atol=1e-9)


def test_doppler_is_positive_when_the_object_approaches() -> None:
    ahead_and_coming = np.array([0.5, 100.0, -30.0])
    assert predict_measurement(ahead_and_coming, 0.0, 0.0, CARRIER)[2] > 0


@pytest.mark.parametrize("heading", [DOWN, np.pi, 0.4])
def test_jacobian_agrees_with_complex_steps(heading: float) -> None:
    step, derivative = 1e-30, np.empty((3, 3, 3))
    for j in range(3):
        theta, d, v = np.moveaxis(STATES + 1j * step * np.eye(3)[j], -1, 0)
        closing = 15.0 * np.cos(theta + heading) - v * np.cos(theta)
        value = np.stack([theta, 2 * d / C, 2 * CARRIER / C * closing], axis=-1)
        derivative[..., j] = value.imag / step
    jacobian = measurement_jacobian(STATES, 15.0, heading, CARRIER)
    np.testing.assert_allclose(jacobian, derivative, rtol=1e-13, atol=1e-13)


def test_jacobian_at_ninety_degrees_says_nothing_of_the_velocity() -> None:
    jacobian = measurement_jacobian(STATES[2], 15.0, DOWN, CARRIER)
    assert abs(jacobian[2, 2]) < 1e-10 * abs(jacobian[2, 0])


def test_innovation_is_measured_minus_expected_with_the_angle_wrapped() -> None:
    uav = flying(15.0, DOWN)
    expected = predict_measurement(STATES, uav.speed, uav.heading, CARRIER)
    offset = np.array([0.1, 1e-9, 50.0])
    value = expected + offset + np.array([2 * np.pi, 0.0, 0.0])
    model = PolarMeasurement(CARRIER)
    result = model.residual(value, model.expected(STATES, uav))
    np.testing.assert_allclose(result, np.broadcast_to(offset, (3, 3)), rtol=1e-6)


def test_innovation_of_what_was_not_measured_is_nan() -> None:
    value = np.full((3, 3), np.nan)
    model = PolarMeasurement(CARRIER)
    assert np.isnan(model.residual(value, model.expected(STATES, flying(15.0, DOWN)))).all()
