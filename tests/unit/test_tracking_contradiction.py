"""Innovation test: its false alarms against the laws of draws, and what it finds."""

import numpy as np
import pytest

from echobeam.estimation.consistency import share_band
from echobeam.tracking.contradiction import FALSE_ALARM, MEMORY, failing, no_surprise, remembered


def run(scores):
    """Failures of a sequence ``(S, K, M)`` of innovations over their standard deviations."""
    memory, failures = no_surprise(scores.shape[1:2], scores.shape[2]), []
    tested = np.ones(scores.shape[1], dtype=bool)
    for each in scores:
        degrees = np.full(len(each), float(scores.shape[2]))
        memory = remembered(memory, (each**2).sum(axis=-1), degrees, each)
        failures.append(failing(memory, tested))
    return np.array(failures)


def normals(seed, *shape):
    return np.random.default_rng(seed).standard_normal(shape)


def test_the_first_slot_alone_has_at_most_the_stated_false_alarms():
    """Four tests of a quarter each, of which that of the squares overlaps with the others."""
    low, high = share_band(FALSE_ALARM, 400_000, 0.999)
    share = run(normals(1, 1, 400_000, 3)).mean()
    assert 0.6 * low < share < high


@pytest.mark.slow
def test_later_slots_have_about_the_stated_false_alarms():
    """A weighted sum of squares is nearly, not exactly, chi-square: within a factor of two."""
    share = run(normals(2, 20, 50_000, 3))[8:].mean()
    assert 0.5 * FALSE_ALARM < share < 2.0 * FALSE_ALARM


def test_innovations_twice_too_large_are_found():
    assert run(2.0 * normals(3, 10, 2000, 3)).any(axis=0).mean() > 0.95


def test_a_drift_is_found_before_the_squares_show_it():
    """One component off by a standard deviation: squares are 4 in place of 3."""
    off = normals(4, 20, 2000, 3)
    off[..., 0] += 1.0
    drifting = run(off).any(axis=0).mean()
    spread = normals(5, 20, 2000, 3) * np.sqrt(4.0 / 3.0)  # the same squares without a drift
    assert drifting > 0.6
    assert drifting > 1.5 * run(spread).any(axis=0).mean()


def test_a_track_without_a_measurement_does_not_fail():
    memory = remembered(
        no_surprise((2,), 3), np.array([90.0, 90.0]), np.array([3.0, 3.0]), np.full((2, 3), 5.5)
    )
    assert failing(memory, np.array([True, False])).tolist() == [True, False]
    assert not failing(no_surprise((1,), 3), np.array([True])).any()


def test_without_a_measurement_nothing_changes():
    scores = np.array([[2.0, -1.0, 0.0]])
    memory = remembered(no_surprise((1,), 3), np.array([8.0]), np.array([2.0]), scores)
    nothing = np.zeros((1, 3))
    for nis, degrees, zero in ((0.0, 0.0, nothing), (np.nan, 3.0, np.nan * nothing)):
        same = remembered(memory, np.array([nis]), np.array([degrees]), zero)
        assert (same.total, same.degrees, same.squared) == (8.0, 2.0, 2.0)
        np.testing.assert_array_equal(same.drift, scores)
        np.testing.assert_array_equal(same.spread, [[1.0, 1.0, 0.0]])


def test_the_past_is_forgotten():
    first, second = np.array([[2.0, -1.0, 1.0]]), np.array([[0.5, 0.0, 0.0]])
    memory = remembered(no_surprise((1,), 3), np.array([8.0]), np.array([3.0]), first)
    memory = remembered(memory, np.array([1.0]), np.array([1.0]), second)
    assert memory.total == pytest.approx(MEMORY * 8.0 + 1.0)
    assert memory.degrees == pytest.approx(MEMORY * 3.0 + 1.0)
    assert memory.squared == pytest.approx(MEMORY**2 * 3.0 + 1.0)
    np.testing.assert_allclose(memory.drift, MEMORY * first + second, rtol=1e-12)
    np.testing.assert_allclose(memory.spread, [[MEMORY**2 + 1.0, MEMORY**2, MEMORY**2]], rtol=1e-12)
