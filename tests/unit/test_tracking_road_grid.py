"""Posterior on a grid against brute force over position, velocity and altitude error."""

import numpy as np
import pytest

from echobeam.tracking.ground import GroundMeasurement
from echobeam.tracking.road_grid import (
    effective_variance,
    flat_grid,
    grid_of,
    posterior,
    resolved,
    weights,
)
from echobeam.tracking.road_start import first_state
from echobeam.values import GaussianState, UavState

UAV = UavState(np.array([2.0, 0.0, 100.0]), np.array([8.0, 0.0, -4.0]))
MODEL = GroundMeasurement(30e9)
STD = np.array([0.02, 4e-9, 1.5e3])
VALUE = MODEL.expected(np.array([57.0, 12.0, 0.5]), UAV) + STD * np.array([0.7, -0.4, 0.9])


def law(x):
    """A variance that grows away from 60 m, as off a beam, ``(..., 3)``."""
    return STD**2 * np.exp(((x - 60.0) / 12.0) ** 2)[..., None]


def brute(log_prior, axes):
    """Mean, covariance and E[1/R] over a product grid of x, v and b."""
    x, v, b = np.meshgrid(*axes, indexing="ij")
    state = np.stack([x, v, b], axis=-1)
    variance = law(x)
    e = MODEL.residual(VALUE, MODEL.expected(state, UAV))
    log = log_prior(state) - 0.5 * (e**2 / variance + np.log(variance)).sum(axis=-1)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    mean = (weight[..., None] * state).sum(axis=(0, 1, 2))
    off = state - mean
    cov = np.einsum("xvb,xvbi,xvbj->ij", weight, off, off)
    return mean, cov, 1.0 / (weight[..., None] / variance).sum(axis=(0, 1, 2))


def gaussian():
    root = np.array([[6.0, 0.0, 0.0], [3.0, 15.0, 0.0], [0.1, 0.0, 0.7]])
    return np.array([63.0, 8.0, 0.1]), root @ root.T


@pytest.mark.parametrize("points", [32, 200])
def test_a_gaussian_prior_becomes_the_posterior_of_brute_force(points):
    mean, cov = gaussian()
    precision = np.linalg.inv(cov)

    def log_prior(state):
        off = state - mean
        return -0.5 * np.einsum("...i,ij,...j", off, precision, off)

    axes = [
        np.linspace(m - 5.0 * s, m + 5.0 * s, 101)
        for m, s in zip(mean, cov.diagonal() ** 0.5, strict=True)
    ]
    exact_mean, exact_cov, exact_r = brute(log_prior, axes)
    prior = GaussianState(mean[None], cov[None], np.array([True]))
    grid = grid_of(prior, points, 5.0)
    variance = law(grid.state[..., 0])
    weight, found, spread = posterior(grid, VALUE[None], variance, MODEL, UAV)
    assert resolved(grid, spread)
    scale = np.sqrt(exact_cov.diagonal())
    np.testing.assert_allclose((found[0] - exact_mean) / scale, 0.0, atol=0.01)
    np.testing.assert_allclose((spread[0] - exact_cov) / np.outer(scale, scale), 0.0, atol=0.02)
    np.testing.assert_allclose(effective_variance(weight, variance)[0], exact_r, rtol=0.01)


def test_a_flat_prior_becomes_the_posterior_of_brute_force():
    def log_prior(state):
        return -0.5 * ((state[..., 1] / 30.0) ** 2 + (state[..., 2] / 0.7) ** 2)

    axes = [np.linspace(30.0, 85.0, 221), np.linspace(-150, 150, 61), np.linspace(-3.5, 3.5, 61)]
    exact_mean, exact_cov, _ = brute(log_prior, axes)
    grid = flat_grid(np.array([30.0]), np.array([85.0]), 64, (30.0, 0.7))
    variance = law(grid.state[..., 0])
    _, found, spread = posterior(grid, VALUE[None], variance, MODEL, UAV)
    scale = np.sqrt(exact_cov.diagonal())
    np.testing.assert_allclose((found[0] - exact_mean) / scale, 0.0, atol=0.02)
    np.testing.assert_allclose((spread[0] - exact_cov) / np.outer(scale, scale), 0.0, atol=0.06)


