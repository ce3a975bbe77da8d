"""Search over sets of objects to serve.

At high power the sum rate has several local optima, about one for each set of objects worth
serving. A few steps on each of many sets tell which ones promise most; only these are followed to
the end, and the search goes on around the best. Where no floors (38e) are asked, a set is a problem
of its own with fewer objects. With floors every object has a beam, and a set is an uneven start of
the powers.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from echobeam.beamforming.direct.found import Found
from echobeam.values import Array, BoolArray, IntArray

if TYPE_CHECKING:
    from echobeam.beamforming.direct.trials import CompiledTrials

PROBE_STEPS = 30
"""Steps from a set of objects after which its promise is compared with that of others."""

CONTESTED = 0.01
"""Share of the sum rate that consideration for others costs, from which other sets of objects may
be worth more."""

FEW = 4
"""Number of objects up to which every set of them is followed to the end. Of more objects the sets
are tried that leave out none or one, then what differs by one object or a swap from the best one,
and so on."""

SWAPPED = 12
"""Number of objects up to which swaps are tried; beyond, they are too many."""

LEFT_OUT = 1e-2
"""Share, relative to a served object's, of one that is left out at the start."""

SERVED = 1e-3
"""Share, relative to the largest, from which an object counts as served."""

ROUNDS, RISEN = 4, 1e-6
"""Rounds of probing and following, each around what the one before found, and the relative rise of
the sum rate that calls for another one."""

FOLLOWED, ALWAYS_FOLLOWED = 8, 2
PROMISING = 0.25
ALIKE = 0.02
"""Starts are followed that come within PROMISING of the best, relative; of those whose shares
differ by less than ALIKE one; ALWAYS_FOLLOWED of them whatever work is left."""


def search_subsets(
    trials: CompiledTrials, found: Found, chirp: Array, most: int, left: Array
) -> None:
    """Look for better optima of the trials that may have several, in place.

    Parameters
    ----------
    trials, found
        The local optima from the even start, or from the beams given.
    chirp
        As in `climb`.
    most
        Number of beams to work on at a time.
    left
        ``(T,)``: steps on all beams that each trial may still take; changed.
    """
    contested = np.flatnonzero((found.interference_loss > CONTESTED) & (left > 0.0))
    n_objects = trials.loss.shape[1]
    if n_objects < 2 or not contested.size:
        return
    # Held at first, even shares let every shape make room for the others before one is given up.
    even = np.ones((contested.size, n_objects), dtype=bool)
    _follow(trials, found, contested, chirp, even, ~even[:, 0], left)
    before = found.objective[contested]
    if n_objects <= FEW:
        _compare_all(trials, found, contested, chirp, left)
    else:
        _search(trials, found, contested, chirp, most, left)
    risen = contested[found.objective[contested] > before * (1.0 + RISEN)]
    risen = risen[~trials.threshold[risen].any(axis=1)]
    if risen.size:  # the best set alone was solved; would another object be worth its power?
        start = _shares(_served(found, risen))
        found.put(risen, trials.taken(risen).climb(chirp, share=start))


