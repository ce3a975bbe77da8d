"""The extended Kalman filter's models on the ground, and its first state."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.plane import GROUND_GEOMETRY, GroundGeometry, facing
from echobeam.tracking.ground import GroundMeasurement, GroundMotion
from echobeam.tracking.plane import PlaneMeasurement
from echobeam.tracking.plane_start import first_state
from echobeam.units import SPEED_OF_LIGHT
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
    motion = GroundMotion(0.01, 0.5, 2, known_height=True)
    longer = GroundMotion(0.01, 0.5, 2)
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


LINES = [(1.0, 0.0, 0.0), (0.6, -0.8, 0.0), (0.0, 0.48, -0.8773), (0.0, 0.0, -1.0)]
"""Directions of linear arrays: level ones, a tilted one, the vertical one."""


@pytest.mark.parametrize("along", LINES)
def test_one_cosine_gives_one_of_the_places_that_it_cannot_tell_apart(along):
    """Of mirrored places, or of a ring, one that has the object's cosine and distance.

    Errors of both have the belief's variance within five standard errors, and are none above those
    of the measurement, since the height tells as well.
    """
    rng = np.random.default_rng(7)
    geometry = GroundGeometry(along_rows=along, normal=None)
    model = PlaneMeasurement(geometry, CARRIER)
    uav = UavState(np.array([5.0, -3.0, 100.0]), np.zeros(3))
    truth = np.tile([45.0, 47.0, 0.0, 0.0], (200, 1))
    std = np.array([0.02, np.inf, 2.0 / SPEED_OF_LIGHT, 1e6])
    exact = model.expected(truth, uav)
    value = exact + np.where(np.isfinite(std), std, 0.0) * rng.normal(size=truth.shape)
    value[:, 1] = np.nan
    found = first_state(value, np.broadcast_to(std**2, value.shape), model, uav, 30.0)
    assert found.known.all()
    pick = [0, 2]
    error = (model.expected(found.mean, uav) - exact)[:, pick]
    H = model.jacobian(found.mean, uav)[:, pick, :2]
    cov = H @ found.cov[:, :2, :2] @ np.swapaxes(H, -1, -2)
    square = error**2 / np.diagonal(cov, axis1=-2, axis2=-1)
    np.testing.assert_allclose(square.mean(axis=0), 1.0, atol=5 * np.sqrt(2.0 / len(square)))
    assert (np.sqrt(np.square(error).mean(axis=0)) < 1.1 * std[pick]).all()


AHEAD = facing((1.0, 0.0, 0.0))
"""Geometry of an array in a vertical plane: there no measured cosine tells how far ahead it is."""


def in_front(cosines, distance, std, draws, rng):
    """Return mean and covariance of the position, of draws weighted by their likelihoods.

    Draws are uniform over the ground that the array `AHEAD` sees at such a distance.
    """
    spread = 6.0 * std[2]
    d = np.sqrt(rng.uniform((distance - spread) ** 2, (distance + spread) ** 2, draws))
    across = np.sqrt(np.maximum(d**2 - UAV.position[2] ** 2, 0.0))
    angle = rng.uniform(-0.5 * np.pi, 0.5 * np.pi, draws)
    place = np.stack([across * np.cos(angle), across * np.sin(angle)], axis=-1)
    seen = np.stack([-UAV.position[2] / d, place[:, 1] / d, d], axis=-1)
    log = -0.5 * np.square((seen - [*cosines, distance]) / std).sum(axis=-1)
    weight = np.exp(log - log.max()) * (d > UAV.position[2])
    mean = np.average(place, axis=0, weights=weight)
    return mean + UAV.position[:2], np.cov(place.T, aweights=weight, ddof=0)


@pytest.mark.parametrize("cosines", [(-0.99, 0.3), (-0.95, -0.36), (-0.9, 0.25)])
def test_a_first_state_near_the_arrays_plane_is_the_posterior_in_front_of_it(cosines):
    """Beyond the visible region, at its edge and just inside, against importance sampling."""
    distance, std = 105.0, np.array([0.05, 0.05, 0.5])
    value = np.array([[*cosines, 2.0 * distance / SPEED_OF_LIGHT, 0.0]])
    variance = np.array([[*std[:2] ** 2, (2.0 * std[2] / SPEED_OF_LIGHT) ** 2, 1e12]])
    found = first_state(value, variance, PlaneMeasurement(AHEAD, CARRIER), UAV, 30.0)
    mean, cov = in_front(cosines, distance, std, 400_000, np.random.default_rng(4))
    scale = np.sqrt(cov.diagonal())
    np.testing.assert_allclose((found.mean[0, :2] - mean) / scale, 0.0, atol=0.05)
    # Gaussians as wide as the ring of a delay bends: the variance ahead is up to a fifth too large
    ratio = (found.cov[0, :2, :2] - cov) / np.outer(scale, scale)
    np.testing.assert_allclose(ratio, 0.0, atol=0.2)


@pytest.mark.slow
def test_no_first_state_of_an_object_ahead_is_stuck_or_behind_the_array():
    """Places uniform over the ground near the array's plane, as the posterior takes them to be.

    By the right moments the mean of the squared errors is 2, by a variance that is a fifth too
    large 1.7; within five standard errors.
    """
    rng = np.random.default_rng(5)
    truth = np.zeros((1000, 4))
    truth[:, 0] = UAV.position[0] + rng.uniform(0.0, 60.0, 1000)
    truth[:, 1] = UAV.position[1] + rng.uniform(-60.0, 60.0, 1000)
    std = np.array([0.05, 0.05, 2.0 * 0.5 / SPEED_OF_LIGHT, 1e6])
    model = PlaneMeasurement(AHEAD, CARRIER)
    value = model.expected(truth, UAV) + std * rng.normal(size=truth.shape)
    beyond = np.square(value[:, :2]).sum(axis=-1) > 1.0
    found = first_state(value, np.broadcast_to(std**2, value.shape), model, UAV, 30.0)
    assert found.known.all()
    assert (found.mean[:, 0] > UAV.position[0]).all()
    assert found.cov[:, 0, 0].max() < 15.0**2
    inner = beyond & (np.hypot(*(truth[:, :2] - UAV.position[:2]).T) < 50.0)
    error = (found.mean - truth)[inner, :2]
    square = np.einsum("ti,tij,tj->t", error, np.linalg.inv(found.cov[inner, :2, :2]), error)
    standard_error = np.sqrt(4.0 / square.size)
    assert 2.0 / 1.2 - 5 * standard_error < square.mean() < 2.0 + 5 * standard_error


def test_accurate_delays_of_objects_abreast_are_no_singular_matrices():
    """To 2 mm: what the cosines tell along the array's plane is lost in rounding beside it."""
    model = PlaneMeasurement(facing((-0.845, 0.535, 0.0)), CARRIER)
    rng = np.random.default_rng(6)
    across = rng.uniform(100.0, 700.0, 300) * np.where(np.arange(300) % 2, 1.0, -1.0)
    truth = np.column_stack([*(across * np.array([[0.535], [0.845]])), np.zeros((300, 2))])
    truth[:, :2] += UAV.position[:2]
    std = np.array([0.002, 0.002, 1e-11, 300.0])
    value = model.expected(truth, UAV) + std * rng.normal(size=truth.shape)
    found = first_state(value, np.broadcast_to(std**2, value.shape), model, UAV, 30.0)
    assert found.known.all()
    assert (np.linalg.eigvalsh(found.cov) > 0.0).all()
