from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.certify.bounds import (
    dirty_paper_bound,
    gain_bound,
    interference_free_bound,
)

from ..forms import real_steering


def _feasible_gain(rng: np.random.Generator, centre: np.ndarray, cover: np.ndarray, b: float):
    """Gain of a random covariance, mixed with a flat one until it keeps the ripple."""
    factor = rng.normal(size=(centre.size, 2)) + 3 * rng.normal() * centre[:, None]
    covariance = factor @ factor.T
    covariance /= np.trace(covariance)
    own = centre @ covariance @ centre
    worst = np.max(np.abs(own - np.sum((cover @ covariance) * cover, axis=1)))
    part = min(1.0, b / worst)
    return part * own + (1 - part) * 1.0


@pytest.mark.parametrize("seed", range(10))
def test_any_multipliers_bound_every_feasible_beam(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centre = real_steering(1.0, 10)
    cover = real_steering(1.0 + np.linspace(-0.3, 0.3, 7), 10)
    ripple = rng.uniform(0.1, 4)
    above, below = rng.uniform(-0.1, 0.4, 7), rng.uniform(-0.1, 0.4, 7)
    bound = gain_bound(centre, cover, ripple, above, below)
    for _ in range(200):
        assert _feasible_gain(rng, centre, cover, ripple) <= bound


def test_without_multipliers_the_array_is_the_bound() -> None:
    centre = real_steering(0.4, 12)
    bound = gain_bound(centre, centre[np.newaxis], 1.0, np.zeros(1), np.zeros(1))
    assert bound == pytest.approx(12.0, rel=1e-9)
    assert bound >= 12.0


def test_multipliers_that_are_not_numbers_prove_nothing() -> None:
    centre = real_steering(0.4, 12)
    bound = gain_bound(centre, centre[np.newaxis], 1.0, np.array([np.nan]), np.zeros(1))
    assert bound == 12.0


def test_single_object_bound_is_shannons() -> None:
    bound = interference_free_bound(np.array([30.0]), np.array([7.0]), np.zeros(1))
    assert bound == pytest.approx(np.log2(1 + 30 / 7), rel=1e-10)
    assert bound >= np.log2(1 + 30 / 7)


@pytest.mark.parametrize("seed", range(5))
def test_no_powers_beat_the_interference_free_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains, loss = rng.uniform(1, 30, 3), 10.0 ** rng.uniform(-3, 4, 3)
    threshold = rng.uniform(0, 0.2, 3) * gains / loss
    bound = interference_free_bound(gains, loss, threshold)
    least = threshold * loss / gains
    powers = least + (1 - least.sum()) * rng.dirichlet(np.ones(3) * 0.5, 3000)
    reached = np.log2(1 + gains * powers / loss).sum(axis=1)
    assert reached.max() <= bound
    assert reached.max() >= 0.9 * bound


def test_floors_tighten_the_bound() -> None:
    gains, loss = np.array([30.0, 10.0]), np.array([1e4, 2e4])
    free = interference_free_bound(gains, loss, np.zeros(2))
    assert interference_free_bound(gains, loss, np.array([0.0, 2e-4])) < 0.9 * free


def test_no_objects_are_bounded_by_zero() -> None:
    assert interference_free_bound(np.zeros(0), np.zeros(0), np.zeros(0)) == 0.0


def test_dirty_paper_bound_is_the_sum_capacity_of_orthogonal_channels() -> None:
    # Orthogonal channels: interference-free water-filling is the capacity.
    channels = real_steering(2 * np.pi * np.array([0.0, 2.0, 3.0]) / 8, 8)
    np.testing.assert_allclose(channels @ channels.T, 8 * np.eye(3), atol=1e-12)
    loss = np.array([0.5, 2.0, 1.0])
    capacity = interference_free_bound(np.full(3, 8.0), loss, np.zeros(3))
    assert dirty_paper_bound(channels, loss, 300) == pytest.approx(capacity, rel=1e-4)


def test_dirty_paper_bound_of_one_direction_is_the_better_object_alone() -> None:
    channels = real_steering(np.array([0.7, 0.7]), 6)
    bound = dirty_paper_bound(channels, np.array([0.5, 2.0]), 300)
    assert bound == pytest.approx(np.log2(1 + 6 / 0.5), rel=1e-3)
    assert bound >= np.log2(1 + 6 / 0.5)


@pytest.mark.parametrize("seed", range(5))
def test_no_linear_beams_beat_the_dirty_paper_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    channels = real_steering(rng.uniform(0, 1, 3), 6)
    loss = 10.0 ** rng.uniform(-3, 0, 3)
    bound = dirty_paper_bound(channels, loss)
    beams = rng.normal(size=(2000, 3, 6)) + np.linalg.pinv(channels).T * 20
    beams /= np.linalg.norm(beams, axis=(1, 2), keepdims=True)
    gains = (channels @ np.swapaxes(beams, 1, 2)) ** 2
    own = np.diagonal(gains, axis1=1, axis2=2)
    reached = np.log2(1 + own / (gains.sum(axis=2) - own + loss)).sum(axis=1)
    assert reached.max() <= bound


@pytest.mark.parametrize("scale", [1e-4, 1e-8, 1e-12])
def test_dirty_paper_bound_holds_where_digits_are_few(scale: float) -> None:
    # Objects of one direction: the better one alone, known in closed form, whatever the digits.
    channels = real_steering(np.zeros(3), 3)
    bound = dirty_paper_bound(channels, scale * np.array([1.0, 1.0, 1e4]), 300)
    capacity = np.log2(1 + 3 / scale)
    assert capacity <= bound <= capacity * (1 + 1e-3)
