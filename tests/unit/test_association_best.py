"""The best joint events against all events one by one, and against SciPy's assignment."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from echobeam.tracking.association import Pairs, best, k_best, nearest, search
from echobeam.tracking.association.murty import ranked_assignments

from ..joint_events import log_weight, possible_events, random_pairs, small_pairs

MANY = 2000  # more than the events of four tracks and five detections


def check(pairs: Pairs, k: int) -> None:
    """Compare with brute force: weights in order, and each event once, with its own weight."""
    assignment, weight = k_best(pairs, k)
    expected = sorted(possible_events(*pairs).values(), reverse=True)[:k]
    n = len(expected)
    np.testing.assert_allclose(weight[:n], expected, rtol=1e-12, atol=1e-9)
    assert (weight[n:] == -np.inf).all()
    assert (assignment[n:] == -1).all()
    found = [tuple(event) for event in assignment[:n].tolist()]
    assert len(set(found)) == n
    for event, value in zip(found, weight, strict=False):
        assert log_weight(event, *pairs) == pytest.approx(value, rel=1e-12, abs=1e-9)


@given(small_pairs(), st.sampled_from([1, 2, 7, MANY]))
@pytest.mark.slow
def test_the_best_events_are_those_of_brute_force(pairs: Pairs, k: int) -> None:
    check(pairs, k)


@pytest.mark.parametrize("widths", [(4, 16), (1, 2), ()], ids=["search", "narrow", "Murty"])
@pytest.mark.parametrize("k", [1, 5, 40])
def test_every_way_to_find_them_agrees_with_brute_force(
    monkeypatch: pytest.MonkeyPatch, widths: tuple[int, ...], k: int
) -> None:
    """Limits on enumeration are lowered, so that small scans take the way of large ones."""
    monkeypatch.setattr(best, "_MOST_EVENTS", 0)
    monkeypatch.setattr(search, "_WIDTHS", widths)
    rng = np.random.default_rng(1)
    for share in (0.2, 0.5, 1.0):
        for shape in ((3, 4), (4, 3), (5, 5), (2, 6)):
            check(random_pairs(rng, (), *shape, share), k)


def test_a_batch_has_the_events_of_its_scans() -> None:
    for shape in ((2, 5), (6, 6), (0, 3), (3, 0)):
        pairs = random_pairs(np.random.default_rng(2), (3, 4), *shape, 0.3)
        assignment, weight = k_best(pairs, 6)
        assert assignment.shape == (3, 4, 6, shape[0])
        for index in np.ndindex(3, 4):
            alone = k_best(Pairs(pairs.log_odds[index], pairs.missed[index]), 6)
            assert np.array_equal(assignment[index], alone[0])
            assert np.array_equal(weight[index], alone[1])


@given(small_pairs(), st.sampled_from([1, 3, 10]))
@pytest.mark.slow
def test_the_search_has_the_weights_of_brute_force_for_odds_of_any_size(
    pairs: Pairs, k: int
) -> None:
    gain = pairs.log_odds - pairs.missed[:, None]
    _, found = search.searched(gain[None], k)
    expected = sorted(possible_events(*pairs).values(), reverse=True)[:k]
    np.testing.assert_allclose(
        found[0, : len(expected)] + pairs.missed.sum(), expected, rtol=1e-9, atol=1e-9
    )
    assert (found[0, len(expected) :] == -np.inf).all()


@pytest.mark.parametrize("share", [0.1, 0.3, 1.0])
def test_large_scans_begin_with_scipys_assignment_and_descend(share: float) -> None:
    pairs = random_pairs(np.random.default_rng(3), (5,), 16, 16, share)
    assignment, weight = k_best(pairs, 12)
    assert (np.diff(weight) <= 1e-9).all()
    for one in range(5):
        gain = np.maximum(pairs.log_odds[one] - pairs.missed[one][:, None], 0.0)
        best_sum = gain[linear_sum_assignment(gain, maximize=True)].sum()
        assert weight[one, 0] == pytest.approx(best_sum + pairs.missed[one].sum(), rel=1e-12)
        assert len({tuple(event) for event in assignment[one].tolist()}) == 12
        for event, value in zip(assignment[one].tolist(), weight[one], strict=True):
            taken = [d for d in event if d >= 0]
            assert len(taken) == len(set(taken))
            assert log_weight(tuple(event), pairs.log_odds[one], pairs.missed[one]) == (
                pytest.approx(value, rel=1e-12)
            )


def test_murtys_algorithm_and_enumeration_have_the_same_events() -> None:
    rng = np.random.default_rng(4)
    for _ in range(5):
        pairs = random_pairs(rng, (), 3, 4, 0.7)
        gain = pairs.log_odds - pairs.missed[:, None]
        ranked = [tuple(event.tolist()) for event in ranked_assignments(gain)]
        assignment, _ = k_best(pairs, len(ranked))
        assert ranked == [tuple(event) for event in assignment.tolist()]


@pytest.mark.parametrize("shape", [(6, 8), (10, 10)])
def test_murtys_algorithm_and_the_search_have_the_same_events(shape: tuple[int, int]) -> None:
    pairs = random_pairs(np.random.default_rng(6), (12,), *shape, 0.8)
    gain = pairs.log_odds - pairs.missed[..., None]
    assignment, _ = k_best(pairs, 20)
    for one in range(12):
        ranked = [tuple(event.tolist()) for event in islice(ranked_assignments(gain[one]), 20)]
        assert ranked == [tuple(event) for event in assignment[one].tolist()]


@given(small_pairs())
@pytest.mark.slow
def test_nearest_is_the_first_of_the_best(pairs: Pairs) -> None:
    event = nearest(pairs)
    weight = log_weight(tuple(event.tolist()), *pairs)
    assert weight == pytest.approx(k_best(pairs, 1)[1][0], rel=1e-12, abs=1e-9)
    taken = event[event >= 0]
    assert len(set(taken.tolist())) == len(taken)


@pytest.mark.parametrize("shape", [(2, 5), (7, 7), (16, 12), (0, 3), (3, 0)])
def test_nearest_in_a_batch_is_the_first_of_the_best(shape: tuple[int, int]) -> None:
    pairs = random_pairs(np.random.default_rng(5), (4, 10), *shape, 0.5)
    assert np.array_equal(nearest(pairs), k_best(pairs, 1)[0][..., 0, :])


def test_two_tracks_share_one_detection_when_that_is_best_for_both_together() -> None:
    """Row by row the first track would take the detection that the second needs more."""
    log_odds = np.array([[5.0, 4.0], [5.0, -np.inf]])
    assert nearest(Pairs(log_odds, np.zeros(2))).tolist() == [1, 0]


def test_a_detection_less_likely_than_a_miss_is_not_taken() -> None:
    assert nearest(Pairs(np.array([[-1.0]]), np.zeros(1))).tolist() == [-1]
    assert nearest(Pairs(np.array([[-1.0]]), np.full(1, -2.0))).tolist() == [0]


def test_no_event_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one"):
        k_best(Pairs(np.zeros((1, 1)), np.zeros(1)), 0)
