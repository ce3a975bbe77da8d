"""Models on the road: motion against the exact evolution, covariances against draws, one filter.

The statistical test draws truth and measurements from the filter's own models, with a fixed seed.
"""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.estimation.consistency import chi_square_band, nees
from echobeam.estimation.gaussian import square_norm
from echobeam.tracking.filter import predict, update
from echobeam.tracking.polar import PolarMotion
from echobeam.values import GaussianState, UavState

from ..forms import flying
from ..road import ROAD, RoadMeasurement, RoadMotion, polar_mean, to_polar

C = 299_792_458.0
CARRIER = 30e9
DURATION = 0.05
NOISE = np.array([0.02, 1e-9, 2e3])


def uav_at(slot: int, heading: float = -2.5, speed: float = 15.0) -> UavState:
    velocity = flying(speed, heading).velocity
    return UavState(np.array([-20.0, 0.0, 100.0]) + slot * DURATION * velocity, velocity)


def beliefs(rng: np.random.Generator, shape: tuple[int, ...]) -> GaussianState:
    """Objects on either side of the UAV, with correlated errors."""
    root = rng.normal(size=(*shape, 2, 3)) * np.array([2.0, 5.0])[:, None]
    mean = rng.uniform([-200.0, -40.0], [200.0, 40.0], (*shape, 2))
    return GaussianState(mean, root @ np.swapaxes(root, -1, -2), np.ones(shape, dtype=bool))


@pytest.mark.parametrize("heading", [-np.pi / 2, 0.0, 0.3, -2.5])
def test_road_motion_seen_from_the_uav_is_the_exact_evolution(heading: float) -> None:
    state = beliefs(np.random.default_rng(1), (50,)).mean
    now, later = uav_at(0, heading), uav_at(1, heading)
    moved = polar_mean(RoadMotion(DURATION, 0.0, 0.0).step(state, now), later)
    exact = PolarMotion(DURATION, 0.0, 0.0, 0.0, "exact").step(polar_mean(state, now), now)
    np.testing.assert_allclose(moved, exact, rtol=1e-11)


def test_predictions_on_the_road_and_in_polar_coordinates_agree_to_first_order() -> None:
    """Without process noise both propagate one covariance, through different Jacobians."""
    state = beliefs(np.random.default_rng(2), (50,))
    now, later = uav_at(0), uav_at(1)
    road = to_polar(predict(state, RoadMotion(DURATION, 0.0, 0.0), now), later)
    polar = predict(to_polar(state, now), PolarMotion(DURATION, 0.0, 0.0, 0.0, "exact"), now)
    std = np.sqrt(np.diagonal(polar.cov, axis1=-2, axis2=-1))
    unit = std[..., :, None] * std[..., None, :]
    np.testing.assert_allclose(road.cov / unit, polar.cov / unit, atol=1e-9)


def test_covariance_in_polar_coordinates_is_that_of_small_errors() -> None:
    """Against a million draws of a narrow belief: covariances are exact to 0.5 %."""
    rng = np.random.default_rng(3)
    mean, cov = np.array([60.0, 20.0]), np.array([[0.04, 0.03], [0.03, 0.09]])
    belief = to_polar(GaussianState(mean, cov, np.array(True)), uav_at(0))
    draws = polar_mean(rng.multivariate_normal(mean, cov, 1_000_000), uav_at(0))
    std = np.sqrt(np.diag(belief.cov))
    unit = np.outer(std, std)
    np.testing.assert_allclose(np.cov(draws.T) / unit, belief.cov / unit, atol=5e-3)
    np.testing.assert_array_equal(belief.cov, belief.cov.T)


