"""Sigma-point update against Kalman's, quadrature of the posterior, and the chi-square law."""

from dataclasses import dataclass

import numpy as np
import pytest

from echobeam.estimation.consistency import chi_square_band, nees
from echobeam.tracking.ground import ROAD, GroundMeasurement, GroundMotion
from echobeam.tracking.posterior_linearisation import linearised, update
from echobeam.values import GaussianState, StateSpace, UavState

UAV = UavState(np.array([0.0, 0.0, 100.0]), np.array([10.0, 0.0, -5.0]))
MODEL = GroundMeasurement(30e9)
STD = np.array([0.01, 3e-9, 2e3])


@dataclass(frozen=True)
class Linear:
    """Measurement C e."""

    C: np.ndarray

    @property
    def names(self):
        return tuple("abc"[: len(self.C)])

    def expected(self, state, uav):
        return state @ self.C.T

    def residual(self, value, expected):
        return value - expected


def belief(seed, batch=(4, 2)):
    rng = np.random.default_rng(seed)
    root = np.array([[2.0, 0.0, 0.0], [1.0, 8.0, 0.0], [0.2, 0.0, 0.6]])
    cov = root @ root.T * (1.0 + rng.random((*batch, 1, 1)))
    mean = np.array([60.0, 15.0, 0.0]) + rng.standard_normal((*batch, 3))
    return GaussianState(mean, cov, np.ones(batch, dtype=bool))


def kalman(mean, cov, value, C, R):
    """The textbook's update."""
    gain = cov @ C.T @ np.linalg.inv(C @ cov @ C.T + R)
    return mean + gain @ (value - C @ mean), cov - gain @ C @ cov


@pytest.mark.parametrize("iterations", [1, 3])
def test_a_linear_measurement_is_kalmans(iterations):
    rng = np.random.default_rng(5)
    model, prior = Linear(rng.standard_normal((3, 3))), belief(1)
    value, variance = rng.standard_normal((4, 2, 3)) * 50.0, rng.uniform(0.1, 4.0, (4, 2, 3))
    space = StateSpace(("a", "b", "c"), ("", "", ""), (), lambda e: np.isfinite(e).all(-1))
    found = update(prior, value, variance, model, UAV, space, iterations)
    for place in np.ndindex(4, 2):
        parts = prior.mean[place], prior.cov[place], value[place], model.C
        mean, cov = kalman(*parts, np.diag(variance[place]))
        np.testing.assert_allclose(found.state.mean[place], mean, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.state.cov[place], cov, rtol=1e-8, atol=1e-9)
        S = model.C @ prior.cov[place] @ model.C.T + np.diag(variance[place])
        nu = value[place] - model.C @ prior.mean[place]
        assert found.nis[place] == pytest.approx(nu @ np.linalg.solve(S, nu), rel=1e-8)


def test_a_component_that_is_not_measured_is_none():
    """As if there were two components only, and nothing at all keeps the prior in every bit."""
    prior = belief(2)
    value = MODEL.expected(prior.mean, UAV) + STD
    variance = np.broadcast_to(STD**2, value.shape).copy()
    value[..., 0], variance[..., 0] = np.nan, np.inf
    found = update(prior, value, variance, MODEL, UAV, ROAD)
    assert (found.degrees == 2).all()
    value[..., 0], variance[..., 0] = 0.0, 1e12  # so inaccurate that it says nothing
    near = update(prior, value, variance, MODEL, UAV, ROAD)
    np.testing.assert_allclose(found.state.mean, near.state.mean, rtol=1e-9)
    nothing = update(prior, np.full_like(value, np.nan), variance, MODEL, UAV, ROAD)
    np.testing.assert_array_equal(nothing.state.mean, prior.mean)
    np.testing.assert_array_equal(nothing.state.cov, prior.cov)
    assert not nothing.nis.any()


def test_an_unknown_object_stays_unknown_and_disturbs_nobody():
    prior = belief(3)
    value, variance = MODEL.expected(prior.mean, UAV), np.broadcast_to(STD**2, (4, 2, 3))
    alone = update(prior, value, variance, MODEL, UAV, ROAD).state
    known = np.ones((4, 2), dtype=bool)
    known[1, 0] = False
    hole = GaussianState(
        np.where(known[..., None], prior.mean, np.nan),
        np.where(known[..., None, None], prior.cov, np.nan),
        known,
    )
    found = update(hole, value, variance, MODEL, UAV, ROAD).state
    assert not found.known[1, 0]
    np.testing.assert_array_equal(found.mean[known], alone.mean[known])


