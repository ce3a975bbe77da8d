"""Posterior as a sum of Gaussians against brute force over positions, and its pieces."""

import numpy as np
import pytest

from echobeam.estimation.sigma_points import principal_root
from echobeam.tracking.gaussian_sum import STEP, level, nodes, posterior, split
from echobeam.tracking.ground import GroundMeasurement
from echobeam.values import GaussianState, UavState

UAV = UavState(np.array([2.0, -1.0, 100.0]), np.array([8.0, 3.0, -4.0]))
STD = np.array([0.02, 0.03, 4e-9, 1.5e3])


def belief(axes, seed=3):
    rng = np.random.default_rng(seed)
    size = 2 * axes + 1
    scale = np.array([6.0, 3.0][:axes] + [15.0] * axes + [0.7])
    root = scale[:, None] * (np.eye(size) + 0.3 * rng.standard_normal((size, size)))
    mean = np.array([63.0, 20.0][:axes] + [8.0] * axes + [0.1])
    return GaussianState(mean[None], (root @ root.T)[None], np.array([True]))


def law(std):
    """A variance that grows away from (60, 22) m, as off a beam."""

    def variance(state):
        off = (state[..., 0] - 60.0) ** 2
        if state.shape[-1] == 5:
            off = off + (state[..., 1] - 22.0) ** 2
        return std**2 * np.exp(off / 16.0**2)[..., None]

    return variance


def drawn(state, value, variance, model, count=1_000_000):
    """Moments and E[1/R] of the posterior from weighted draws of the prior."""
    draws = np.random.default_rng(11).multivariate_normal(state.mean[0], state.cov[0], count)
    R = variance(draws)
    e = model.residual(value, model.expected(draws, UAV))
    seen = np.isfinite(value)
    log = -0.5 * (e**2 / R + np.log(R))[:, seen].sum(axis=-1)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    mean = weight @ draws
    off = draws - mean
    return mean, (weight[:, None] * off).T @ off, 1.0 / (weight @ (1.0 / R))


@pytest.mark.parametrize(("axes", "points"), [(1, (17,)), (2, (17, 17))])
@pytest.mark.parametrize("doppler", [True, False])
@pytest.mark.slow
def test_a_belief_becomes_the_posterior_of_weighted_draws(axes, points, doppler):
    state = belief(axes)
    model = GroundMeasurement(30e9, axes)
    std = STD if axes == 2 else STD[1:]
    at = state.mean[0] + np.array([-5.0, 2.0][:axes] + [4.0] * axes + [0.3])
    value = model.expected(at, UAV) + std * np.array([0.7, -0.4, 0.9, -1.1])[-len(std) :]
    if not doppler:
        value[-1] = np.nan
    mean, cov, variance = drawn(state, value, law(std), model)
    found = posterior(split(state, points), value[None], law(std), model, UAV)
    scale = np.sqrt(cov.diagonal())
    np.testing.assert_allclose((found.mean[0] - mean) / scale, 0.0, atol=0.03)
    np.testing.assert_allclose((found.cov[0] - cov) / np.outer(scale, scale), 0.0, atol=0.05)
    np.testing.assert_allclose(found.variance[0][:axes], variance[:axes], rtol=0.03)


@pytest.mark.parametrize("accuracy", [0.1, 1e-2, 1e-4])
def test_no_measurement_is_too_accurate(accuracy):
    """With u, v and delay exact to a part of a millimetre the position is that of the bearing.

    Linear in the end, so the posterior is that of the normal equations at the solution.
    """
    state, model, std = belief(2), GroundMeasurement(30e9, 2), accuracy * STD
    at = state.mean[0] + np.array([-5.0, 2.0, 4.0, -3.0, 0.3])
    value = model.expected(at, UAV)
    constant = np.broadcast_to(std**2, (1, 25, 4))
    found = posterior(split(state, (5, 5)), value[None], lambda _: constant, model, UAV, fits=4)
    H = model.jacobian(found.mean[0], UAV)
    precision = np.linalg.inv(state.cov[0]) + (H / std[:, None] ** 2).T @ H
    cov = np.linalg.inv(precision)
    scale = np.sqrt(cov.diagonal())
    np.testing.assert_allclose((found.cov[0] - cov) / np.outer(scale, scale), 0.0, atol=0.02)
    gradient = (H / std[:, None] ** 2).T @ model.residual(value, model.expected(found.mean[0], UAV))
    gradient -= np.linalg.solve(state.cov[0], found.mean[0] - state.mean[0])
    np.testing.assert_allclose(cov @ gradient / scale, 0.0, atol=0.02)  # the maximum