def test_covariance_in_polar_coordinates_is_of_rank_two_and_has_no_density() -> None:
    state = beliefs(np.random.default_rng(4), (200,))
    polar = to_polar(state, uav_at(0))
    std = np.sqrt(np.diagonal(polar.cov, axis1=-2, axis2=-1))
    values = np.linalg.eigvalsh(polar.cov / (std[..., :, None] * std[..., None, :]))
    assert np.abs(values[:, 0]).max() < 1e-12
    assert values[:, 1].min() > 1e-6
    assert np.isnan(square_norm(np.zeros((200, 3)), polar.cov)).all()


def test_unknown_objects_stay_unknown_and_a_uav_on_the_ground_sees_none() -> None:
    state = beliefs(np.random.default_rng(5), (3,))
    mean, cov = state.mean.copy(), state.cov.copy()
    mean[1], cov[1] = np.nan, np.nan
    part = GaussianState(mean, cov, np.array([True, False, True]))
    polar = to_polar(part, uav_at(0))
    np.testing.assert_array_equal(polar.known, part.known)
    np.testing.assert_array_equal(polar.mean[0], to_polar(state, uav_at(0)).mean[0])
    assert np.isnan(polar.cov[1]).all()
    grounded = UavState(np.zeros(3), np.zeros(3))
    assert not to_polar(part, grounded).known.any()
    nobody = GaussianState(np.empty((4, 0, 2)), np.empty((4, 0, 2, 2)), np.empty((4, 0), bool))
    assert to_polar(nobody, uav_at(0)).cov.shape == (4, 0, 3, 3)


def test_the_filter_of_the_papers_state_runs_on_the_road_and_states_its_errors() -> None:
    """NEES of 3,000 independent tracks after eight slots: a false alarm in 0.1 %."""
    rng = np.random.default_rng(6)
    motion, radar = RoadMotion(DURATION, 0.05, 0.5), RoadMeasurement(CARRIER)
    truth = np.broadcast_to(np.array([90.0, 20.0]), (3000, 1, 2))
    cov = np.diag([0.5**2, 5.0**2])
    state = GaussianState(
        truth + [0.5, 5.0] * rng.normal(size=truth.shape),
        np.broadcast_to(cov, (3000, 1, 2, 2)),
        np.ones((3000, 1), dtype=bool),
    )
    for slot in range(1, 9):
        truth = motion.step(truth, uav_at(slot - 1)) + [0.05, 0.5] * rng.normal(size=truth.shape)
        prior = predict(state, motion, uav_at(slot - 1))
        value = radar.expected(truth, uav_at(slot)) + NOISE * rng.normal(size=(3000, 1, 3))
        variance = np.broadcast_to(NOISE**2, value.shape)
        state = update(prior, value, variance, radar, uav_at(slot), ROAD).state
    low, high = chi_square_band(2, 3000, 0.999)
    assert low < nees(state.mean - truth, state.cov, ROAD.angles).mean() < high
    x, height = state.mean[..., 0] - uav_at(8).position[0], uav_at(8).position[2]
    by_delay = 0.5 * C * NOISE[1] * np.hypot(x, height) / x  # dx = dd / cos(theta)
    assert np.all(np.sqrt(state.cov[..., 0, 0]) < by_delay)  # never worse than the last delay alone


def test_with_the_height_known_the_delay_determines_the_angle() -> None:
    """One update of a vague belief: the posterior angle's standard deviation."""
    uav = uav_at(0)
    state = GaussianState(
        np.array([[80.0, 20.0]]), np.diag([10.0**2, 5.0**2])[None], np.array([True])
    )
    radar = RoadMeasurement(CARRIER)
    value = radar.expected(state.mean, uav)
    found = update(state, value, np.square([NOISE]), radar, uav, ROAD)
    theta, d, _ = polar_mean(state.mean, uav)[0]
    by_delay = 0.5 * C * NOISE[1] * np.tan(theta) / d  # d = h / sin(theta)
    angle_std = np.sqrt(to_polar(found.state, uav).cov[0, 0, 0])
    assert angle_std == pytest.approx(by_delay, rel=0.01)
