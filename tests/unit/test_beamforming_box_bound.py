from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.certify.box_bound import Box, Multipliers, box_bound

from ..forms import real_steering

RIPPLE = np.array([0.5, 2.0, 1.0])
LOSS = np.array([0.3, 2.0, 8.0])


def _scene() -> tuple[np.ndarray, list[np.ndarray]]:
    centres = np.array([0.3, 1.0, 1.9])
    covers = [real_steering(centre + np.linspace(-0.2, 0.2, 5), 8) for centre in centres]
    return real_steering(centres, 8), covers


def _design(rng: np.random.Generator) -> np.ndarray:
    """Gains of random covariances of unit total power that keep coverage: row by object."""
    channels, covers = _scene()
    columns = []
    for k, share in enumerate(rng.dirichlet(np.ones(3))):
        factor = rng.normal(size=(8, 3)) + 3 * rng.normal() * channels[k][:, None]
        covariance = factor @ factor.T / np.trace(factor @ factor.T)
        own = channels[k] @ covariance @ channels[k]
        worst = np.max(np.abs(own - np.sum((covers[k] @ covariance) * covers[k], axis=1)))
        part = min(1.0, RIPPLE[k] / worst)
        covariance = part * covariance + (1 - part) * np.eye(8) / 8
        columns.append(share * np.sum((channels @ covariance) * channels, axis=1))
    return np.stack(columns, axis=-1)


def _multipliers(rng: np.random.Generator) -> Multipliers:
    def some(size: int, scale: float) -> np.ndarray:
        return rng.uniform(-0.2, 1.0, size) * scale * rng.integers(0, 2)

    return Multipliers(
        received=rng.exponential(size=3),
        floors=some(3, 0.3),
        at_most=some(3, 0.3),
        at_least=some(3, 0.3),
        above=[some(5, 0.1) for _ in range(3)],
        below=[some(5, 0.1) for _ in range(3)],
    )


@pytest.mark.parametrize("seed", range(20))
def test_any_tangents_and_multipliers_bound_every_design_of_the_box(seed: int) -> None:
    rng = np.random.default_rng(seed)
    channels, covers = _scene()
    for _ in range(20):
        gains = _design(rng)
        own = np.diagonal(gains)
        heard = gains.sum(axis=1) - own
        ratio = own / (heard + LOSS)
        box = Box(heard * rng.uniform(0, 1, 3), heard * (1 + rng.exponential(size=3)))
        threshold = ratio * rng.uniform(0, 1, 3)
        at = _multipliers(rng)
        bound = box_bound(channels, covers, RIPPLE, LOSS, threshold, box, at)
        assert np.sum(np.log2(1 + ratio)) <= bound
        assert box_bound(channels, covers, RIPPLE, LOSS, threshold, box, at, rates=False) >= 0


def test_without_interference_and_coverage_the_bound_is_shannons() -> None:
    # One box of no width, all power to one object: tangent at what it then receives.
    channels, covers = real_steering(np.array([0.4]), 6), [np.zeros((0, 6))]
    nothing = np.zeros(1)
    at = Multipliers(np.array([6.0]), nothing, nothing, nothing, [np.zeros(0)], [np.zeros(0)])
    bound = box_bound(
        channels, covers, np.ones(1), np.array([0.5]), nothing, Box(nothing, nothing), at
    )
    assert bound == pytest.approx(np.log2(1 + 6.0 / 0.5), rel=1e-9)


def test_floors_beyond_the_array_are_proved_impossible() -> None:
    # p <= 6 for unit power, and the floor asks for 0.5 * 20: multiplier one says 10 <= 6.
    channels, covers = real_steering(np.array([0.4]), 6), [np.zeros((0, 6))]
    nothing, one = np.zeros(1), np.ones(1)
    at = Multipliers(nothing, one, nothing, nothing, [np.zeros(0)], [np.zeros(0)])
    values = [
        box_bound(
            channels, covers, one, np.array([0.5]), np.array([asked]), Box(nothing, nothing), at,
            rates=False,
        )
        for asked in (20.0, 11.0)
    ]  # fmt: skip
    assert values[0] == pytest.approx((6.0 - 10.0) / np.log(2.0))
    assert values[1] >= 0.0


def test_multipliers_that_are_not_numbers_prove_nothing() -> None:
    channels, covers = _scene()
    at = _multipliers(np.random.default_rng(0))
    broken = Multipliers(
        at.received * np.nan, at.floors, at.at_most, at.at_least, at.above, at.below
    )
    box = Box(np.zeros(3), np.ones(3))
    assert box_bound(channels, covers, RIPPLE, LOSS, np.zeros(3), box, broken) == np.inf


def test_the_chord_lies_above_the_logarithm_and_meets_it_at_the_ends() -> None:
    box = Box(np.array([0.0, 0.5, 2.0]), np.array([1e-9, 4.0, 2.0]))
    for part in np.linspace(0, 1, 11):
        assert np.all(box.lift(LOSS, box.low + part * (box.high - box.low)) >= -1e-15)
    for end in (box.low, box.high):
        np.testing.assert_allclose(box.lift(LOSS, end), 0.0, atol=1e-15)