def test_the_line_is_the_best_in_the_mean_square():
    """Slope and what it leaves, by regression over half a million draws of the Gaussian."""
    prior = belief(4, ())
    rng = np.random.default_rng(11)
    draws = rng.multivariate_normal(prior.mean, prior.cov, 500_000)
    h = MODEL.expected(draws, UAV) / STD
    off = draws - draws.mean(axis=0)
    slope = np.linalg.lstsq(off, h - h.mean(axis=0), rcond=None)[0].T
    left = np.cov((h - h.mean(axis=0) - off @ slope.T).T)
    line = linearised(prior.mean, prior.cov, MODEL, UAV)
    error = 5.0 * h.std(axis=0) / np.sqrt(len(h))
    assert (np.abs(line.expected / STD - h.mean(axis=0)) < error + 1e-3).all()
    np.testing.assert_allclose(line.slope / STD[:, None], slope, atol=2e-3 * np.abs(slope).max())
    np.testing.assert_allclose(line.cov / np.outer(STD, STD), np.cov(h.T), rtol=2e-2, atol=1e-3)
    # third-degree points see a part of the fourth moments only: the size is right, not the digits
    assert np.all(np.diag(left) < 3.0 * np.diag(line.omega / np.outer(STD, STD)) + 1e-3)


def test_iterations_come_near_the_posterior_of_a_bent_measurement():
    """Distance alone, nearly under the UAV: the mean by quadrature, and the first fit is worse."""
    mean, std, height, sigma = 30.0, 12.0, 100.0, 0.3
    prior = GaussianState(
        np.array([[mean, 0.0, 0.0]]), np.diag([std**2, 1.0, 0.0])[None], np.array([True])
    )
    model = GroundMeasurement(30e9)
    uav = UavState(np.array([0.0, 0.0, height]), np.zeros(3))
    d = np.hypot(height, 45.0)
    value = np.array([[np.nan, 2.0 * d / 299792458.0, np.nan]])
    variance = np.array([[np.inf, (2.0 * sigma / 299792458.0) ** 2, np.inf]])
    x = np.linspace(mean - 8.0 * std, mean + 8.0 * std, 200_001)
    density = np.exp(
        -0.5 * ((x - mean) / std) ** 2 - 0.5 * ((np.hypot(height, x) - d) / sigma) ** 2
    )
    density /= density.sum()
    exact = (density * x).sum()
    spread = np.sqrt((density * (x - exact) ** 2).sum())
    one, three = (update(prior, value, variance, model, uav, ROAD, n).state for n in (1, 4))
    assert abs(three.mean[0, 0] - exact) < 0.15 * spread
    assert abs(three.mean[0, 0] - exact) < 0.2 * abs(one.mean[0, 0] - exact)
    assert np.sqrt(three.cov[0, 0, 0]) == pytest.approx(spread, rel=0.15)


def test_a_filter_on_a_matched_model_is_consistent():
    """Ten slots, 500 draws of everything: NEES of every slot in its 99.9 % band."""
    rng, trials = np.random.default_rng(20), 500
    prior = belief(6, ())
    truth = rng.multivariate_normal(prior.mean, prior.cov, trials)[:, None]
    state = GaussianState(
        np.broadcast_to(prior.mean, truth.shape).copy(),
        np.broadcast_to(prior.cov, (trials, 1, 3, 3)).copy(),
        np.ones((trials, 1), dtype=bool),
    )
    motion = GroundMotion(0.01, 0.5)
    from echobeam.tracking.filter import predict

    low, high = chi_square_band(3, trials, 0.999)
    variance = np.broadcast_to(STD**2, truth.shape)
    for _ in range(10):
        value = MODEL.expected(truth, UAV) + STD * rng.standard_normal(truth.shape)
        state = update(state, value, variance, MODEL, UAV, ROAD).state
        assert low < nees(state.mean - truth, state.cov, ()).mean() < high
        truth = motion.step(truth, UAV)
        truth += rng.normal(0.0, 0.5, (trials, 1, 1)) * np.array([0.005, 1.0, 0.0])
        state = predict(state, motion, UAV)


def test_no_iteration_is_refused():
    with pytest.raises(ValueError, match="iterations: 0 is not accepted"):
        update(belief(1), np.zeros((4, 2, 3)), np.ones((4, 2, 3)), MODEL, UAV, ROAD, 0)
