"""GOSPA and OSPA against all permutations, Stone Soup and values worked out by hand."""

from __future__ import annotations

from datetime import datetime
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.estimation.set_distance import gospa, ospa
from echobeam.faults import InputError

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(0, 4)
orders = st.sampled_from([1.0, 2.0])


def apart(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Euclidean distances ``(..., T, O)`` of points ``(..., T, 2)`` and ``(..., O, 2)``."""
    return np.linalg.norm(x[..., :, None, :] - y[..., None, :, :], axis=-1)


def everybody(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    *batch, T, O = distance.shape  # noqa: E741
    return distance, np.ones((*batch, T), bool), np.ones((*batch, O), bool)


def on_a_line(tracks: list[float], objects: list[float]) -> tuple[np.ndarray, ...]:
    x, y = np.array(tracks, dtype=float), np.array(objects, dtype=float)
    return everybody(np.abs(x[:, None] - y))


def by_definition(d: np.ndarray, c: float, p: float, alpha: float) -> float:
    """GOSPA^p as published: permutations of the larger set, c^p / alpha for the difference."""
    d = d if d.shape[0] <= d.shape[1] else d.T
    few, many = d.shape
    sums = [
        sum(min(d[i, o], c) ** p for i, o in enumerate(chosen))
        for chosen in permutations(range(many), few)
    ]
    return min(sums) + c**p / alpha * (many - few)


@given(seeds, sizes, sizes, orders)
@settings(max_examples=60, deadline=None)
def test_both_are_the_published_minima_over_permutations(
    seed: int, tracks: int, objects: int, p: float
) -> None:
    rng = np.random.default_rng(seed)
    d = rng.uniform(0, 12, (5, tracks, objects))
    found, averaged = gospa(*everybody(d), 8.0, p), ospa(*everybody(d), 8.0, p)
    for i in range(5):
        assert found.total[i] ** p == pytest.approx(by_definition(d[i], 8.0, p, alpha=2))
        whole = by_definition(d[i], 8.0, p, alpha=1) / max(tracks, objects, 1)
        assert averaged[i] ** p == pytest.approx(whole)


@given(seeds, sizes, sizes, orders)
@settings(max_examples=60, deadline=None)
def test_the_parts_are_those_of_the_matching(
    seed: int, tracks: int, objects: int, p: float
) -> None:
    rng = np.random.default_rng(seed)
    d = rng.uniform(0, 12, (tracks, objects))
    found = gospa(*everybody(d), 8.0, p)
    pairs = [(t, o) for t, o in enumerate(found.matched) if o >= 0]
    assert found.localisation == pytest.approx(sum(d[t, o] ** p for t, o in pairs))
    assert found.missed == pytest.approx(8.0**p / 2 * (objects - len(pairs)))
    assert found.false == pytest.approx(8.0**p / 2 * (tracks - len(pairs)))
    assert found.total**p == pytest.approx(found.localisation + found.missed + found.false)


def test_known_values() -> None:
    missed = gospa(*on_a_line([1], [0, 10]), 10.0, order=1)
    assert missed[:4] == pytest.approx((6, 1, 5, 0))
    assert ospa(*on_a_line([1], [0, 10]), 10.0, order=1) == pytest.approx(5.5)
    false = gospa(*on_a_line([1, 12, 50], [0, 10]), 10.0, order=1)
    assert false[:4] == pytest.approx((8, 3, 0, 5))
    np.testing.assert_array_equal(false.matched, [0, 1, -1])
    # by hand: one pair at 3 and one object missed, sqrt(9 + 50) and sqrt((9 + 100) / 2)
    assert gospa(*on_a_line([3], [0, 40]), 10.0).total == pytest.approx(59**0.5)
    assert ospa(*on_a_line([3], [0, 40]), 10.0) == pytest.approx(54.5**0.5)


@pytest.mark.parametrize("p", [1.0, 2.0])
def test_both_agree_with_stone_soup(p: float) -> None:
    """OSPA of order 1 only: for others that library assigns by d and not by d^p."""
    ospametric = pytest.importorskip("stonesoup.metricgenerator.ospametric")
    from stonesoup.types.state import State

    def states(points: np.ndarray) -> list[State]:
        return [State(point, timestamp=datetime(2024, 1, 1)) for point in points]

    rng = np.random.default_rng(3)
    gospa_examiner = ospametric.GOSPAMetric(p=p, c=6.0)
    ospa_examiner = ospametric.OSPAMetric(p=1.0, c=6.0)
    for tracks, objects in [(3, 3), (2, 5), (5, 2), (0, 2), (3, 0), (6, 6)]:
        x, y = rng.uniform(0, 10, (tracks, 2)), rng.uniform(0, 10, (objects, 2))
        ours = gospa(*everybody(apart(x, y)), 6.0, p)
        theirs = gospa_examiner.compute_gospa_metric(states(x), states(y))[0].value
        expected = [theirs[part] for part in ("distance", "localisation", "missed", "false")]
        assert ours[:4] == pytest.approx(expected)
        value = ospa_examiner.compute_OSPA_distance(states(x), states(y)).value
        assert ospa(*everybody(apart(x, y)), 6.0, order=1) == pytest.approx(value)


@given(seeds, sizes, sizes, sizes, orders)
@settings(max_examples=40, deadline=None)
def test_both_are_metrics(seed: int, a: int, b: int, c: int, p: float) -> None:
    rng = np.random.default_rng(seed)
    x, y, z = (rng.uniform(0, 10, (20, n, 2)) for n in (a, b, c))
    for metric in (
        lambda d: gospa(*everybody(d), 5.0, p).total,
        lambda d: ospa(*everybody(d), 5.0, p),
    ):
        assert np.all(metric(apart(x, z)) <= metric(apart(x, y)) + metric(apart(y, z)) + 1e-9)
        np.testing.assert_allclose(metric(apart(x, y)), metric(apart(y, x)))
        np.testing.assert_allclose(metric(apart(x, rng.permutation(x, axis=1))), 0.0, atol=1e-12)


@pytest.mark.parametrize(("tracks", "objects"), [(0, 0), (0, 3), (2, 0)])
def test_without_tracks_or_objects_everything_is_missed_or_false(tracks: int, objects: int) -> None:
    found = gospa(*everybody(np.zeros((4, tracks, objects))), 10.0, order=1)
    for part, expected in zip(found[:4], (tracks + objects, 0, objects, tracks), strict=True):
        np.testing.assert_array_equal(part, np.full(4, 5.0 * expected))
    assert found.matched.shape == (4, tracks)
    averaged = ospa(*everybody(np.zeros((4, tracks, objects))), 10.0, order=1)
    np.testing.assert_array_equal(averaged, np.full(4, 10.0 if tracks + objects else 0.0))


def test_who_does_not_exist_counts_for_nothing() -> None:
    rng = np.random.default_rng(4)
    d = rng.uniform(0, 12, (6, 4, 5))
    tracks, objects = rng.random((6, 4)) < 0.6, rng.random((6, 5)) < 0.6
    d[~(tracks[..., None] & objects[:, None, :])] = np.nan
    found, averaged = gospa(d, tracks, objects, 8.0), ospa(d, tracks, objects, 8.0)
    for i in range(6):
        alone = everybody(d[i][tracks[i]][:, objects[i]])
        assert [part[i] for part in found[:4]] == pytest.approx(gospa(*alone, 8.0)[:4])
        assert averaged[i] == pytest.approx(ospa(*alone, 8.0))
    none = gospa(d, np.zeros(4, bool), np.zeros(5, bool), 8.0)
    np.testing.assert_array_equal(none.total, np.zeros(6))
    np.testing.assert_array_equal(ospa(d, np.zeros(4, bool), np.zeros(5, bool), 8.0), np.zeros(6))


def test_masks_are_broadcast_over_the_batch() -> None:
    d = np.random.default_rng(5).uniform(0, 12, (3, 2, 4, 5))
    found = gospa(d, np.array([True, True, False, True]), np.ones((2, 5), bool), 8.0)
    assert found.total.shape == found.missed.shape == found.false.shape == (3, 2)
    assert found.matched.shape == (3, 2, 4)


def test_bad_input_is_refused() -> None:
    given = on_a_line([1], [0, 10])
    with pytest.raises(InputError, match="alpha = 2"):
        gospa(*given, 10.0, alpha=1.0)
    for metric in (gospa, ospa):
        for order in (0.5, np.inf, np.nan):
            with pytest.raises(InputError, match="order"):
                metric(*given, 10.0, order)
        for cutoff in (0.0, np.nan, np.inf):
            with pytest.raises(InputError, match="cutoff"):
                metric(*given, cutoff)
        with pytest.raises(InputError, match="NaN"):
            metric(np.nan * given[0], *given[1:], 10.0)