@pytest.mark.parametrize("accuracy", [1.0, 0.1, 0.01])
def test_a_first_state_is_that_of_one_fine_grid(accuracy):
    """Four grids of 64 points find what 40,000 around the place do, at any power."""
    value = MODEL.expected(np.array([57.0, 12.0, 0.5]), UAV) + accuracy * STD
    variance = np.broadcast_to((accuracy * STD) ** 2, (1, 1, 3))
    stds = (30.0, 0.7)
    _, _, mean, cov = first_state(value[None], lambda grid: variance, MODEL, UAV, stds, 64)
    whole = flat_grid(np.array([37.0]), np.array([77.0]), 40_000, stds)
    _, exact, spread = posterior(whole, value[None], variance, MODEL, UAV)
    scale = np.sqrt(spread[0].diagonal())
    np.testing.assert_allclose((mean[0] - exact[0]) / scale, 0.0, atol=0.02)
    np.testing.assert_allclose((cov[0] - spread[0]) / np.outer(scale, scale), 0.0, atol=0.06)


def test_the_points_have_the_moments_of_the_belief():
    mean, cov = gaussian()
    grid = grid_of(GaussianState(mean[None], cov[None], np.array([True])), 400, 6.0)
    prior = np.exp(grid.log_prior[0])
    prior /= prior.sum()
    centre = prior @ grid.state[0]
    off = grid.state[0] - centre
    spread = (prior[:, None] * off).T @ off
    spread[1:, 1:] += grid.cov[0]
    np.testing.assert_allclose(centre, mean, rtol=1e-10)
    np.testing.assert_allclose(spread, cov, rtol=1e-6, atol=1e-8)


def test_a_place_without_an_echo_is_impossible_and_all_such_change_nothing():
    mean, cov = gaussian()
    grid = grid_of(GaussianState(mean[None], cov[None], np.array([True])), 32, 5.0)
    variance = law(grid.state[..., 0])
    variance[:, :16] = np.inf
    weight = weights(grid, VALUE[None], variance, MODEL, UAV)
    assert not weight[:, :16].any()
    assert weight.sum() == pytest.approx(1.0)
    nowhere = weights(grid, VALUE[None], np.full_like(variance, np.inf), MODEL, UAV)
    expected = np.exp(grid.log_prior)
    np.testing.assert_allclose(nowhere, expected / expected.sum(), rtol=1e-12)
    assert np.isinf(effective_variance(nowhere, np.full_like(variance, np.inf))).all()


def test_a_component_that_was_not_measured_says_nothing_of_the_position():
    """Its variance may change over the road without any effect."""
    mean, cov = gaussian()
    grid = grid_of(GaussianState(mean[None], cov[None], np.array([True])), 32, 5.0)
    value = VALUE[None].copy()
    value[0, 0] = np.nan
    flat, bent = (np.broadcast_to(STD**2, (1, 32, 3)).copy() for _ in range(2))
    bent[..., 0] = np.linspace(1.0, 1e12, 32)
    one, other = (weights(grid, value, variance, MODEL, UAV) for variance in (flat, bent))
    np.testing.assert_array_equal(one, other)


def test_a_measurement_too_accurate_for_the_grid_is_told():
    mean, cov = gaussian()
    grid = grid_of(GaussianState(mean[None], cov[None], np.array([True])), 32, 5.0)
    variance = np.broadcast_to((1e-3 * STD) ** 2, (1, 32, 3))
    value = MODEL.expected(mean + np.array([1.0, 0.0, 0.0]), UAV)[None]
    _, _, spread = posterior(grid, value, variance, MODEL, UAV)
    assert not resolved(grid, spread)


def test_an_unknown_object_stays_unknown():
    mean, cov = gaussian()
    state = GaussianState(
        np.stack([mean, np.full(3, np.nan)]),
        np.stack([cov, np.full((3, 3), np.nan)]),
        np.array([True, False]),
    )
    grid = grid_of(state, 32, 5.0)
    variance = np.broadcast_to(STD**2, (2, 32, 3))
    value = np.stack([VALUE, np.full(3, np.nan)])
    _, found, spread = posterior(grid, value, variance, MODEL, UAV)
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()
    assert np.isnan(spread[1]).all()


@pytest.mark.parametrize(("points", "reach"), [(1, 5.0), (32, 0.0), (32, np.nan)])
def test_a_grid_of_no_extent_is_refused(points, reach):
    mean, cov = gaussian()
    with pytest.raises(ValueError, match=r"points, reach: .* are not accepted"):
        grid_of(GaussianState(mean[None], cov[None], np.array([True])), points, reach)
