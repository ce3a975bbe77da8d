"""The K best joint events of each scan, in descending order.

Small scans, and the small clusters of others, are enumerated for the whole batch at once; what is
left goes to Murty's algorithm, problem by problem. The lists of a scan's clusters, which do not
compete, are then merged two at a time: of the sums of two lists the K largest.
"""

from __future__ import annotations

from functools import cache
from itertools import islice
from math import comb, factorial

import numpy as np

from echobeam.faults import InputError
from echobeam.tracking.association.clusters import Clusters, clusters_of
from echobeam.tracking.association.murty import ranked_assignments
from echobeam.tracking.association.pairs import Pairs, flattened
from echobeam.values import NOBODY, Array, IntArray

_MOST_EVENTS = 2000
"""Joint events of a scan or cluster up to which all are enumerated: 3 tracks and 12 detections."""

_AT_ONCE = 1 << 21
"""Weights of events that are sorted at once: 16 MB."""


def k_best(pairs: Pairs, k: int) -> tuple[IntArray, Array]:
    """Return the K best joint events of each scan and the logarithms of their weights.

    Parameters
    ----------
    pairs
        Of a scan.
    k
        Number of events, K, at least 1.

    Returns
    -------
    assignment
        ``(..., K, C)``: the detection of each track, or `NOBODY`. Where there are fewer than K
        events the rest is `NOBODY` throughout.
    log_weight
        ``(..., K)``, descending: the sum of log odds and misses; -inf for the rest.
    """
    if k < 1:
        raise InputError(f"at least one joint event must be asked for, not {k}")
    log_odds, missed, lead = flattened(pairs)
    n_tracks = missed.shape[1]
    gain = log_odds - missed[..., None]
    solve = _enumerated if _n_events(*gain.shape[1:]) <= _MOST_EVENTS else _by_cluster
    assignment, total = solve(gain, k)
    log_weight = total + missed.sum(axis=-1)[:, None]
    return assignment.reshape(*lead, k, n_tracks), log_weight.reshape(*lead, k)


def largest(weight: Array, k: int) -> tuple[IntArray, Array]:
    """Return the indices and values of the K largest ``(..., K)`` of ``(..., E)``, descending.

    Where there are fewer than K the values are -inf and the indices 0; of equals the first leads.
    """
    order = np.argsort(-weight, axis=-1, kind="stable")[..., :k]
    found = np.take_along_axis(weight, order, axis=-1)
    missing = [(0, 0)] * (weight.ndim - 1) + [(0, k - order.shape[-1])]
    return np.pad(order, missing), np.pad(found, missing, constant_values=-np.inf)


def _enumerated(gain: Array, k: int) -> tuple[IntArray, Array]:
    """Return the K best of all events of gains ``(B, C, D)`` against a miss."""
    size, n_tracks, n_detections = gain.shape
    events = _events(n_tracks, n_detections)
    table = np.concatenate([np.zeros((size, n_tracks, 1)), gain], axis=2)
    assignment = np.empty((size, k, n_tracks), dtype=np.int64)
    total = np.empty((size, k))
    step = max(1, _AT_ONCE // len(events))
    for begin in range(0, size, step):
        part = slice(begin, begin + step)
        weight = np.zeros((len(table[part]), len(events)))
        for track in range(n_tracks):
            weight += table[part, track][:, events[:, track] + 1]
        index, total[part] = largest(weight, k)
        assignment[part] = events[index]
    return np.where(total[..., None] > -np.inf, assignment, NOBODY), total


def _by_cluster(gain: Array, k: int) -> tuple[IntArray, Array]:
    """Return the K best events of scans that are taken apart."""
    size, n_tracks, _ = gain.shape
    assignment = np.full((size, k, n_tracks), NOBODY)
    total = np.full((size, k), -np.inf)
    total[:, 0] = 0.0
    for clusters in clusters_of(gain > -np.inf):
        part = clusters.pick(gain)
        small = _n_events(*part.shape[1:]) <= _MOST_EVENTS
        local, worth = _enumerated(part, k) if small else _ranked(part, k)
        for chosen in _rounds(clusters.scan):
            _merge(assignment, total, clusters, local, worth, chosen)
    return assignment, total


def _merge(
    assignment: IntArray,
    total: Array,
    clusters: Clusters,
    local: IntArray,
    worth: Array,
    chosen: IntArray,
) -> None:
    """Join the lists of some clusters, of different scans, to those of their scans, in place."""
    scan, tracks = clusters.scan[chosen], clusters.tracks[chosen]
    k = total.shape[1]
    sums = total[scan][:, :, None] + worth[chosen][:, None, :]
    index, total[scan] = largest(sums.reshape(len(scan), k * k), k)
    base, added = np.divmod(index, k)
    joined = np.take_along_axis(assignment[scan], base[..., None], axis=1)
    inside = np.take_along_axis(local[chosen], added[..., None], axis=1)
    own = clusters.detections[chosen]
    mapped = np.take_along_axis(own[:, None, :], np.maximum(inside, 0), axis=2)
    mapped = np.where(inside >= 0, mapped, NOBODY)
    np.put_along_axis(joined, np.broadcast_to(tracks[:, None, :], mapped.shape), mapped, axis=2)
    assignment[scan] = np.where(total[scan][..., None] > -np.inf, joined, NOBODY)


def _rounds(scan: IntArray) -> list[IntArray]:
    """Return indices of clusters, each scan at most once in a round; scans are in order."""
    _, begin, size = np.unique(scan, return_index=True, return_counts=True)
    order = np.argsort(scan, kind="stable")
    return [order[begin[size > turn] + turn] for turn in range(size.max())]


def _ranked(gain: Array, k: int) -> tuple[IntArray, Array]:
    """Return the K best events by Murty's algorithm, problem by problem."""
    size, n_tracks, _ = gain.shape
    assignment = np.full((size, k, n_tracks), NOBODY)
    total = np.full((size, k), -np.inf)
    for problem in range(size):
        for rank, found in enumerate(islice(ranked_assignments(gain[problem]), k)):
            taken = np.flatnonzero(found >= 0)
            assignment[problem, rank] = found
            total[problem, rank] = gain[problem, taken, found[taken]].sum()
    return assignment, total


def _n_events(n_tracks: int, n_detections: int) -> int:
    """Return the number of joint events."""
    return sum(
        comb(n_tracks, pairs) * comb(n_detections, pairs) * factorial(pairs)
        for pairs in range(min(n_tracks, n_detections) + 1)
    )


@cache
def _events(n_tracks: int, n_detections: int) -> IntArray:
    """Return all joint events ``(E, C)``."""
    events = np.zeros((1, 0), dtype=np.int64)
    choices = np.arange(NOBODY, n_detections)
    for _ in range(n_tracks):
        free = (events[:, :, None] != choices).all(axis=1) | (choices == NOBODY)
        event, choice = np.nonzero(free)
        events = np.concatenate([events[event], choices[choice][:, None]], axis=1)
    events.flags.writeable = False
    return events
