"""Matchings against the least cost over all matchings there are."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.estimation.matching import match
from echobeam.faults import InputError

seeds = st.integers(0, 2**32 - 1)
sizes = st.integers(0, 4)


def problem(rng: np.random.Generator, batch: int, T: int, O: int) -> tuple[np.ndarray, ...]:  # noqa: E741
    """Costs of whole numbers, so that ties occur, with NaN where nobody is."""
    cost = rng.integers(0, 8, (batch, T, O)).astype(float)
    cost[rng.random(cost.shape) < 0.1] = np.inf
    tracks, objects = rng.random((batch, T)) < 0.8, rng.random((batch, O)) < 0.8
    cost[~(tracks[..., None] & objects[..., None, :])] = np.nan
    return cost, tracks, objects


def value(cost: np.ndarray, tracks: np.ndarray, objects: np.ndarray, partner: np.ndarray) -> float:
    """Cost of a matching at cutoff 5, from its definition."""
    pairs = [(t, o) for t, o in enumerate(partner) if o >= 0]
    assert all(tracks[t] and objects[o] for t, o in pairs)
    assert len({o for _, o in pairs}) == len(pairs)
    alone = tracks.sum() + objects.sum() - 2 * len(pairs)
    return sum(cost[t, o] for t, o in pairs) + 2.5 * alone


def least_value(cost: np.ndarray, tracks: np.ndarray, objects: np.ndarray) -> float:
    """The least cost over all matchings: every order of objects and places without one."""
    real = [np.flatnonzero(tracks), np.flatnonzero(objects)]
    places = [*real[1], *[-1] * len(real[0])]
    values = []
    for chosen in permutations(places, len(real[0])):
        partner = np.full(len(tracks), -1)
        partner[real[0]] = chosen
        values.append(value(cost, tracks, objects, partner))
    return min(values)


@given(seeds, sizes, sizes)
@settings(max_examples=60, deadline=None)
@pytest.mark.slow
def test_no_matching_is_cheaper(seed: int, T: int, O: int) -> None:  # noqa: E741
    cost, tracks, objects = problem(np.random.default_rng(seed), 8, T, O)
    matched = match(cost, tracks, objects, 5.0)
    for one in zip(cost, tracks, objects, matched, strict=True):
        assert value(*one) == pytest.approx(least_value(*one[:3]))
        assert all(o < 0 or one[0][t, o] < 5.0 for t, o in enumerate(one[3]))


def test_close_objects_are_matched_together_and_not_the_nearest_first() -> None:
    """The nearest pair alone would leave 0 and 3 to each other: 1 + 4 instead of 2 + 2."""
    cost = np.array([[2.0, 1.0], [4.0, 2.0]])
    both = np.ones(2, dtype=bool)
    np.testing.assert_array_equal(match(cost, both, both, 10.0), [0, 1])
    np.testing.assert_array_equal(match(cost[:, ::-1], both, both, 10.0), [1, 0])
    # with a low cutoff one pair at 1 and two unmatched at 0.75 each beat two pairs at 2
    np.testing.assert_array_equal(match(cost, both, both, 1.5), [1, -1])


def test_a_pair_at_the_cutoff_is_not_made() -> None:
    one = np.ones(1, dtype=bool)
    assert match(np.array([[5.0]]), one, one, 5.0) == [-1]
    assert match(np.array([[np.nextafter(5.0, 0.0)]]), one, one, 5.0) == [0]
    assert match(np.array([[np.inf]]), one, one, 5.0) == [-1]


def test_leading_axes_are_broadcast_and_every_problem_is_its_own() -> None:
    rng = np.random.default_rng(1)
    cost = rng.uniform(0, 6, (3, 4, 5, 6))
    tracks, objects = rng.random((4, 5)) < 0.7, rng.random((3, 1, 6)) < 0.7
    matched = match(cost, tracks, objects, 5.0)
    assert matched.shape == (3, 4, 5)
    for i in range(3):
        for j in range(4):
            alone = match(cost[i, j], tracks[j], objects[i, 0], 5.0)
            np.testing.assert_array_equal(matched[i, j], alone)


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0), (2, 0, 3), (2, 3, 0), (0, 2, 2)])
def test_without_tracks_or_objects_nobody_is_matched(shape: tuple[int, ...]) -> None:
    *batch, T, O = shape  # noqa: E741
    tracks, objects = np.ones((*batch, T), dtype=bool), np.ones((*batch, O), dtype=bool)
    matched = match(np.ones(shape), tracks, objects, 5.0)
    assert matched.shape == (*batch, T)
    assert (matched == -1).all()


def test_what_does_not_exist_is_matched_to_nobody_whatever_it_costs() -> None:
    both, none = np.ones(2, dtype=bool), np.zeros(2, dtype=bool)
    for cost in (np.nan, -np.inf, -1.0, 0.0):
        wide = np.full((2, 2), cost)
        assert (match(wide, none, both, 5.0) == -1).all()
        assert (match(wide, both, none, 5.0) == -1).all()


def test_bad_input_is_refused() -> None:
    both = np.ones(2, dtype=bool)
    one = np.ones((2, 2))
    for cutoff in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="cutoff"):
            match(one, both, both, cutoff)
    for cost in (np.nan, -1.0):
        with pytest.raises(InputError, match="negative cost or NaN"):
            match(cost * one, both, both, 5.0)
    with pytest.raises(InputError, match="need tracks"):
        match(one, np.ones(3, dtype=bool), both, 5.0)
    with pytest.raises(InputError, match="need objects"):
        match(one, both, np.ones(1, dtype=bool), 5.0)
    with pytest.raises(InputError, match="need tracks"):
        match(np.ones(2), both, both, 5.0)
    with pytest.raises(InputError, match="broadcast"):
        match(np.ones((3, 2, 2)), np.ones((4, 2), dtype=bool), both, 5.0)
