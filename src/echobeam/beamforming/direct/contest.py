"""Which objects to serve: other places to start the powers from.

At high power the sum rate has several local optima, about one per set of objects worth serving.
A few steps from each of many uneven starts tell which sets promise most; only these are followed
to the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from echobeam.beamforming.direct.climb import Climber, Found
from echobeam.values import Array, IntArray

CONTESTED = 0.01
"""What consideration for others costs of the sum rate, relative, from which other sets of objects
may be worth more."""

FEW = 4
"""Number of objects up to which every set of them is tried, and not only small and large ones."""

LEFT_OUT = 1e-2
"""Share, relative to a served object's, of one that is left out at the start."""

FOLLOWED = 4
PROMISING = 0.1
ALIKE = 0.02
"""Starts are followed that come within PROMISING of the best, relative; of those whose shares
differ by less than ALIKE one."""


def settle(trials: Climber, found: Found, cold: IntArray, chirp: float, most: int) -> None:
    """Look for better optima of the trials that may have several, in place.

    Parameters
    ----------
    trials, found
        What was found from the even start.
    cold
        Indices of the trials that were not started from beams given.
    chirp
        As in `climb`.
    most
        Number of beams to work on at a time.
    """
    contested = cold[found.disturbance[cold] > CONTESTED]
    n_objects = trials.loss.shape[1]
    table = _table(n_objects)
    if not table.shape[0] or not contested.size:
        return
    step = max(1, most // (n_objects * table.shape[0]))
    for begin in range(0, contested.size, step):
        part = contested[begin : begin + step]
        count = table.shape[0]
        probed = trials.taken(np.repeat(part, count))
        share, value = probed.probe(chirp, np.tile(table, (part.size, 1)))
        for which, row in _followed(share.reshape(-1, count, n_objects), value.reshape(-1, count)):
            again = trials.taken(part[which]).climb(chirp, share=table[row])
            found.put(part[which], again)


def _table(n_objects: int) -> Array:
    """Return ``(J, K)`` uneven shares: one per set of objects to serve."""
    few = n_objects <= FEW
    sizes = list(range(1, n_objects)) if few else [1, 2, n_objects - 2, n_objects - 1]
    served = [
        members for size in sorted(set(sizes)) for members in combinations(range(n_objects), size)
    ]
    table = np.full((len(served), n_objects), LEFT_OUT)
    for row, members in enumerate(served):
        table[row, list(members)] = 1.0
    shares: Array = table / np.sum(table, axis=1, keepdims=True)
    return shares


def _followed(share: Array, value: Array) -> Iterator[tuple[IntArray, IntArray]]:
    """Give, best first, which trials have another start worth following, and which start.

    Parameters
    ----------
    share, value
        ``(T, J, K)``, ``(T, J)``: where each start has led so far.
    """
    order = np.argsort(-value, axis=1, kind="stable")
    share = np.take_along_axis(share, order[:, :, np.newaxis], axis=1)
    value = np.take_along_axis(value, order, axis=1)
    good = np.isfinite(value) & (value >= (1.0 - PROMISING) * value[:, :1])
    for rank in range(1, share.shape[1]):
        apart = np.abs(share[:, :rank] - share[:, rank, np.newaxis]).max(axis=2)
        good[:, rank] &= ~np.any((apart < ALIKE) & good[:, :rank], axis=1)
    good &= np.cumsum(good, axis=1) <= FOLLOWED
    for rank in range(share.shape[1]):
        which = np.flatnonzero(good[:, rank])
        if which.size:
            yield which, order[which, rank]
