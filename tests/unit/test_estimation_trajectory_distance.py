"""Trajectory GOSPA against all paths of matchings, the programme as published, and stories."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from echobeam.estimation.set_distance import gospa
from echobeam.estimation.trajectory_distance import columns_by_identity, trajectory_gospa
from echobeam.faults import InputError

CUTOFF = 4.0
seeds = st.integers(0, 2**32 - 1)
orders = st.sampled_from([1.0, 2.0])
penalties = st.sampled_from([0.0, 0.7, 2.0, 5.0])


def problem(rng: np.random.Generator, N: int, T: int, K: int) -> tuple[np.ndarray, ...]:
    d = rng.uniform(0, 6, (N, T, K))
    tracks, objects = rng.random((N, T)) < 0.8, rng.random((N, K)) < 0.8
    d[~(tracks[:, :, None] & objects[:, None, :])] = np.nan
    return d, tracks, objects


def base_costs(d: np.ndarray, tracks: np.ndarray, objects: np.ndarray, p: float) -> np.ndarray:
    """D of the paper, ``(N, T + 1, O + 1)``: the last row and column are nobody."""
    N, T, K = d.shape
    D = np.zeros((N, T + 1, K + 1))
    for n in range(N):
        for t in range(T + 1):
            for k in range(K + 1):
                here = [t < T and bool(tracks[n, t]), k < K and bool(objects[n, k])]
                if all(here):
                    D[n, t, k] = min(d[n, t, k], CUTOFF) ** p
                elif any(here):
                    D[n, t, k] = CUTOFF**p / 2
    return D


def whole_matchings(T: int, K: int) -> list[np.ndarray]:
    """All matrices W with each of T tracks and K objects once, or with nobody."""
    found = {}
    for chosen in permutations([*range(K), *[K] * T], T):
        W = np.zeros((T + 1, K + 1))
        W[range(T), chosen] = 1.0
        W[T, :K] = 1.0 - W[:T, :K].sum(axis=0)
        found[W.tobytes()] = W
    return list(found.values())


def least_path(D: np.ndarray, penalty: float, p: float) -> float:
    """The least cost over all paths of whole matchings, by dynamic programming."""
    W = np.stack(whole_matchings(D.shape[1] - 1, D.shape[2] - 1))
    change = np.abs(W[:, None, :-1, :-1] - W[None, :, :-1, :-1]).sum(axis=(-2, -1))
    value = np.sum(W * D[0], axis=(1, 2))
    for cost in D[1:]:
        value = np.min(value + penalty**p / 2 * change, axis=1) + np.sum(W * cost, axis=(1, 2))
    return float(value.min())


def published_programme(D: np.ndarray, penalty: float, p: float) -> float:
    """The relaxation as printed, with nobody as a row and a column, in dense matrices."""
    N, rows, columns = D.shape
    T, K = rows - 1, columns - 1
    at = np.arange(D.size).reshape(D.shape)
    e = D.size + np.arange((N - 1) * T * K).reshape(N - 1, T, K)
    size = D.size + e.size
    cost = np.concatenate([D.ravel(), np.full(e.size, penalty**p / 2)])
    sums, at_most = [], []
    for n in range(N):
        for group in [*at[n, :T, :], *at[n, :, :K].T]:
            sums.append(np.isin(np.arange(size), group).astype(float))
    for index in np.ndindex(*e.shape):
        for sign in (1.0, -1.0):
            row = np.zeros(size)
            n, t, k = index
            row[[at[n, t, k], at[n + 1, t, k], e[index]]] = sign, -sign, -1.0
            at_most.append(row)
    cost[at[:, T, K]] = 0.0
    bounds = [(0.0, 0.0) if i in at[:, T, K] else (0.0, None) for i in range(size)]
    solved = linprog(
        cost,
        A_ub=np.array(at_most) if at_most else None,
        b_ub=np.zeros(len(at_most)) if at_most else None,
        A_eq=np.array(sums),
        b_eq=np.ones(len(sums)),
        bounds=bounds,
    )
    return float(solved.fun)


@given(seeds, st.integers(1, 5), st.integers(1, 3), penalties, orders, st.booleans())
@settings(max_examples=40, deadline=None)
def test_with_one_track_or_one_object_it_is_the_least_path(
    seed: int, N: int, many: int, penalty: float, p: float, one_track: bool
) -> None:
    """The matching of one track is a flow on a star with nobody in its centre, which is whole."""
    T, K = (1, many) if one_track else (many, 1)
    given_ = problem(np.random.default_rng(seed), N, T, K)
    found = trajectory_gospa(*given_, CUTOFF, penalty, p)
    best = least_path(base_costs(*given_, p), penalty, p)
    assert found.total**p == pytest.approx(best, abs=1e-6)


@given(seeds, st.integers(1, 4), st.integers(1, 3), st.integers(1, 3), penalties, orders)
@settings(max_examples=40, deadline=None)
def test_it_is_the_programme_as_published(
    seed: int, N: int, T: int, K: int, penalty: float, p: float
) -> None:
    given_ = problem(np.random.default_rng(seed), N, T, K)
    D = base_costs(*given_, p)
    found = trajectory_gospa(*given_, CUTOFF, penalty, p)
    assert found.total**p == pytest.approx(published_programme(D, penalty, p), abs=1e-6)
    assert found.total**p == pytest.approx(sum(found[1:]))
    assert found.total**p <= least_path(D, penalty, p) + 1e-6
    assert found.total**p >= np.sum(gospa(*given_, CUTOFF, p).total ** p) - 1e-6


@pytest.mark.parametrize("p", [1.0, 2.0])
def test_without_a_penalty_it_is_the_sum_of_the_set_distances(p: float) -> None:
    given_ = problem(np.random.default_rng(6), 12, 4, 5)
    slots = gospa(*given_, CUTOFF, p)
    found = trajectory_gospa(*given_, CUTOFF, 0.0, p)
    expected = [x.sum() for x in (slots.localisation, slots.missed, slots.false)]
    assert found[1:] == pytest.approx((*expected, 0.0), abs=1e-6)


def walk(tracks: list[str], objects: list[str]) -> tuple[np.ndarray, ...]:
    """Trajectories over places on a line, 100 apart; a point is a slot without."""
    x, y = (
        np.array([[np.nan if c == "." else 100.0 * int(c) for c in one] for one in who]).T
        for who in (tracks, objects)
    )
    return np.abs(x[:, :, None] - y[:, None, :]), ~np.isnan(x), ~np.isnan(y)


@pytest.mark.parametrize(
    ("tracks", "objects", "missed", "false", "switches"),
    [
        (["0000", "1111"], ["0000", "1111"], 0, 0, 0),
        (["1111", "0000"], ["0000", "1111"], 0, 0, 0),
        (["0011", "1100"], ["0000", "1111"], 0, 0, 2),  # two tracks swap their objects
        (["0011"], ["00..", "..11"], 0, 0, 1),  # a track goes on to another object
        (["00..", "..00"], ["0000"], 0, 0, 1),  # an object is found anew by another track
        (["0000"], ["00..", "..00"], 0, 0, 1),
        (["0.00"], ["0000"], 1, 0, 0),  # to be missed is not to be left
        (["0000", "5555"], ["0000"], 0, 4, 0),
        (["0000"], ["0000", "55.."], 2, 0, 0),
        ([".000"], ["000."], 1, 1, 0),
        (["0009"], ["0000"], 1, 1, 0),
    ],
)
@pytest.mark.parametrize("p", [1.0, 2.0])
def test_stories(
    tracks: list[str], objects: list[str], missed: int, false: int, switches: int, p: float
) -> None:
    """The penalty is 1, and to leave a track and an object unmatched for a slot costs 4^p."""
    found = trajectory_gospa(*walk(tracks, objects), CUTOFF, 1.0, p)
    half = CUTOFF**p / 2
    assert found[1:] == pytest.approx((0, half * missed, half * false, switches), abs=1e-6)


def test_a_switch_that_costs_more_than_errors_is_not_made() -> None:
    swapped = walk(["0011", "1100"], ["0000", "1111"])
    for penalty in (10.0, 1e9, np.inf):
        found = trajectory_gospa(*swapped, CUTOFF, penalty, 2.0)
        assert found[1:] == pytest.approx((0, 8 * 4, 8 * 4, 0), abs=1e-6)
    # two slots of two pairs unmatched cost 64, the swap 2 gamma^2
    below = trajectory_gospa(*swapped, CUTOFF, 0.999 * 32**0.5, 2.0)
    assert below.switches == pytest.approx(2 * 0.999**2 * 32)
    above = trajectory_gospa(*swapped, CUTOFF, 1.001 * 32**0.5, 2.0)
    assert above.switches == pytest.approx(0, abs=1e-6)


@given(seeds, st.integers(1, 4), penalties, orders)
@settings(max_examples=25, deadline=None)
def test_it_is_a_metric(seed: int, N: int, penalty: float, p: float) -> None:
    rng = np.random.default_rng(seed)
    sets = []
    for n in rng.integers(0, 4, 3):
        at = rng.uniform(0, 8, (N, n))
        sets.append(np.where(rng.random((N, n)) < 0.8, at, np.nan))

    def metric(x: np.ndarray, y: np.ndarray) -> float:
        d = np.abs(x[:, :, None] - y[:, None, :])
        return trajectory_gospa(d, ~np.isnan(x), ~np.isnan(y), CUTOFF, penalty, p).total

    x, y, z = sets
    assert metric(x, z) <= metric(x, y) + metric(y, z) + 1e-6
    assert metric(x, y) == pytest.approx(metric(y, x), abs=1e-6)
    assert metric(x, rng.permutation(x, axis=1)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("N", "T", "K"), [(3, 0, 0), (3, 0, 2), (3, 2, 0), (0, 2, 2), (0, 0, 0)])
def test_without_tracks_objects_or_slots_all_are_missed_or_false(N: int, T: int, K: int) -> None:
    everywhere = np.ones((N, T), dtype=bool), np.ones((N, K), dtype=bool)
    found = trajectory_gospa(np.zeros((N, T, K)), *everywhere, CUTOFF, 1.0, 1.0)
    expected = 0 if T and K else N
    assert found == (2.0 * expected * (T + K), 0, 2.0 * expected * K, 2.0 * expected * T, 0)


def test_nobody_is_at_distance_zero_from_nobody() -> None:
    none = np.zeros((3, 2), dtype=bool)
    assert trajectory_gospa(np.full((3, 2, 2), np.nan), none, none, CUTOFF, 1.0) == (0, 0, 0, 0, 0)


def test_a_column_with_two_owners_becomes_two_trajectories() -> None:
    identity = np.array([[3, 7], [3, -1], [7, 5], [7, 5]])
    d = np.arange(8.0).reshape(4, 2, 1)
    tracks = np.array([[True, True], [True, False], [True, True], [False, True]])
    distance, exists = columns_by_identity(d, tracks, identity)
    nan = np.nan
    expected = [[0, nan, 1], [2, nan, nan], [nan, 5, 4], [nan, 7, nan]]
    np.testing.assert_array_equal(distance[..., 0], expected)
    np.testing.assert_array_equal(exists, ~np.isnan(expected))
    with pytest.raises(InputError, match="no identity"):
        columns_by_identity(d, np.ones((4, 2), dtype=bool), identity)
    with pytest.raises(InputError, match="two columns"):
        columns_by_identity(d, tracks, np.full((4, 2), 3))
    with pytest.raises(InputError, match="do not fit"):
        columns_by_identity(d, tracks[:3], identity)


def test_bad_input_is_refused() -> None:
    d, tracks, objects = walk(["00"], ["00"])
    for order in (0.5, np.inf, np.nan):
        with pytest.raises(InputError, match="order"):
            trajectory_gospa(d, tracks, objects, CUTOFF, 1.0, order)
    for cutoff in (0.0, np.inf, np.nan):
        with pytest.raises(InputError, match="cutoff"):
            trajectory_gospa(d, tracks, objects, cutoff, 1.0)
    for penalty in (-1.0, np.nan):
        with pytest.raises(InputError, match="penalty"):
            trajectory_gospa(d, tracks, objects, CUTOFF, penalty)
    with pytest.raises(InputError, match="axes"):
        trajectory_gospa(d[0], tracks, objects, CUTOFF, 1.0)
    with pytest.raises(InputError, match="need"):
        trajectory_gospa(d, tracks[0], objects, CUTOFF, 1.0)
    with pytest.raises(InputError, match="NaN"):
        trajectory_gospa(np.nan * d, tracks, objects, CUTOFF, 1.0)
