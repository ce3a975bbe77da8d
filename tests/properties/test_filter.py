"""Laws of the filter that hold for every belief, motion and measurement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.estimation.gaussian import propagate, update, wrap
from echobeam.tracking.evolution import Evolution, evolve
from echobeam.tracking.measurement import predict_measurement
from echobeam.values import GaussianState, UavState

from .. import forms
from ..forms import Echo, flying, initial_state

CARRIER = 30e9
seeds = st.integers(0, 2**32 - 1)
kinds = st.sampled_from(["paper", "exact"])
motions = st.builds(flying, st.floats(0.0, 40.0), st.floats(-np.pi, np.pi))
magnitudes = st.tuples(st.floats(-3, 0), st.floats(-1, 1), st.floats(-1, 4))


def beliefs(rng: np.random.Generator, shape: tuple[int, ...], std: np.ndarray) -> GaussianState:
    """Objects somewhere below the UAV, with correlated errors of the given sizes."""
    low, high = np.array([0.3, 50.0, -40.0]), np.array([2.8, 200.0, 40.0])
    root = rng.normal(size=(*shape, 3, 4))
    cov = root @ np.swapaxes(root, -1, -2) * np.outer(std, std)
    cov = 0.5 * (cov + np.swapaxes(cov, -1, -2))
    return GaussianState(rng.uniform(low, high, (*shape, 3)), cov, np.ones(shape, dtype=bool))


def echoes(rng: np.random.Generator, mean: np.ndarray, uav: UavState) -> Echo:
    """Noisy echoes; a third of all components are missing."""
    std = 10.0 ** rng.uniform([-4, -11, 1], [-1, -8, 5], mean.shape)
    value = predict_measurement(mean, uav.speed, uav.heading, CARRIER)
    value = value + std * rng.normal(size=mean.shape)
    missing = rng.uniform(size=mean.shape) < 1 / 3
    value[missing], std[missing] = np.nan, np.inf
    return Echo(value, std**2)


def normalised(cov: np.ndarray, std: np.ndarray) -> np.ndarray:
    return cov / (std[..., :, None] * std[..., None, :])


@given(seeds, magnitudes, kinds, motions)
@pytest.mark.slow
def test_no_number_depends_on_how_many_share_the_block(
    seed: int, magnitude: tuple[float, ...], kind: Evolution, uav: UavState
) -> None:
    rng = np.random.default_rng(seed)
    state = beliefs(rng, (7, 3), 10.0 ** np.array(magnitude))
    radar = echoes(rng, state.mean, uav)
    noise = np.array([1e-3, 0.2, 0.5])

    def slot(part: tuple[slice, ...]) -> list[np.ndarray]:
        belief = GaussianState(state.mean[part], state.cov[part], state.known[part])
        echo = Echo(radar.value[part], radar.variance[part])
        first = initial_state(echo, uav, CARRIER)
        prior = forms.predict(belief, uav, 0.01, noise, kind)
        posterior = forms.update(prior, echo, uav, CARRIER)
        return [getattr(s, n) for s in (first, prior, posterior) for n in ("mean", "cov", "known")]

    whole = slot((slice(None), slice(None)))
    for trials, objects in ((slice(0, 1), slice(None)), (slice(2, 7), slice(1, 2))):
        part = (trials, objects)
        for all_of_it, piece in zip(whole, slot(part), strict=True):
            np.testing.assert_array_equal(piece, all_of_it[part])


@given(seeds, magnitudes, motions)
def test_an_update_never_makes_anything_less_certain(
    seed: int, magnitude: tuple[float, ...], uav: UavState
) -> None:
    rng = np.random.default_rng(seed)
    prior = beliefs(rng, (6, 2), 10.0 ** np.array(magnitude))
    radar = echoes(rng, prior.mean, uav)
    posterior = forms.update(prior, radar, uav, CARRIER)
    std = np.sqrt(np.diagonal(prior.cov, axis1=-2, axis2=-1))
    gained = normalised(prior.cov - posterior.cov, std)[posterior.known]
    assert np.all(np.linalg.eigvalsh(gained) > -1e-12)
    left = normalised(posterior.cov, std)[posterior.known]
    assert np.all(np.linalg.eigvalsh(left) > -1e-15)
    assert np.array_equal(left, np.swapaxes(left, -1, -2))


@given(seeds, magnitudes, motions)
def test_components_may_be_used_in_any_order_or_at_once(
    seed: int, magnitude: tuple[float, ...], uav: UavState
) -> None:
    rng = np.random.default_rng(seed)
    state = beliefs(rng, (4,), 10.0 ** np.array(magnitude))
    H, variance = rng.normal(size=(4, 3, 3)), 10.0 ** rng.uniform(-2, 2, (4, 3))
    H /= np.sqrt(np.diagonal(state.cov, axis1=-2, axis2=-1))[..., None, :]
    innovation = np.sqrt(variance) * rng.normal(size=(4, 3))
    mean, cov = update(state.mean, state.cov, innovation, H, variance)
    order = rng.permutation(3)
    parts = innovation[:, order], H[:, order], variance[:, order]
    other_mean, other_cov = update(state.mean, state.cov, *parts)
    std = np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
    np.testing.assert_allclose(other_mean / std, mean / std, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(normalised(other_cov, std), normalised(cov, std), atol=1e-9)


@given(seeds, motions)
def test_an_exact_step_and_its_reverse_lead_back(seed: int, uav: UavState) -> None:
    state = beliefs(np.random.default_rng(seed), (20,), np.ones(3)).mean
    there = evolve(state, uav.speed, uav.heading, 0.05, "exact")
    there[..., 2] *= -1.0
    back = evolve(there, uav.speed, uav.heading + np.pi, 0.05, "exact")
    np.testing.assert_allclose(back * [1.0, 1.0, -1.0], state, rtol=1e-12)


@given(seeds, motions)
def test_exact_evolution_composes(seed: int, uav: UavState) -> None:
    state = beliefs(np.random.default_rng(seed), (20,), np.ones(3)).mean
    motion = uav.speed, uav.heading
    halves = evolve(evolve(state, *motion, 0.02, "exact"), *motion, 0.03, "exact")
    np.testing.assert_allclose(halves, evolve(state, *motion, 0.05, "exact"), rtol=1e-12)


@given(seeds, magnitudes)
def test_propagated_covariances_stay_symmetric_and_positive(
    seed: int, magnitude: tuple[float, ...]
) -> None:
    rng = np.random.default_rng(seed)
    state = beliefs(rng, (5, 2), 10.0 ** np.array(magnitude))
    result = propagate(state.cov, rng.normal(size=(5, 2, 3, 3)), np.diag([0.1, 0.0, 2.0]))
    assert np.array_equal(result, np.swapaxes(result, -1, -2))
    std = np.sqrt(np.diagonal(result, axis1=-2, axis2=-1))
    assert np.all(np.linalg.eigvalsh(normalised(result, std)) > -1e-12)


@given(st.floats(-1e4, 1e4))
def test_wrap_is_the_same_direction_within_one_turn(angle: float) -> None:
    wrapped = wrap(np.array([angle]))[0]
    assert -np.pi - 1e-11 < wrapped <= np.pi + 1e-11
    assert abs(np.exp(1j * wrapped) - np.exp(1j * angle)) < 1e-11


@settings(max_examples=50)
@given(st.floats(0.05, np.pi - 0.05), st.floats(5.0, 500.0), st.floats(-50.0, 50.0), motions)
def test_a_first_measurement_without_error_is_inverted(
    theta: float, d: float, v: float, uav: UavState
) -> None:
    truth = np.array([theta, d, v])
    value = predict_measurement(truth, uav.speed, uav.heading, CARRIER)
    state = initial_state(Echo(value, np.array([1e-6, 1e-20, 1.0])), uav, CARRIER)
    assert state.known
    np.testing.assert_allclose(state.mean[:2], truth[:2], rtol=1e-14)
    if np.sqrt(state.cov[2, 2]) < 1e3:
        assert abs(state.mean[2] - v) < 1e-9 * (abs(v) + uav.speed + 1) / abs(np.cos(theta))