def _search(
    trials: CompiledTrials,
    found: Found,
    contested: IntArray,
    chirp: Array,
    most: int,
    left: Array,
) -> None:
    """Probe sets, follow the promising ones, and go on around the best."""
    n_objects = trials.loss.shape[1]
    searches = [_SubsetSearch(n_objects) for _ in contested]
    for _ in range(ROUNDS):
        _probe_wanted(trials, searches, contested, chirp, max(1, most // n_objects), left)
        before = found.objective[contested]
        for rank, (which, served, alone) in enumerate(_followed(searches)):
            follow = (left[contested[which]] > 0.0) | (rank < ALWAYS_FOLLOWED)
            if follow.any():
                _follow(
                    trials,
                    found,
                    contested[which[follow]],
                    chirp,
                    served[follow],
                    alone[follow],
                    left,
                )
        risen = found.objective[contested] > before * (1.0 + RISEN)
        for place in np.flatnonzero(risen & (left[contested] > 0.0)).tolist():
            searches[place].look_around(_served(found, contested[place : place + 1])[0])
        if not any(search.wanted.size for search in searches):
            break


def _served(found: Found, which: IntArray) -> BoolArray:
    """Return the objects ``(J, K)`` that beams serve."""
    power = np.sum(np.abs(found.beams[which]) ** 2, axis=-1)
    served: BoolArray = power > SERVED * np.max(power, axis=-1, keepdims=True)
    return served


def _probe_wanted(
    trials: CompiledTrials,
    searches: list[_SubsetSearch],
    contested: IntArray,
    chirp: Array,
    step: int,
    left: Array,
) -> None:
    """Probe the sets that are wanted, and those that are wanted by what is found."""
    n_objects = trials.loss.shape[1]
    while any(search.wanted.size for search in searches):
        counts = np.array([len(search.wanted) for search in searches])
        tried = np.repeat(np.arange(contested.size), counts)
        served = np.concatenate([search.wanted for search in searches])
        first = np.repeat([not search.value.size for search in searches], counts)
        floors = np.asarray(trials.threshold[contested[tried]].any(axis=1))
        alone = ~first & ~floors
        share, value = np.zeros(served.shape), np.empty(len(served))
        for rows, objects in _alike(served, alone, step):
            part = trials.only(contested[tried[rows]], objects)
            start = _shares(np.take_along_axis(served[rows], objects, axis=1))
            reached, value[rows] = part.probe(chirp, start, PROBE_STEPS)
            share[rows[:, np.newaxis], objects] = reached
        cost = PROBE_STEPS * np.where(alone, served.sum(axis=1) / n_objects, 1.0)
        np.subtract.at(left, contested[tried], cost)
        for trial, search in enumerate(searches):
            if counts[trial]:
                mine = tried == trial
                search.take(share[mine], value[mine], alone[mine], left[contested[trial]])


def _alike(served: BoolArray, alone: BoolArray, step: int) -> Iterator[tuple[IntArray, IntArray]]:
    """Give rows of sets that are solved with equally many objects, and these ``(J, k)``.

    Sets that are ``alone`` are solved with their own objects, the others with all; a few rows at a
    time.
    """
    n_objects = served.shape[1]
    sizes = np.where(alone, served.sum(axis=1), n_objects)
    for size in sorted(set(sizes.tolist())):
        alike = np.flatnonzero(sizes == size)
        for begin in range(0, alike.size, step):
            rows = alike[begin : begin + step]
            chosen = served[rows] | ~alone[rows, np.newaxis]
            yield rows, np.nonzero(chosen)[1].reshape(-1, size)


def _follow(
    trials: CompiledTrials,
    found: Found,
    which: IntArray,
    chirp: Array,
    served: BoolArray,
    alone: BoolArray,
    left: Array,
) -> None:
    """Follow a set ``(J, K)`` of some trials to the end; take over what is better.

    ``alone``, ``(J,)``: solved without the other objects.
    """
    n_objects = served.shape[1]
    for rows, objects in _alike(served, alone, which.size):
        start = _shares(np.take_along_axis(served[rows], objects, axis=1))
        again = trials.only(which[rows], objects).climb(chirp, share=start)
        left[which[rows]] -= again.iterations * objects.shape[1] / n_objects
        found.put(which[rows], again.among(objects, n_objects))


def _compare_all(
    trials: CompiledTrials, found: Found, contested: IntArray, chirp: Array, left: Array
) -> None:
    """Follow every set of objects to the end but those that are proved to be worse."""
    n_objects = trials.loss.shape[1]
    every = np.arange(1, 2**n_objects - 1)
    for served in every[:, np.newaxis] >> np.arange(n_objects) & 1 > 0:
        most = _most(trials.loss[contested][:, served])
        floors = trials.threshold[contested].any(axis=1)
        better = floors | (most > found.objective[contested])
        which = contested[better & (left[contested] > 0.0)]
        if which.size:
            sets = np.broadcast_to(served, (which.size, n_objects))
            alone = ~np.asarray(trials.threshold[which].any(axis=1))
            _follow(trials, found, which, chirp, sets, alone, left)


def _most(loss: Array) -> Array:
    """Return a bound on the sum rate of a set without floors, ``(T,)`` bit/s/Hz.

    Parameters
    ----------
    loss
        ``(T, J)``: noise referred to the array, relative to N P_T. The bound gives every object
        the gain N, leaves interference out, and fills the power in as water.
    """
    ordered = np.sort(loss, axis=1)
    level = (1.0 + np.cumsum(ordered, axis=1)) / np.arange(1, loss.shape[1] + 1)
    count = np.sum(level > ordered, axis=1, keepdims=True)
    surface = np.take_along_axis(level, count - 1, axis=1)
    bound: Array = np.sum(np.log2(np.maximum(surface / loss, 1.0)), axis=1)
    return bound


class _SubsetSearch:
    """Sets of objects of one trial: which were tried, where they led, which to try next.

    Attributes
    ----------
    wanted
        ``(J, K)``: the sets to try next.
    served, share, value, alone
        ``(I, K)``, ``(I, K)``, ``(I,)``, ``(I,)``: the sets that were tried, the shares and sum
        rates that they led to, and whether they were solved without the other objects.
    """

    def __init__(self, n_objects: int) -> None:
        sets = np.concatenate([~np.eye(n_objects, dtype=bool), np.ones((1, n_objects)) > 0])
        self.wanted: BoolArray = sets
        self.served: BoolArray = sets[:0]
        self.share: Array = np.zeros((0, n_objects))
        self.value: Array = np.zeros(0)
        self.alone: BoolArray = np.zeros(0, dtype=bool)
        self.followed: set[int] = set()
        self._known: set[bytes] = set()
        self._around: set[bytes] = set()

    def take(self, share: Array, value: Array, alone: BoolArray, left: float) -> None:
        """Take what the sets wanted led to, and choose those to try next if work is left."""
        self._known |= {row.tobytes() for row in self.wanted}
        self.served = np.concatenate([self.served, self.wanted])
        self.share = np.concatenate([self.share, share])
        self.value = np.concatenate([self.value, np.where(np.isfinite(value), value, -np.inf)])
        self.alone = np.concatenate([self.alone, alone])
        self.wanted = self.wanted[:0]
        best = int(np.argmax(self.value))
        if left > 0.0 and np.isfinite(self.value[best]):
            self.look_around(self.share[best] > SERVED * np.max(self.share[best]))

    def look_around(self, centre: BoolArray) -> None:
        """Want the neighbours of a set ``(K,)``, if not done before."""
        if centre.tobytes() not in self._around:
            self._around.add(centre.tobytes())
            near = [s for s in _neighbours(centre) if s.tobytes() not in self._known]
            self.wanted = np.array(near, dtype=bool).reshape(-1, centre.size)


def _neighbours(served: BoolArray) -> Iterator[BoolArray]:
    """Give a set, those with one object more or less, and those with one swapped."""
    yield served
    for first in range(served.size):
        changed = served.copy()
        changed[first] ^= True
        if changed.any():
            yield changed
        for second in range(first if served.size <= SWAPPED else 0):
            if served[first] != served[second]:
                swapped = changed.copy()
                swapped[second] ^= True
                yield swapped


def _shares(served: BoolArray) -> Array:
    """Return ``(J, K)`` uneven shares of sets of objects."""
    shares = np.where(served, 1.0, LEFT_OUT)
    return np.asarray(shares / np.sum(shares, axis=1, keepdims=True))


def _followed(searches: list[_SubsetSearch]) -> Iterator[tuple[IntArray, BoolArray, BoolArray]]:
    """Give, best first, which trials have another set worth following, and the sets ``(J, K)``.

    The last value is whether they were probed, and so are followed, without the other objects.
    """
    chosen = [_promising(search) for search in searches]
    for rank in range(FOLLOWED):
        which = np.flatnonzero([len(sets) > rank for sets in chosen])
        if which.size:
            rows = [chosen[trial][rank] for trial in which]
            pairs = list(zip([searches[trial] for trial in which], rows, strict=True))
            served = np.array([search.served[row] for search, row in pairs])
            yield which, served, np.array([search.alone[row] for search, row in pairs])


def _promising(search: _SubsetSearch) -> list[int]:
    """Return the sets of one trial to follow that were not before, by index, best first."""
    order = np.argsort(-search.value, kind="stable")
    order = order[search.value[order] >= (1.0 - PROMISING) * search.value[order[0]]]
    order = order[np.isfinite(search.value[order])]
    kept: list[int] = []
    for row in order:
        apart = [np.abs(search.share[row] - search.share[other]).max() for other in kept]
        if min(apart, default=1.0) >= ALIKE:
            kept.append(int(row))
    kept = [row for row in kept[:FOLLOWED] if row not in search.followed]
    search.followed |= set(kept)
    return kept
