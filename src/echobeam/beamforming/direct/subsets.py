"""Search over sets of objects to serve: other starts of the powers.

At high power the sum rate has several local optima, about one per set of objects worth serving.
A few steps from each of many uneven starts tell which sets promise most; only these are followed
to the end.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from echobeam.beamforming.direct.found import Found
from echobeam.values import Array, BoolArray, IntArray

if TYPE_CHECKING:
    from echobeam.beamforming.direct.trials import CompiledTrials

PROBE_STEPS = 20
"""Steps from a set of objects after which its promise is compared with that of others."""

CONTESTED = 0.01
"""Share of the sum rate that consideration for others costs, from which other sets of objects may
be worth more."""

FEW = 4
"""Number of objects up to which every set of them is followed to the end. Of more objects the sets
are tried that leave out none or one, then what differs by one object or a swap from the best one,
and so on."""

SWAPPED = 10
"""Number of objects up to which swaps are tried; beyond, they are too many."""

LEFT_OUT = 1e-2
"""Share, relative to a served object's, of one that is left out at the start."""

SERVED = 1e-3
"""Share, relative to the largest, from which an object counts as served."""

FOLLOWED = 4
PROMISING = 0.1
ALIKE = 0.02
"""Starts are followed that come within PROMISING of the best, relative; of those whose shares
differ by less than ALIKE one."""


def settle(trials: CompiledTrials, found: Found, chirp: Array, most: int, left: Array) -> None:
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
        ``(T,)``: steps that each trial may still take; changed.
    """
    contested = np.flatnonzero((found.disturbance > CONTESTED) & (left > 0.0))
    n_objects = trials.loss.shape[1]
    if n_objects < 2 or not contested.size:
        return
    if n_objects <= FEW:
        _compare_all(trials, found, contested, chirp, left)
        return
    step = max(1, most // n_objects)
    rivals = [_Rivals(n_objects, steps / PROBE_STEPS) for steps in left[contested].tolist()]
    while any(rival.wanted.size for rival in rivals):
        tried = np.repeat(np.arange(contested.size), [len(rival.wanted) for rival in rivals])
        start = _shares(np.concatenate([rival.wanted for rival in rivals]))
        share, value = np.empty(start.shape), np.empty(len(start))
        for begin in range(0, len(start), step):
            part = slice(begin, begin + step)
            probed = trials.taken(contested[tried[part]])
            share[part], value[part] = probed.probe(chirp, start[part], PROBE_STEPS)
        for trial, rival in enumerate(rivals):
            rival.take(share[tried == trial], value[tried == trial])
    left[contested] -= PROBE_STEPS * np.array([len(rival.value) for rival in rivals])
    for which, start in _followed(rivals):
        follow = left[contested[which]] > 0.0
        if follow.any():
            _follow(trials, found, contested[which[follow]], chirp, start[follow], left)


def _follow(
    trials: CompiledTrials,
    found: Found,
    which: IntArray,
    chirp: Array,
    start: Array,
    left: Array,
) -> None:
    """Follow some trials from the shares ``start`` to the end; take over what is better."""
    again = trials.taken(which).climb(chirp, share=start)
    left[which] -= again.iterations
    found.put(which, again)


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
            start = _shares(np.broadcast_to(served, (which.size, n_objects)))
            _follow(trials, found, which, chirp, start, left)


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


class _Rivals:
    """The sets of objects of one trial: which were tried, where they led, which to try next.

    Attributes
    ----------
    wanted
        ``(J, K)``: the sets to try next.
    served, share, value
        ``(I, K)``, ``(I, K)``, ``(I,)``: the sets that were tried, and the shares and sum rates
        that they led to.
    most
        Number of sets from which on no more are sought.
    """

    def __init__(self, n_objects: int, most: float) -> None:
        sets = np.concatenate([~np.eye(n_objects, dtype=bool), np.ones((1, n_objects)) > 0])
        self.wanted: BoolArray = sets
        self.served: BoolArray = sets[:0]
        self.share: Array = np.zeros((0, n_objects))
        self.value: Array = np.zeros(0)
        self.most = most
        self._known: set[bytes] = set()
        self._around: set[bytes] = set()

    def take(self, share: Array, value: Array) -> None:
        """Take what the sets wanted led to, and choose those to try next."""
        self._known |= {row.tobytes() for row in self.wanted}
        self.served = np.concatenate([self.served, self.wanted])
        self.share = np.concatenate([self.share, share])
        self.value = np.concatenate([self.value, np.where(np.isfinite(value), value, -np.inf)])
        self.wanted = self.wanted[:0]
        best = int(np.argmax(self.value))
        goes_on = len(self.value) < self.most
        if goes_on and np.isfinite(self.value[best]):
            centre = self.share[best] > SERVED * np.max(self.share[best])
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


def _followed(rivals: list[_Rivals]) -> Iterator[tuple[IntArray, Array]]:
    """Give, best first, which trials have another start worth following, and the start's shares."""
    chosen = [_promising(rival) for rival in rivals]
    for rank in range(FOLLOWED):
        which = np.flatnonzero([len(starts) > rank for starts in chosen])
        if which.size:
            yield which, np.array([chosen[trial][rank] for trial in which])


def _promising(rival: _Rivals) -> Array:
    """Return the starts ``(J, K)`` of one trial that are worth following, best first."""
    order = np.argsort(-rival.value, kind="stable")
    order = order[rival.value[order] >= (1.0 - PROMISING) * rival.value[order[0]]]
    order = order[np.isfinite(rival.value[order])]
    kept: list[int] = []
    for row in order:
        apart = [np.abs(rival.share[row] - rival.share[other]).max() for other in kept]
        if min(apart, default=1.0) >= ALIKE:
            kept.append(int(row))
    return _shares(rival.served[kept[:FOLLOWED]])
