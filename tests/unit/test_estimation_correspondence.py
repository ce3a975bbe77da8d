"""Correspondences against the published procedure in plain loops, and against stories."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.estimation.continuity import identity_switches
from echobeam.estimation.correspondence import correspond
from echobeam.estimation.set_distance import gospa
from echobeam.faults import InputError

CUTOFF = 4.0


def random_run(rng: np.random.Generator, N: int, T: int, K: int) -> tuple[np.ndarray, ...]:
    """Distances that have no ties, tracks that change columns."""
    d = rng.uniform(0, 8, (N, T, K))
    identity = np.argsort(rng.random((N, T + 2)), axis=1)[:, :T]
    tracks, objects = rng.random((N, T)) < 0.8, rng.random((N, K)) < 0.8
    d[~(tracks[:, :, None] & objects[:, None, :])] = np.nan
    identity[~tracks] = -1
    return d, identity, tracks, objects


def cheapest(d: np.ndarray, tracks: list[int], objects: list[int]) -> dict[int, int]:
    """Of all pairings, the one of least sum with CUTOFF for each track without."""
    best, least = {}, np.inf
    for chosen in permutations([*objects, *[-1] * len(tracks)], len(tracks)):
        pairs = {t: k for t, k in zip(tracks, chosen, strict=True) if k >= 0 and d[t, k] < CUTOFF}
        value = sum(d[t, k] for t, k in pairs.items()) + CUTOFF * (len(tracks) - len(pairs))
        if value < least:
            best, least = pairs, value
    return best


def by_hand(
    d: np.ndarray, identity: np.ndarray, tracks: np.ndarray, objects: np.ndarray
) -> np.ndarray:
    """One trial: mappings of objects to identities are verified, the rest is assigned."""
    matched = np.full(identity.shape, -1)
    mapping: dict[int, int] = {}
    for n in range(len(d)):
        column = {int(identity[n, t]): int(t) for t in np.flatnonzero(tracks[n])}
        free = [int(k) for k in np.flatnonzero(objects[n])]
        pairs = {}
        for k, name in mapping.items():
            if k in free and name in column and d[n, column[name], k] < CUTOFF:
                pairs[column[name]] = k
        rest = [t for t in column.values() if t not in pairs]
        pairs |= cheapest(d[n], rest, [k for k in free if k not in pairs.values()])
        for t, k in pairs.items():
            matched[n, t] = k
            name = int(identity[n, t])
            mapping = {other: it for other, it in mapping.items() if it != name and other != k}
            mapping[k] = name
    return matched


@given(st.integers(0, 2**32 - 1), st.integers(0, 6), st.integers(0, 3), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_it_is_the_published_procedure(seed: int, N: int, T: int, K: int) -> None:
    rng = np.random.default_rng(seed)
    runs = [random_run(rng, N, T, K) for _ in range(6)]
    found = correspond(*(np.stack(one) for one in zip(*runs, strict=True)), CUTOFF)
    assert found.shape == (6, N, T)
    for ours, run in zip(found, runs, strict=True):
        np.testing.assert_array_equal(ours, by_hand(*run))


def test_tracks_that_stay_on_close_objects_do_not_switch() -> None:
    """Errors of 1 and objects 0.5 apart: slot by slot the pairs swap, correspondences never do."""
    rng = np.random.default_rng(1)
    truth = np.broadcast_to([0.0, 0.5], (20, 30, 2))
    error = np.clip(rng.normal(size=truth.shape), -3.0, 3.0)
    d = np.abs((truth + error)[..., :, None] - truth[..., None, :])
    identity, both = np.broadcast_to([5, 9], truth.shape), np.ones(truth.shape, dtype=bool)
    alone = gospa(d, both, both, CUTOFF, order=1).matched
    lasting = correspond(d, identity, both, both, CUTOFF)
    assert identity_switches(identity, both, alone, both).min() > 0
    np.testing.assert_array_equal(identity_switches(identity, both, lasting, both), np.zeros(20))


def test_an_object_returns_to_its_track_after_a_gap_and_not_to_the_nearer_one() -> None:
    """Track 1 is new and nearer in the third slot, but track 0 had the object before."""
    d = np.array([[[1.0], [9.0]], [[9.0], [9.0]], [[2.0], [1.0]]])
    identity, all_there = np.array([[0, 1]] * 3), np.ones((3, 2), dtype=bool)
    found = correspond(d, identity, all_there, np.ones((3, 1), dtype=bool), CUTOFF)
    np.testing.assert_array_equal(found, [[0, -1], [-1, -1], [0, -1]])


def test_a_track_that_left_for_another_object_has_no_claim_on_the_first() -> None:
    d = np.array([[[1.0, 9.0]], [[9.0, 1.0]], [[2.0, 3.0]]])
    one = np.ones((3, 1), dtype=bool)
    found = correspond(d, np.zeros((3, 1), dtype=int), one, np.ones((3, 2), dtype=bool), CUTOFF)
    np.testing.assert_array_equal(found, [[0], [1], [1]])


def test_leading_axes_are_broadcast() -> None:
    d, identity, _, _ = random_run(np.random.default_rng(2), 5, 3, 2)
    d = np.stack([np.nan_to_num(d, nan=1.0)] * 4).reshape(2, 2, 5, 3, 2)
    identity = np.broadcast_to(np.arange(3), (5, 3))
    tracks, objects = np.ones((2, 1, 5, 3), dtype=bool), np.ones((5, 2), dtype=bool)
    found = correspond(d, identity, tracks, objects, CUTOFF)
    assert found.shape == (2, 2, 5, 3)
    np.testing.assert_array_equal(found[1, 0], by_hand(d[1, 0], identity, tracks[0, 0], objects))


def test_bad_input_is_refused() -> None:
    d, there, here = np.ones((2, 2, 1)), np.ones((2, 2), dtype=bool), np.ones((2, 1), dtype=bool)
    identity = np.array([[0, 1], [0, 1]])
    with pytest.raises(InputError, match="cutoff"):
        correspond(d, identity, there, here, 0.0)
    with pytest.raises(InputError, match="no identity"):
        correspond(d, identity - 1, there, here, CUTOFF)
    with pytest.raises(InputError, match="two columns"):
        correspond(d, 0 * identity, there, here, CUTOFF)
    with pytest.raises(InputError, match="axes"):
        correspond(d[0], identity[0], there[0], here[0], CUTOFF)
    with pytest.raises(InputError, match="shape of identity"):
        correspond(d, np.zeros((2, 3), dtype=int), there, here, CUTOFF)
    with pytest.raises(InputError, match="NaN"):
        correspond(np.nan * d, identity, there, here, CUTOFF)
