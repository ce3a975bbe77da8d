"""The extended Kalman filter's models on the ground, and its first state."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.plane import GROUND_GEOMETRY, facing
from echobeam.tracking.ground import GroundMeasurement, GroundMotion
from echobeam.tracking.plane import PlaneMeasurement, PlaneMotion
from echobeam.tracking.plane_start import first_state
from echobeam.values import UavState

UAV = UavState(np.array([5.0, -3.0, 100.0]), np.array([4.0, 2.0, -6.0]))
STATES = np.array([[45.0, 27.0, 20.0, 5.0], [85.0, -63.0, -4.0, 11.0], [5.0, -3.0, 1.0, 0.0]])
CARRIER = 30e9


@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (3.0, 4.0, -5.0)])
def test_the_jacobian_is_the_derivative(direction):
    model, step = PlaneMeasurement(facing(direction), CARRIER), 1e-5
    H = model.jacobian(STATES, UAV)
    for column in range(4):
        off = np.zeros(4)
        off[column] = step
        slope = (model.expected(STATES + off, UAV) - model.expected(STATES - off, UAV)) / (2 * step)
        scale = np.abs(H).max(axis=(0, 2))
        np.testing.assert_allclose(H[..., column] / scale, slope / scale, atol=1e-7)


def test_models_are_those_of_the_ground_tracker_at_a_known_height():
    with_height = np.column_stack([STATES, np.zeros(3)])
    other, model = GroundMeasurement(CARRIER, 2), PlaneMeasurement(GROUND_GEOMETRY, CARRIER)
    np.testing.assert_allclose(model.expected(STATES, UAV), other.expected(with_height, UAV))
    np.testing.assert_allclose(
        model.jacobian(STATES, UAV), other.jacobian(with_height, UAV)[..., :4], atol=1e-12
    )
    motion, longer = PlaneMotion(0.01, 0.5), GroundMotion(0.01, 0.5, 2)
    np.testing.assert_allclose(motion.step(STATES, UAV), longer.step(with_height, UAV)[..., :4])
    np.testing.assert_allclose(motion.noise(), longer.noise()[:4, :4])
    np.testing.assert_array_equal(
        motion.jacobian(STATES, UAV), longer.jacobian(with_height, UAV)[..., :4, :4]
    )


def test_a_first_state_is_consistent_and_uses_the_known_height():
    """Errors of the position over their covariance: chi-square of 2, mean within 5 sigma."""
    rng = np.random.default_rng(3)
    truth = np.tile(STATES[:2], (2000, 1, 1))
    truth[..., 2:] = rng.normal(size=(2000, 2, 2)) * 20.0
    std = np.array([0.01, 0.01, 2e-9, 300.0])
    model = PlaneMeasurement(GROUND_GEOMETRY, CARRIER)
    value = model.expected(truth, UAV) + std * rng.normal(size=truth.shape)
    found = first_state(value, np.broadcast_to(std**2, value.shape), model, UAV, 20.0)
    assert found.known.all()
    error = found.mean - truth
    nees = np.einsum("tki,tkij,tkj->tk", error, np.linalg.inv(found.cov), error)
    assert nees.mean() == pytest.approx(4.0, abs=5 * np.sqrt(8.0 / nees.size))
    square = found.cov[..., :2, :2].diagonal(axis1=-2, axis2=-1).sum(axis=-1)[:, 0].mean()
    from_cosines = np.linalg.inv(model.jacobian(STATES[0], UAV)[:2, :2])
    assert square < 0.7 * np.trace(from_cosines @ from_cosines.T) * 0.01**2


def test_what_was_not_measured_is_unknown_and_noise_beyond_the_horizon_is_no_fault():
    model = PlaneMeasurement(GROUND_GEOMETRY, CARRIER)
    value = np.array([[0.9, 0.9, 1e-6, 0.0], [np.nan] * 4, [0.1, 0.1, -1e-9, 0.0]])
    variance = np.where(np.isnan(value), np.inf, [1e-2, 1e-2, 1e-18, 1e4])
    found = first_state(value, variance, model, UAV, 30.0)
    np.testing.assert_array_equal(found.known, [True, False, False])
    assert np.isfinite(found.mean[0]).all()
    assert np.isnan(found.mean[1:]).all()


def test_cosines_that_say_nothing_are_no_direction():
    model = PlaneMeasurement(GROUND_GEOMETRY, CARRIER)
    value = model.expected(STATES, UAV)
    variance = np.array([[1e30, 1e30, 1e-18, 1e2], [1e-4, 1e30, 1e-18, 1e2], [1e-4] * 4])
    found = first_state(value, variance, model, UAV, 30.0)
    np.testing.assert_array_equal(found.known, [False, True, True])
    assert np.isfinite(found.cov[1:]).all()


def test_one_cosine_leaves_the_other_axis_open():
    model = PlaneMeasurement(GROUND_GEOMETRY, CARRIER)
    uav = UavState(np.array([0.0, 0.0, 100.0]), np.zeros(3))
    truth = np.array([[60.0, 0.0, 10.0, 0.0]])
    value = model.expected(truth, uav)
    value[0, 1] = np.nan
    variance = np.array([[1e-4, np.inf, 1e-20, 1e2]])
    found = first_state(value, variance, model, uav, 30.0)
    np.testing.assert_allclose(found.mean[0, :2], [60.0, 0.0], atol=1e-3)
    assert found.cov[0, 1, 1] == pytest.approx(60.0**2, rel=1e-6)
