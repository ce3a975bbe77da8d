"""Sigma points against LAPACK's root, Gauss-Hermite quadrature and NumPy's moments."""

from itertools import product

import numpy as np
import pytest

from echobeam.estimation.sigma_points import cubature_points, moments, root


def covariance(seed, size, batch=()):
    factor = np.random.default_rng(seed).standard_normal((*batch, size, size))
    scale = 10.0 ** np.arange(size)  # units as far apart as those of a state
    return factor @ np.swapaxes(factor, -1, -2) * scale[:, None] * scale


def quadrature(mean, cov, function, nodes=4):
    """The mean of a function by the product Gauss-Hermite rule, exact up to degree 2 nodes - 1."""
    place, weight = np.polynomial.hermite_e.hermegauss(nodes)
    factor = np.linalg.cholesky(cov)
    total = 0.0
    for index in product(range(nodes), repeat=len(mean)):
        index = list(index)
        total += np.prod(weight[index]) * function(mean + factor @ place[index])
    return total / np.sqrt(2.0 * np.pi) ** len(mean)


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_the_root_is_lapacks(size):
    cov = covariance(size, size, (4, 3))
    np.testing.assert_allclose(root(cov), np.linalg.cholesky(cov), rtol=1e-9, atol=1e-9)


def test_a_component_that_is_known_or_determined_has_a_zero_column():
    factor = np.array([[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 3.0]])
    np.testing.assert_allclose(root(factor @ factor.T), factor, atol=1e-12)
    np.testing.assert_array_equal(root(np.zeros((3, 3))), np.zeros((3, 3)))


def test_what_is_unknown_stays_so():
    assert np.isnan(root(np.full((3, 3), np.nan))[0, 0])


@pytest.mark.parametrize("size", [2, 3, 5])
def test_the_points_have_mean_and_covariance(size):
    mean, cov = np.arange(size, dtype=float), covariance(7, size)
    points = cubature_points(mean, root(cov))
    assert points.shape == (2 * size, size)
    shift, spread = moments(points - 1.0)
    np.testing.assert_allclose(shift + 1.0, mean, atol=1e-9)
    np.testing.assert_allclose(spread, cov, rtol=1e-9)
    np.testing.assert_allclose(spread, np.cov(points.T, bias=True), rtol=1e-9)


def test_the_rule_is_exact_for_cubic_polynomials():
    mean, cov = np.array([0.3, -1.0, 2.0]), covariance(3, 3) / 100.0

    def cubic(e):
        x, y, z = e[..., 0], e[..., 1], e[..., 2]
        return x**3 - 2.0 * x * y * z + 0.5 * y**2 + z - 4.0

    found = cubic(cubature_points(mean, root(cov))).mean()
    assert found == pytest.approx(quadrature(mean, cov, cubic), rel=1e-10)
