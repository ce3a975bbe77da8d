"""Normalised errors against explicit inverses, bands against closed forms of the chi-square."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echobeam.estimation.consistency import chi_square_band, nees, nis, share_band
from echobeam.estimation.gaussian import propagate, update


def random_covariances(rng: np.random.Generator, shape: tuple[int, ...], size: int) -> np.ndarray:
    root = rng.normal(size=(*shape, size, size + 2))
    return root @ np.swapaxes(root, -1, -2)


def test_nees_is_the_squared_error_in_units_of_the_covariance() -> None:
    rng = np.random.default_rng(1)
    error, cov = 0.1 * rng.normal(size=(4, 2, 3)), random_covariances(rng, (4, 2), 3)
    expected = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    np.testing.assert_allclose(nees(error, cov, angles=(0,)), expected, rtol=1e-10)


def test_nees_does_not_depend_on_the_units_of_the_state() -> None:
    rng = np.random.default_rng(2)
    error, cov = rng.normal(size=3), random_covariances(rng, (), 3)
    unit = np.array([1e-9, 1.0, 1e9])
    scaled = nees(error * unit, cov * np.outer(unit, unit), angles=())
    assert scaled == pytest.approx(nees(error, cov, angles=()), rel=1e-10)


def test_angles_are_wrapped_and_the_given_arrays_are_left_alone() -> None:
    error = np.array([2 * np.pi - 0.1, 0.0])
    one = np.eye(2)
    assert nees(error, one, angles=(0,)) == pytest.approx(0.01)
    assert nees(error[::-1], one, angles=(1,)) == pytest.approx(0.01)
    for others in ((), (1,)):
        assert nees(error, one, others) == pytest.approx((2 * np.pi - 0.1) ** 2)
    assert nis(error, 0 * one, one, np.ones(2), angles=(0,)) == pytest.approx(0.01)
    assert error[0] == 2 * np.pi - 0.1


def test_unknown_objects_have_no_nees() -> None:
    error, cov = np.full((2, 3), np.nan), np.stack([np.eye(3), np.full((3, 3), np.nan)])
    error[0] = 0.0
    np.testing.assert_array_equal(nees(error, cov, angles=(0,)), [0.0, np.nan])


def test_an_estimate_on_a_curve_has_no_nees_beside_others_that_have() -> None:
    """Products J P J^T of rank 2, whose smallest eigenvalue is rounding of either sign."""
    rng = np.random.default_rng(5)
    J, cov = rng.normal(size=(500, 3, 2)), random_covariances(rng, (500,), 2)
    singular = J @ cov @ np.swapaxes(J, -1, -2)
    unit = np.array([1e-9, 1.0, 1e9])
    error = rng.normal(size=(500, 3))
    for scale in (np.ones(3), unit):
        assert np.isnan(nees(error * scale, singular * np.outer(scale, scale), angles=())).all()
    regular = singular + 1e-6 * np.eye(3)
    mixed = np.where((np.arange(500) % 2 == 0)[:, None, None], regular, singular)
    expected = np.einsum("ni,nij,nj->n", error, np.linalg.inv(regular), error)[::2]
    found = nees(error, mixed, angles=())
    np.testing.assert_allclose(found[::2], expected, rtol=1e-6)
    assert np.isnan(found[1::2]).all()


def test_a_component_known_exactly_leaves_no_nees() -> None:
    assert np.isnan(nees(np.array([0.0, 1.0]), np.diag([0.0, 1.0]), angles=()))


def test_nis_is_the_squared_innovation_in_units_of_its_covariance() -> None:
    rng = np.random.default_rng(3)
    innovation, H = 0.1 * rng.normal(size=(5, 2)), rng.normal(size=(5, 2, 3))
    cov, variance = random_covariances(rng, (5,), 3), rng.uniform(0.1, 2.0, (5, 2))
    S = H @ cov @ np.swapaxes(H, -1, -2) + variance[..., None] * np.eye(2)
    expected = np.einsum("...i,...ij,...j->...", innovation, np.linalg.inv(S), innovation)
    np.testing.assert_allclose(nis(innovation, cov, H, variance, angles=(0,)), expected, rtol=1e-10)


def test_nis_leaves_out_what_was_not_measured() -> None:
    rng = np.random.default_rng(4)
    innovation, H, cov = rng.normal(size=3), rng.normal(size=(3, 3)), random_covariances(rng, (), 3)
    alone = nis(innovation[:1], cov, H[:1], np.ones(1), angles=(0,))
    innovation[1] = np.nan
    variance = np.array([1.0, 1.0, np.inf])
    assert nis(innovation, cov, H, variance, angles=(0,)) == pytest.approx(alone)


def test_band_of_two_degrees_of_freedom_is_that_of_the_exponential() -> None:
    low, high = chi_square_band(2, 1, confidence=0.9)
    assert low == pytest.approx(-2 * math.log(0.95))
    assert high == pytest.approx(-2 * math.log(0.05))


def test_band_of_many_samples_is_that_of_the_normal() -> None:
    low, high = chi_square_band(3, 1e8, confidence=0.95)
    half = 1.959963984540054 * math.sqrt(2 * 3 / 1e8)
    assert low == pytest.approx(3 - half, abs=1e-3 * half)
    assert high == pytest.approx(3 + half, abs=1e-3 * half)


def test_band_of_a_share_holds_it_and_no_more_than_needed() -> None:
    """Against sums of the binomial's probabilities themselves."""
    n, p = 40, 0.9
    low, high = share_band(p, n)
    law = [math.comb(n, k) * p**k * (1 - p) ** (n - k) for k in range(n + 1)]
    first, last = round(low * n), round(high * n)
    assert sum(law[:first]) <= 0.025 < sum(law[: first + 1])
    assert sum(law[last + 1 :]) <= 0.025 < sum(law[last:])
    assert share_band(1.0, 7) == (1.0, 1.0)


