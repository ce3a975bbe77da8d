"""The K best joint events of each scan, in descending order.

Small scans are enumerated for the whole batch at once, larger ones searched (`search`).
"""

from __future__ import annotations

from functools import cache
from math import comb, factorial

import numpy as np

from echobeam.faults import InputError
from echobeam.tracking.association.order import largest
from echobeam.tracking.association.pairs import Pairs, flattened
from echobeam.tracking.association.search import searched
from echobeam.values import NOBODY, Array, IntArray

_MOST_EVENTS = 2000
"""Joint events of a scan up to which all are enumerated: 3 tracks and 12 detections."""

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
    solve = _enumerated if _n_events(*gain.shape[1:]) <= _MOST_EVENTS else searched
    assignment, total = solve(gain, k)
    log_weight = total + missed.sum(axis=-1)[:, None]
    return assignment.reshape(*lead, k, n_tracks), log_weight.reshape(*lead, k)


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
