"""The filter's edges: unknown, unmeasured and lost objects, none at all, and forecasts."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.tracking.evolution import Evolution, evolution_jacobian, evolve
from echobeam.tracking.measurement import measurement_jacobian, predict_measurement
from echobeam.values import GaussianState, UavState

from ..forms import Echo, flying, predict, update

CARRIER = 30e9
UAV = flying(15.0, -np.pi / 2)
PROCESS_STD = np.array([3.5e-4, 0.2, 0.5])
NOISE_STD = np.array([0.011, 1.9e-9, 1.5e4])
KINDS: list[Evolution] = ["paper", "exact"]


def belief(*means: list[float]) -> GaussianState:
    mean = np.array(means)
    std = np.array([0.06, 1.55, 828.0])
    correlation = np.array([[1.0, 0.1, -0.3], [0.1, 1.0, 0.2], [-0.3, 0.2, 1.0]])
    cov = np.broadcast_to(correlation * np.outer(std, std), (*mean.shape, 3)).copy()
    return GaussianState(mean, cov, np.isfinite(mean[..., 0]))


def echo_of(mean: np.ndarray) -> Echo:
    value = predict_measurement(mean, UAV.speed, UAV.heading, CARRIER) + 0.8 * NOISE_STD
    return Echo(value, np.broadcast_to(NOISE_STD**2, value.shape).copy())


def altered(radar: Echo, where: tuple[int, ...], value: float, std: float) -> Echo:
    """The same echoes with one entry replaced."""
    values, variances = radar.value.copy(), radar.variance.copy()
    values[where], variances[where] = value, std**2
    return Echo(values, variances)


NEAR, FAR, UNKNOWN = [1.3, 103.5, 30.0], [2.36, 141.4, -3.0], [np.nan] * 3


@pytest.mark.parametrize("kind", KINDS)
def test_one_slot_is_the_papers_equations(kind: Evolution) -> None:
    state = belief(NEAR, FAR)
    motion = UAV.speed, UAV.heading, 0.01, kind
    prior = predict(state, UAV, 0.01, PROCESS_STD, kind)
    G = evolution_jacobian(state.mean, *motion)
    cov = G @ state.cov @ np.swapaxes(G, -1, -2) + np.diag(PROCESS_STD**2)
    np.testing.assert_allclose(prior.mean, evolve(state.mean, *motion), rtol=1e-15)
    np.testing.assert_allclose(prior.cov, cov, rtol=1e-9)
    radar = echo_of(state.mean)
    posterior = update(prior, radar, UAV, CARRIER)
    H = measurement_jacobian(prior.mean, UAV.speed, UAV.heading, CARRIER)
    Ht = np.swapaxes(H, -1, -2)
    K = cov @ Ht @ np.linalg.inv(H @ cov @ Ht + radar.variance[..., None] * np.eye(3))
    expected = predict_measurement(prior.mean, UAV.speed, UAV.heading, CARRIER)
    mean = prior.mean + (K @ (radar.value - expected)[..., None])[..., 0]
    np.testing.assert_allclose(posterior.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(posterior.cov, (np.eye(3) - K @ H) @ cov, rtol=1e-9)


def test_an_object_that_was_not_measured_keeps_its_prior_in_every_bit() -> None:
    prior = predict(belief(NEAR, FAR), UAV, 0.01, PROCESS_STD)
    radar = altered(echo_of(prior.mean), (1,), np.nan, np.inf)
    posterior = update(prior, radar, UAV, CARRIER)
    assert np.array_equal(posterior.mean[1], prior.mean[1])
    assert np.array_equal(posterior.cov[1], prior.cov[1])
    assert np.all(np.diagonal(posterior.cov[0]) < np.diagonal(prior.cov[0]))


def test_unknown_objects_stay_unknown_and_spoil_no_others() -> None:
    alone, both = belief(NEAR), belief(NEAR, UNKNOWN)
    for _ in range(2):
        alone, both = (predict(state, UAV, 0.01, PROCESS_STD) for state in (alone, both))
        radar = echo_of(np.array([NEAR, FAR]))  # an echo alone does not start a track
        both = update(both, radar, UAV, CARRIER)
        alone = update(alone, Echo(radar.value[:1], radar.variance[:1]), UAV, CARRIER)
    np.testing.assert_array_equal(both.known, [True, False])
    np.testing.assert_array_equal(both.mean[:1], alone.mean)
    np.testing.assert_array_equal(both.cov[:1], alone.cov)
    assert np.isnan(both.mean[1]).all()
    assert np.isnan(both.cov[1]).all()


def test_an_object_marked_unknown_is_unknown_whatever_its_numbers() -> None:
    state = belief(NEAR, FAR)
    state = GaussianState(state.mean, state.cov, np.array([True, False]))
    prior = predict(state, UAV, 0.01, PROCESS_STD)
    posterior = update(state, echo_of(state.mean), UAV, CARRIER)
    for result in (prior, posterior):
        np.testing.assert_array_equal(result.known, [True, False])
        assert np.isnan(result.mean[1]).all()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("mean", "uav"),
    [
        ([0.001, 100.0, 0.0], flying(200.0, -np.pi / 2)),  # the UAV would go below the road
        ([np.pi / 2, 1.0, 0.0], flying(100.0, -np.pi / 2)),  # d + p = 0
        ([1.0, 1.0, -1e308], flying(15.0, 0.0)),
    ],
)
def test_a_track_that_becomes_impossible_is_given_up(
    kind: Evolution, mean: list[float], uav: UavState
) -> None:
    prior = predict(belief(mean, FAR), uav, 0.01, PROCESS_STD, kind)
    np.testing.assert_array_equal(prior.known, [False, True])
    assert np.isnan(prior.mean[0]).all()
    assert np.isnan(prior.cov[0]).all()


def test_an_update_out_of_the_half_plane_ends_the_track() -> None:
    prior = belief([0.05, 100.0, 0.0], NEAR)
    radar = altered(echo_of(prior.mean), (0, 0), -1.0, NOISE_STD[0])
    posterior = update(prior, radar, UAV, CARRIER)
    np.testing.assert_array_equal(posterior.known, [False, True])


def test_a_measured_angle_beyond_the_wrap_pulls_the_short_way() -> None:
    prior = belief([3.1, 100.0, 0.0])
    # 53 mrad beyond the prior, not 6.2 rad below
    radar = altered(echo_of(prior.mean), (0, 0), -3.13, NOISE_STD[0])
    assert not update(prior, radar, UAV, CARRIER).known[0]


def test_inputs_are_left_alone() -> None:
    state = belief(NEAR, [0.001, 100.0, 0.0])
    for array in (state.mean, state.cov, state.known):
        array.setflags(write=False)
    radar = echo_of(np.array([NEAR, FAR]))
    for array in (radar.value, radar.variance):
        array.setflags(write=False)
    update(predict(state, flying(200.0, -np.pi / 2), 0.01, PROCESS_STD), radar, UAV, CARRIER)
    assert state.mean[1, 0] == 0.001


def test_no_objects_are_no_trouble() -> None:
    nobody = GaussianState(np.empty((4, 0, 3)), np.empty((4, 0, 3, 3)), np.empty((4, 0), bool))
    nothing = Echo(np.empty((4, 0, 3)), np.empty((4, 0, 3)))
    state = update(predict(nobody, UAV, 0.01, PROCESS_STD), nothing, UAV, CARRIER)
    assert state.mean.shape == (4, 0, 3)
    assert state.cov.shape == (4, 0, 3, 3)