def filtered(believed: float, trials: int, slots: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """NEES and NIS, ``(slots,)`` means over trials, of a Kalman filter on a linear model.

    The truth has process noise Q; the filter believes in ``believed`` times Q.
    """
    rng = np.random.default_rng(12)
    G = np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]])
    H, Q, variance = np.eye(2, 3), np.diag([0.1, 0.2, 0.3]), np.array([0.2, 0.5])
    P = np.broadcast_to(np.diag([1.0, 2.0, 3.0]), (trials, 3, 3))
    truth = rng.normal(size=(trials, 3)) * np.sqrt([1.0, 2.0, 3.0])
    mean = np.zeros((trials, 3))
    errors, surprises = [], []
    for _ in range(slots):
        truth = truth @ G.T + rng.normal(size=truth.shape) * np.sqrt(np.diag(Q))
        mean, P = mean @ G.T, propagate(P, np.broadcast_to(G, P.shape), believed * Q)
        seen = truth @ H.T + rng.normal(size=(trials, 2)) * np.sqrt(variance)
        innovation = seen - mean @ H.T
        wide = np.broadcast_to(variance, innovation.shape)
        rows = np.broadcast_to(H, (trials, 2, 3))
        surprises.append(nis(innovation, P, rows, wide, angles=()).mean())
        mean, P = update(mean, P, innovation, rows, wide)
        errors.append(nees(mean - truth, P, angles=()).mean())
    return np.array(errors), np.array(surprises)


def test_a_matched_linear_filter_is_inside_its_bands() -> None:
    """40 means, each outside its band with probability 1e-4: a false alarm in 0.4 %."""
    errors, surprises = filtered(1.0, trials=400)
    for values, degrees in ((errors, 3), (surprises, 2)):
        low, high = chi_square_band(degrees, 400, confidence=1 - 1e-4)
        assert low < values.min()
        assert values.max() < high


@pytest.mark.parametrize(("believed", "side"), [(0.05, 1), (20.0, -1)])
def test_a_filter_with_a_wrong_covariance_is_outside(believed: float, side: int) -> None:
    """Overconfident above the band, timid below it, once the process noise has had its effect."""
    for values, degrees in zip(filtered(believed, trials=400), (3, 2), strict=True):
        low, high = chi_square_band(degrees, 400)
        settled = values[10:]
        assert (settled > high).all() if side > 0 else (settled < low).all()
