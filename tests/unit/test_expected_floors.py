"""Rate floors met with a probability, counted in draws from the belief."""

from dataclasses import replace

import numpy as np
import pytest

from echobeam.beamforming.expected.design import design_expected

from ..beliefs import beliefs, rates_at

DRAWS = 4_000


def met(given, beams, seed):
    """Return ``(T, K)``: how often the floors are met."""
    z = np.random.default_rng(seed).standard_normal((*given.angles.shape, DRAWS))
    floors = given.min_rate[:, None] * (1.0 - 1e-5)
    return (rates_at(given, beams, z) >= floors).mean(axis=-1)


@pytest.mark.parametrize("outage", [0.02, 0.2])
@pytest.mark.parametrize(("deviation", "snr"), [(0.0, 1.0), (0.3, 3e-3), (1.0, 1.0), (3.0, 10.0)])
@pytest.mark.slow
def test_floors_are_met_with_their_probability(outage, deviation, snr):
    given = beliefs(10, 2, 30, deviation, snr, seed=1)
    free = design_expected(given)
    floor = 0.15 * np.log2(1.0 + snr / 2.0)
    floored = replace(given, min_rate=np.full(2, floor), outage=outage)
    answer = design_expected(floored)
    good = ~answer.fallback
    assert good.sum() >= 5
    chance = met(floored, answer.beams, 2)
    band = 4.0 * np.sqrt(outage * (1.0 - outage) / DRAWS)
    assert chance[good].min() >= 1.0 - 1.1 * outage - band
    assert met(floored, free.beams, 2).min() < 1.0 - outage  # they ask for something
    assert (answer.expected_rate <= free.expected_rate * (1.0 + 1e-3)).all()
    assert sorted(answer.messages) == np.flatnonzero(answer.fallback).tolist()
    np.testing.assert_allclose(np.sum(np.abs(answer.beams) ** 2, axis=(1, 2)), 1.0)


def test_floors_that_are_met_anyway_change_nothing():
    given = beliefs(5, 2, 30, 0.3, 100.0, seed=3)
    given = replace(given, angles=np.radians([[50.0, 80.0]] * 5))
    floored = replace(given, min_rate=np.full(2, 1.0))
    np.testing.assert_array_equal(design_expected(given).beams, design_expected(floored).beams)


def test_without_uncertainty_a_floor_takes_the_power_of_its_closed_form():
    """At low SNR all that the floor of the weaker leaves goes to the stronger."""
    snr = np.array([1e-4, 5e-5])
    given = beliefs(1, 2, 30, 0.0, 1.0, angles=np.radians([[40.0, 75.0]]), loss=30.0 / snr[None])
    share = 0.3
    floored = replace(given, min_rate=np.array([0.0, np.log2(1.0 + share * snr[1])]))
    answer = design_expected(floored)
    power = np.sum(np.abs(answer.beams[0]) ** 2, axis=-1)
    np.testing.assert_allclose(power, [1.0 - share, share], rtol=2e-3)
    assert not answer.fallback[0]


def test_floors_out_of_reach_are_scaled_by_one_factor_and_it_is_said():
    snr = np.array([1e-4, 5e-5])
    given = beliefs(1, 2, 30, 0.0, 1.0, angles=np.radians([[40.0, 75.0]]), loss=30.0 / snr[None])
    floored = replace(given, min_rate=np.log2(1.0 + snr))
    answer = design_expected(floored)
    assert answer.fallback[0]
    assert "scaled by 0.5" in answer.messages[0]
    power = np.sum(np.abs(answer.beams[0]) ** 2, axis=-1)
    np.testing.assert_allclose(power, 0.5, rtol=5e-3)
