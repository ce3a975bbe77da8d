"""Shapes of beliefs: against densities in closed form, and against one update with everything."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from echobeam.tracking import road_grid
from echobeam.tracking.ground import GroundMeasurement
from echobeam.tracking.road_shape import POINTS, REACH, carried, gaussian_shape, shape_of
from echobeam.values import GaussianState, UavState

UAV = UavState(np.array([0.0, 0.0, 100.0]), np.zeros(3))
MODEL = GroundMeasurement(30e9)


def mixture(x, low=-20.0, high=14.0, share=0.3, std=3.0):
    """Two normal densities, and their first two moments."""
    density = share * norm.pdf(x, low, std) + (1.0 - share) * norm.pdf(x, high, std)
    mean = share * low + (1.0 - share) * high
    return density, mean, std**2 + share * (1.0 - share) * (high - low) ** 2


def on_grid(density, low=-60.0, high=60.0, points=400):
    """A flat grid ``(1,)`` and the weights of a density on it."""
    grid = road_grid.flat_grid(np.array([low]), np.array([high]), points, (30.0, 0.7))
    weight = density(grid.state[..., 0])
    return grid, weight / weight.sum()


def moments(mean, variance):
    return np.array([[mean, 0.0, 0.0]]), np.diag([variance, 900.0, 0.5])[None]


def test_a_gaussian_has_none():
    grid, weight = on_grid(lambda x: norm.pdf(x, 2.0, 4.0))
    assert not shape_of(grid, weight, *moments(2.0, 16.0)).bent.any()


def test_shape_and_gaussian_make_the_density():
    _, mean, variance = mixture(0.0)
    grid, weight = on_grid(lambda x: mixture(x)[0])
    shape = shape_of(grid, weight, *moments(mean, variance))
    assert shape.bent.all()
    assert shape.reach[0] == REACH
    x = mean + np.sqrt(variance) * np.linspace(-REACH, REACH, POINTS)
    made = norm.pdf(x, mean, np.sqrt(variance)) * np.exp(shape.log_ratio[0])
    inside = np.abs(x) < 55.0
    np.testing.assert_allclose(made[inside], mixture(x)[0][inside], rtol=0.02, atol=1e-9)


@pytest.mark.parametrize(("share", "bends"), [(0.3, True), (1e-3, False)])
def test_it_is_carried_from_a_divergence_on(share, bends):
    """The divergence of a mixture from its Gaussian, by quadrature: above or below 0.05 nat."""
    _, mean, variance = mixture(0.0, share=share, low=0.0)

    def integrand(x):
        p = mixture(x, share=share, low=0.0)[0]
        return p * (np.log(p) - norm.logpdf(x, mean, np.sqrt(variance)))

    divergence = quad(integrand, -20.0, 35.0, limit=200)[0]
    assert (divergence > 0.05) == bends
    grid, weight = on_grid(lambda x: mixture(x, share=share, low=0.0)[0])
    assert shape_of(grid, weight, *moments(mean, variance)).bent.all() == bends


def test_a_second_mode_far_away_is_within_reach():
    """Of probability 1e-3, at twelve standard deviations."""
    density, mean, variance = mixture(np.array(-40.0), -40.0, 14.0, 1e-3, 4.0)
    grid, weight = on_grid(lambda x: mixture(x, -40.0, 14.0, 1e-3, 4.0)[0])
    shape = shape_of(grid, weight, *moments(mean, variance))
    std = np.sqrt(variance)
    u = np.linspace(-1.0, 1.0, POINTS) * shape.reach[0]
    assert u[0] * std + mean < -40.0
    log = np.interp((-40.0 - mean) / std, u, shape.log_ratio[0])
    made = norm.pdf(-40.0, mean, std) * np.exp(log)
    assert made == pytest.approx(float(density), rel=0.3)  # linear between points of 1.8 m


def test_velocity_blurs_it():
    shape = gaussian_shape((2,))
    shape.log_ratio[:] = 1.0
    before = np.broadcast_to(np.diag([1.0, 900.0, 0.5]), (2, 3, 3))
    after = np.stack([np.diag([1.05, 900.0, 0.5]), np.diag([1.2, 900.0, 0.5])])
    assert carried(shape, before, after, 0.01).bent.tolist() == [True, False]


def test_two_slots_are_one_update_with_both_measurements():
    """Distance twice, and an angle that decides the side, of an object that does not move.

    With the shape the moments are those of all three at once; without it the second slot would
    begin with one Gaussian over both sides.
    """
    std = np.array([0.3, 2e-8, 1.0])
    values = MODEL.expected(np.array([45.0, 0.0, 0.0]), UAV) + std * [[0.4, 0.5, 0.0], [-0.6, 0, 0]]
    prior = GaussianState(
        np.array([[0.0, 0.0, 0.0]]), np.diag([40.0**2, 1e-8, 1e-8])[None], np.array([True])
    )
    noise = np.broadcast_to([std[0] ** 2, std[1] ** 2, np.inf], (1, 1, 3))
    values[:, 2] = np.nan

    grid = road_grid.grid_of(prior, 4000, 5.0)
    weight, mean, cov = road_grid.posterior(grid, values[:1], noise, MODEL, UAV)
    both = weight * road_grid.weights(grid, values[1:], noise, MODEL, UAV) / np.exp(grid.log_prior)
    both = both[0] / both.sum()
    x = grid.state[0, :, 0]
    exact = both @ x, both @ x**2 - (both @ x) ** 2

    second = GaussianState(mean, cov, prior.known)
    shape = shape_of(grid, weight, mean, cov)
    assert shape.bent.all()
    found = []
    for log_ratio in (shape.log_ratio, 0.0):
        again = road_grid.grid_of(second, POINTS, shape.reach)
        again = road_grid.replace(again, log_prior=again.log_prior + log_ratio)
        found.append(road_grid.posterior(again, values[1:], noise, MODEL, UAV)[1:])
    (with_mean, with_cov), (without_mean, _) = found
    assert with_mean[0, 0] == pytest.approx(exact[0], abs=0.02 * np.sqrt(exact[1]))
    assert with_cov[0, 0, 0] == pytest.approx(exact[1], rel=0.05)
    assert abs(without_mean[0, 0] - exact[0]) > 0.1 * np.sqrt(exact[1])


def test_heights_have_the_law_of_the_altitude_error():
    """Three nodes of a polynomial rule: moments of a normal up to the fifth, and all of a point."""
    root = np.array([[6.0, 0.0, 0.0], [3.0, 15.0, 0.0], [0.1, 0.0, 0.7]])
    state = GaussianState(np.array([[63.0, 8.0, 0.1]]), (root @ root.T)[None], np.array([True]))
    grid = road_grid.grid_of(state, 32, 5.0)
    shares = np.array(road_grid.HEIGHT_SHARES)
    b = np.array([place.state[0, :, 2] for place in road_grid.at_heights(grid)])
    off = b - grid.state[0, :, 2]
    for power, moment in ((1, 0.0), (2, 1.0), (3, 0.0), (4, 3.0), (5, 0.0)):
        np.testing.assert_allclose(shares @ off**power, moment * 0.7**power, atol=1e-12)
    many = road_grid.mixed(grid, road_grid.HEIGHT_SHARES)
    apart = np.exp(many.log_prior).reshape(3, 32).sum(axis=0)
    np.testing.assert_allclose(apart, np.exp(grid.log_prior[0]), rtol=1e-12)
    np.testing.assert_array_equal(many.state.reshape(3, 32, 3), [grid.state[0]] * 3)
