"""Interacting models and motions with an acceleration: closed forms, enumeration, draws."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.stats import multivariate_normal

from echobeam.tracking.ground import GroundMotion
from echobeam.tracking.ground_acceleration import AcceleratedMotion, UnacceleratedMotion
from echobeam.tracking.interacting import combined, interacted, mixing, reweighted
from echobeam.values import UavState

UAV = UavState(np.array([0.0, 0.0, 100.0]), np.zeros(3))
T = 0.2
RNG = np.random.default_rng(5)
CHAIN = np.array([[0.9, 0.1], [0.3, 0.7]])


def beliefs(models=2, size=3):
    root = RNG.standard_normal((models, size, size))
    return RNG.standard_normal((models, size)), root @ np.swapaxes(root, -1, -2)


def test_a_mixture_has_the_moments_of_draws():
    mean, cov = beliefs()
    weight = np.array([0.3, 0.7])
    chosen = np.random.default_rng(1).random(400_000) < weight[0]
    parts = [
        np.random.default_rng(2 + j).multivariate_normal(mean[j], cov[j], 400_000) for j in (0, 1)
    ]
    draws = np.where(chosen[:, None], *parts)
    found_mean, found_cov = combined(weight, mean, cov)
    scale = draws.std(axis=0)
    np.testing.assert_allclose((found_mean - draws.mean(axis=0)) / scale, 0.0, atol=8e-3)
    off = (found_cov - np.cov(draws.T)) / np.outer(scale, scale)
    np.testing.assert_allclose(off, 0.0, atol=1.5e-2)


def test_probabilities_are_those_of_all_histories():
    """Two slots of a chain with Gaussian measurements of the model: Bayes over four pairs."""
    before, levels, value, std = np.array([0.25, 0.75]), np.array([-1.0, 2.0]), 0.4, 1.3
    joint = before[:, None] * CHAIN * np.exp(-0.5 * ((value - levels) / std) ** 2)
    joint /= joint.sum()
    predicted, origin = mixing(before, CHAIN)
    after = reweighted(predicted, -0.5 * ((value - levels) / std) ** 2 - 700.0)
    np.testing.assert_allclose(after, joint.sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(origin, joint / joint.sum(axis=0), rtol=1e-12)


def test_a_slot_is_exact_over_all_pairs_of_models():
    """Mixing, prediction and update of linear models: the mixture of the four pairs at best.

    What is mixed has the right first two moments under every next model; the model's likelihood is
    that of a Gaussian with these moments.
    """
    mean, cov = beliefs()
    before = np.array([0.25, 0.75])
    _, origin = mixing(before, CHAIN)
    zero = np.zeros((3, 3))
    means, covs = interacted(origin, mean, cov, (zero, zero))
    for j in (0, 1):
        pair = before * CHAIN[:, j]
        pair /= pair.sum()
        centre = pair @ mean
        off = mean - centre
        np.testing.assert_allclose(means[j], centre, rtol=1e-12)
        expected = np.einsum("i,iab->ab", pair, cov) + np.einsum("i,ia,ib->ab", pair, off, off)
        np.testing.assert_allclose(covs[j], expected, rtol=1e-12)


def test_who_comes_from_another_model_has_the_entrys_law():
    """A component that the first model does not have: known to be 0 there, drawn on entry."""
    mean, cov = np.zeros((2, 3)), np.stack([np.diag([1.0, 1.0, 0.0]), np.eye(3)])
    entry = np.diag([0.0, 0.0, 9.0])
    origin = np.array([[1.0, 0.4], [0.0, 0.6]])
    _, covs = interacted(origin, mean, cov, (np.zeros((3, 3)), entry))
    assert covs[0, 2, 2] == 0.0
    assert covs[1, 2, 2] == pytest.approx(0.4 * 9.0 + 0.6 * 1.0)


def test_impossible_measurements_change_no_probability():
    predicted = np.array([[0.2, 0.8], [0.5, 0.5]])
    likelihood = np.array([[-np.inf, -np.inf], [np.nan, 0.0]])
    np.testing.assert_array_equal(reweighted(predicted, likelihood), predicted)
    np.testing.assert_allclose(reweighted(predicted, np.zeros((2, 2))), predicted, rtol=1e-12)


@pytest.mark.parametrize("axes", [1, 2])
def test_acceleration_moves_as_the_matrix_exponential(axes):
    """x'' = a with a constant jerk in the slot, by expm over position, velocity, acceleration."""
    motion = AcceleratedMotion(T, 0.7, axes)
    flow = expm(T * np.diag([1.0, 1.0, 1.0], 1))  # the fourth component is the jerk
    G, Q = motion.jacobian(np.zeros(motion.space.size), UAV), motion.noise()
    state = RNG.standard_normal(motion.space.size)
    np.testing.assert_allclose(motion.step(state, UAV), G @ state, rtol=1e-12)
    for axis in range(axes):
        own = [axis, axes + axis, 2 * axes + axis]
        np.testing.assert_allclose(G[np.ix_(own, own)], flow[:3, :3], rtol=1e-12, atol=1e-15)
        effect = 0.7 / T * flow[:3, 3]  # of a jerk that changes the acceleration by 0.7 in T
        np.testing.assert_allclose(Q[np.ix_(own, own)], np.outer(effect, effect), rtol=1e-9)
    assert G[-1, -1] == 1.0
    assert np.count_nonzero(Q[-1]) == 0


@pytest.mark.parametrize("axes", [1, 2])
def test_constant_velocity_has_a_place_among_accelerations(axes):
    plain = GroundMotion(T, 0.4, axes)
    wide = UnacceleratedMotion(plain)
    state = RNG.standard_normal((5, wide.space.size))
    kept = [*range(2 * axes), 3 * axes]
    moved = wide.step(state, UAV)
    np.testing.assert_array_equal(moved[:, kept], plain.step(state[:, kept], UAV))
    assert not moved[:, 2 * axes : -1].any()
    G = wide.jacobian(state, UAV)
    np.testing.assert_allclose(moved, (G @ state[..., None])[..., 0], rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(wide.noise()[np.ix_(kept, kept)], plain.noise())
    assert not wide.noise()[2 * axes : -1].any()


def test_the_filter_finds_the_model_by_itself():
    """Positions of an object that keeps its speed and then brakes: the likelier model follows."""
    models = (UnacceleratedMotion(GroundMotion(T, 0.01)), AcceleratedMotion(T, 0.05))
    entry = np.diag([0.0, 0.0, 16.0, 0.0])
    chain = np.array([[0.95, 0.05], [0.05, 0.95]])
    H, std = np.array([1.0, 0.0, 0.0, 0.0]), 0.3
    mean = np.tile([0.0, 20.0, 0.0, 0.0], (2, 1))
    first = np.diag([0.1, 0.1, 0.0, 0.0])
    cov, probability = np.stack([first, first + entry]), np.array([0.5, 0.5])
    time = T * np.arange(1, 41)
    late = np.maximum(time - 20 * T, 0.0)
    values = 20.0 * time - 3.0 * late**2 + std * np.random.default_rng(8).standard_normal(40)
    history = []
    for value in values:
        predicted, origin = mixing(probability, chain)
        mean, cov = interacted(origin, mean, cov, (np.zeros((4, 4)), entry))
        log = np.zeros(2)
        for j, model in enumerate(models):
            G = model.jacobian(mean[j], UAV)
            m, P = model.step(mean[j], UAV), G @ cov[j] @ G.T + model.noise()
            S = H @ P @ H + std**2
            log[j] = multivariate_normal.logpdf(value, H @ m, S)
            K = P @ H / S
            mean[j], cov[j] = m + K * (value - H @ m), P - np.outer(K, K) * S
        probability = reweighted(predicted, log)
        history.append(probability[1])
    assert np.mean(history[10:20]) < 0.5
    assert np.mean(history[30:]) > 0.5
    assert combined(probability, mean, cov)[0][2] == pytest.approx(-6.0, abs=1.0)
