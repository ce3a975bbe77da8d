"""Innovation test: its false alarms against the chi-square law, and what it widens."""

import numpy as np
import pytest

from echobeam.estimation.consistency import share_band
from echobeam.tracking.fading import (
    FALSE_ALARM,
    MEMORY,
    no_surprise,
    remembered,
    widening,
)


def run(nis, degrees=3.0):
    """Factors of a sequence ``(S, K)`` of normalised innovations squared."""
    memory, factors = no_surprise(nis.shape[1:]), []
    for each in nis:
        memory = remembered(memory, each, np.full(each.shape, degrees))
        factor, memory = widening(memory, np.ones(each.shape, dtype=bool))
        factors.append(factor)
    return np.array(factors)


def test_the_first_slot_alone_has_exactly_the_stated_false_alarms():
    nis = np.random.default_rng(1).chisquare(3.0, (1, 400_000))
    low, high = share_band(FALSE_ALARM, nis.size, 0.999)
    assert low < (run(nis) > 1.0).mean() < high


@pytest.mark.slow
def test_later_slots_have_about_the_stated_false_alarms():
    """A weighted sum is nearly, not exactly, chi-square: within a factor of two."""
    nis = np.random.default_rng(2).chisquare(3.0, (12, 100_000))
    share = (run(nis)[6:] > 1.0).mean()
    assert 0.5 * FALSE_ALARM < share < 2.0 * FALSE_ALARM


def test_innovations_four_times_too_large_are_found_and_say_by_how_much():
    nis = 4.0 * np.random.default_rng(3).chisquare(3.0, (10, 2000))
    factors = run(nis)
    found = factors > 1.0
    assert found.any(axis=0).mean() > 0.95
    assert np.median(factors[found]) == pytest.approx(5.0, abs=2.0)  # the large ones are tested


def test_a_widened_track_starts_anew():
    memory = remembered(no_surprise((2,)), np.array([90.0, 3.0]), np.array([3.0, 3.0]))
    factor, after = widening(memory, np.array([True, True]))
    np.testing.assert_array_equal(factor, [30.0, 1.0])
    np.testing.assert_array_equal(after.total, [0.0, 3.0])
    np.testing.assert_array_equal(after.squared, [0.0, 3.0])


def test_without_a_measurement_nothing_changes():
    memory = remembered(no_surprise((1,)), np.array([8.0]), np.array([3.0]))
    same = remembered(memory, np.array([0.0]), np.array([0.0]))
    assert (same.total, same.degrees, same.squared) == (8.0, 3.0, 3.0)
    lost = remembered(memory, np.array([np.nan]), np.array([3.0]))
    assert lost.total == 8.0
    factor, _ = widening(no_surprise((1,)), np.array([False]))
    assert factor == 1.0


def test_the_past_is_forgotten():
    memory = remembered(no_surprise((1,)), np.array([8.0]), np.array([3.0]))
    memory = remembered(memory, np.array([1.0]), np.array([2.0]))
    assert memory.total == pytest.approx(MEMORY * 8.0 + 1.0)
    assert memory.degrees == pytest.approx(MEMORY * 3.0 + 2.0)
    assert memory.squared == pytest.approx(MEMORY**2 * 3.0 + 2.0)