@pytest.mark.parametrize("points", [(1, 1), (3, 3), (5, 1), (9, 5), (17, 17)])
def test_a_sum_has_the_moments_of_the_belief(points):
    state = belief(2)
    parts = split(state, points)
    weight = np.exp(parts.log_weight[0])
    weight /= weight.sum()
    mean = weight @ parts.mean[0]
    off = parts.mean[0] - mean
    cov = (weight[:, None] * off).T @ off + parts.cov[0]
    np.testing.assert_allclose(mean, state.mean[0], rtol=1e-12)
    np.testing.assert_allclose(cov, state.cov[0], rtol=1e-11, atol=1e-11)
    assert np.linalg.eigvalsh(parts.cov[0]).min() > 0.0


@pytest.mark.parametrize("points", [5, 9, 17])
def test_a_sum_has_the_density_of_the_belief(points):
    """Errors of Poisson's summation formula, and 0.3 % beyond the outermost nodes."""
    place, log_weight, narrow = nodes(points)
    ripple = 2.0 * np.exp(-2.0 * np.pi**2 * (1.0 - narrow**2) / STEP**2)
    weight = np.exp(log_weight) / np.exp(log_weight).sum()
    z = np.linspace(-4.0, 4.0, 801)
    each = np.exp(-0.5 * ((z[:, None] - place) / narrow) ** 2) / narrow
    np.testing.assert_allclose(each @ weight, np.exp(-0.5 * z**2), rtol=0, atol=ripple + 0.01)


def test_a_level_sum_is_level_inside_its_rectangle():
    parts = level(np.array([[5.0, -3.0]]), np.array([[[20.0, 0.0], [0.0, 10.0]]]), 16, (1.0, 1.0))
    inverse = np.linalg.inv(parts.cov[0, :2, :2])
    x = np.random.default_rng(4).uniform([-5.0, -8.0], [15.0, 2.0], (200, 2))
    off = x[:, None] - parts.mean[0, :, :2]
    density = np.exp(-0.5 * np.einsum("ngi,ij,ngj->ng", off, inverse, off)).sum(axis=-1)
    np.testing.assert_allclose(density / density.mean(), 1.0, atol=4e-3)


def test_principal_axes_are_eigenvectors():
    rng = np.random.default_rng(5)
    root = rng.standard_normal((50, 2, 2))
    cov = root @ np.swapaxes(root, -1, -2)
    axes = principal_root(cov)
    np.testing.assert_allclose(np.swapaxes(axes, -1, -2) @ axes, cov, atol=1e-12)
    square = np.square(axes).sum(axis=-1)
    np.testing.assert_allclose(square[:, ::-1], np.linalg.eigvalsh(cov), atol=1e-12)
    np.testing.assert_allclose((axes[:, 0] * axes[:, 1]).sum(axis=-1), 0.0, atol=1e-12)
    line = principal_root(np.array([[4.0, 0.0], [0.0, 0.0]]))
    np.testing.assert_array_equal(np.abs(line), [[2.0, 0.0], [0.0, 0.0]])


def test_a_place_without_an_echo_is_impossible_and_all_such_change_nothing():
    state, model = belief(2), GroundMeasurement(30e9, 2)
    value = model.expected(state.mean[0], UAV)[None]
    parts = split(state, (5, 5))
    nowhere = posterior(parts, value, lambda at: np.full((1, 25, 4), np.inf), model, UAV)
    np.testing.assert_allclose(nowhere.mean, state.mean, rtol=1e-12)
    np.testing.assert_allclose(nowhere.cov, state.cov, rtol=1e-9, atol=1e-9)
    assert np.isinf(nowhere.variance).all()

    def right(at):
        dark = (parts.mean[..., 0] < state.mean[0, 0])[..., None]
        return np.where(dark, np.inf, (100.0 * STD) ** 2)

    assert posterior(parts, value, right, model, UAV).mean[0, 0] > state.mean[0, 0] + 2.0


def test_an_unknown_object_stays_unknown_and_harms_nobody():
    one, model = belief(2), GroundMeasurement(30e9, 2)
    both = GaussianState(
        np.concatenate([one.mean, np.full((1, 5), np.nan)]),
        np.concatenate([one.cov, np.full((1, 5, 5), np.nan)]),
        np.array([True, False]),
    )
    value = model.expected(one.mean, UAV)
    single = posterior(split(one, (5, 3)), value, law(STD), model, UAV)
    pair = np.concatenate([value, np.full((1, 4), np.nan)])
    found = posterior(split(both, (5, 3)), pair, law(STD), model, UAV)
    np.testing.assert_array_equal(found.mean[0], single.mean[0])
    np.testing.assert_array_equal(found.cov[0], single.cov[0])
    assert np.isnan(found.mean[1]).all()
    assert np.isnan(found.cov[1]).all()


@pytest.mark.parametrize("points", [0, 2, -3])
def test_an_even_number_of_points_is_refused(points):
    with pytest.raises(ValueError, match=r"points: .* is not accepted"):
        nodes(points)
