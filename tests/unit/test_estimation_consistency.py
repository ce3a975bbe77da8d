"""Normalised errors against explicit inverses, bands against closed forms of the chi-square."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echobeam.estimation.consistency import chi_square_band, nees, nis


def random_covariances(rng: np.random.Generator, shape: tuple[int, ...], size: int) -> np.ndarray:
    root = rng.normal(size=(*shape, size, size + 2))
    return root @ np.swapaxes(root, -1, -2)


def test_nees_is_the_squared_error_in_units_of_the_covariance() -> None:
    rng = np.random.default_rng(1)
    error, cov = 0.1 * rng.normal(size=(4, 2, 3)), random_covariances(rng, (4, 2), 3)
    expected = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    np.testing.assert_allclose(nees(error, cov), expected, rtol=1e-10)


def test_nees_does_not_depend_on_the_units_of_the_state() -> None:
    rng = np.random.default_rng(2)
    error, cov = rng.normal(size=3), random_covariances(rng, (), 3)
    unit = np.array([1e-9, 1.0, 1e9])
    scaled = nees(error * unit, cov * np.outer(unit, unit), angles=())
    assert scaled == pytest.approx(nees(error, cov, angles=()), rel=1e-10)


def test_angles_are_wrapped_and_the_given_arrays_are_left_alone() -> None:
    error = np.array([2 * np.pi - 0.1, 0.0])
    assert nees(error, np.eye(2)) == pytest.approx(0.01)
    assert nees(error, np.eye(2), angles=()) == pytest.approx((2 * np.pi - 0.1) ** 2)
    assert nis(error, np.zeros((2, 2)), np.eye(2), np.ones(2)) == pytest.approx(0.01)
    assert error[0] == 2 * np.pi - 0.1


def test_unknown_objects_have_no_nees() -> None:
    error, cov = np.full((2, 3), np.nan), np.stack([np.eye(3), np.full((3, 3), np.nan)])
    error[0] = 0.0
    np.testing.assert_array_equal(nees(error, cov), [0.0, np.nan])


def test_nis_is_the_squared_innovation_in_units_of_its_covariance() -> None:
    rng = np.random.default_rng(3)
    innovation, H = 0.1 * rng.normal(size=(5, 2)), rng.normal(size=(5, 2, 3))
    cov, variance = random_covariances(rng, (5,), 3), rng.uniform(0.1, 2.0, (5, 2))
    S = H @ cov @ np.swapaxes(H, -1, -2) + variance[..., None] * np.eye(2)
    expected = np.einsum("...i,...ij,...j->...", innovation, np.linalg.inv(S), innovation)
    np.testing.assert_allclose(nis(innovation, cov, H, variance), expected, rtol=1e-10)


def test_nis_leaves_out_what_was_not_measured() -> None:
    rng = np.random.default_rng(4)
    innovation, H, cov = rng.normal(size=3), rng.normal(size=(3, 3)), random_covariances(rng, (), 3)
    alone = nis(innovation[:1], cov, H[:1], np.ones(1))
    innovation[1] = np.nan
    assert nis(innovation, cov, H, np.array([1.0, 1.0, np.inf])) == pytest.approx(alone)


def test_band_of_two_degrees_of_freedom_is_that_of_the_exponential() -> None:
    low, high = chi_square_band(2, 1, confidence=0.9)
    assert low == pytest.approx(-2 * math.log(0.95))
    assert high == pytest.approx(-2 * math.log(0.05))


def test_band_of_many_samples_is_that_of_the_normal() -> None:
    low, high = chi_square_band(3, 1e8, confidence=0.95)
    half = 1.959963984540054 * math.sqrt(2 * 3 / 1e8)
    assert low == pytest.approx(3 - half, abs=1e-3 * half)
    assert high == pytest.approx(3 + half, abs=1e-3 * half)
