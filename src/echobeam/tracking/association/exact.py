"""Exact association probabilities: sums over all joint events, by subsets.

The sum over joint events is a permanent. Objects of one kind (tracks or detections, the more
numerous) are taken in order; a state is the subset of the other kind that is used already
(the dynamic programme of Held and Karp, A dynamic programming approach to sequencing problems,
J. SIAM 10(1), 1962, for this sum). A forward and a backward pass give all marginals at a cost of
2^J I J for I > J, where enumeration needs up to I! / (I - J)!.
"""

from __future__ import annotations

import numpy as np

from echobeam.tracking.association.arithmetic import LINEAR, LOGARITHMIC, Arithmetic, scaled
from echobeam.values import Array

_AT_ONCE = 1 << 15
"""Numbers of one array of states that are processed at once, so that it stays in the cache."""


def exact_probabilities(log_odds: Array, missed: Array) -> Array:
    """Return the probability of each track's partners, ``(B, C, D + 1)``; [.., 0] is a miss.

    Parameters
    ----------
    log_odds, missed
        ``(B, C, D)`` and ``(B, C)``, as in `Pairs`.
    """
    size, n_tracks, n_detections = log_odds.shape
    log_odds, missed, wide = scaled(log_odds, missed)
    result = np.empty((size, n_tracks, n_detections + 1))
    step = max(1, _AT_ONCE >> min(n_tracks, n_detections))
    for arithmetic, rows in ((LINEAR, ~wide), (LOGARITHMIC, wide)):
        index = np.flatnonzero(rows)
        for begin in range(0, len(index), step):
            part = index[begin : begin + step]
            result[part] = _probabilities(log_odds[part], missed[part], arithmetic)
    return result


def _probabilities(log_odds: Array, missed: Array, arithmetic: Arithmetic) -> Array:
    """Return the probabilities of a part of the batch; subsets are of the less numerous kind."""
    pair = arithmetic.of_log(np.ascontiguousarray(log_odds.transpose(1, 2, 0)))
    miss = arithmetic.of_log(np.ascontiguousarray(missed.T))
    n_tracks, n_detections, size = pair.shape
    clutter = np.full((n_detections, size), arithmetic.one)
    result = np.empty((n_tracks, n_detections + 1, size))
    if n_tracks < n_detections:
        matched, _, left = _marginals(pair.swapaxes(0, 1), clutter, miss, arithmetic)
        result[:, 1:], result[:, 0] = matched.swapaxes(0, 1), left
    else:
        result[:, 1:], result[:, 0], _ = _marginals(pair, miss, clutter, arithmetic)
    return result.transpose(2, 0, 1)


def _marginals(
    pair: Array, alone: Array, unused: Array, arithmetic: Arithmetic
) -> tuple[Array, Array, Array]:
    """Return the probabilities of all pairs, and of items and of slots without a partner.

    Parameters
    ----------
    pair
        ``(I, J, B)``: weight of item i in slot j.
    alone
        ``(I, B)``: weight of an item in no slot.
    unused
        ``(J, B)``: weight of a slot that stays empty.
    """
    add, multiply = arithmetic.add, arithmetic.multiply
    n_items, n_slots, size = pair.shape
    state = np.full((1 << n_slots, size), arithmetic.zero)
    state[0] = arithmetic.one
    forward = [state]
    for i in range(n_items):
        before, state = state, multiply(state, alone[i])
        for j in range(n_slots):
            free, used = _without(before, j), _with(state, j)
            add(used, multiply(free, pair[i, j]), out=used)
        forward.append(state)

    state = np.full((1 << n_slots, size), arithmetic.one)
    for j in range(n_slots):
        free = _without(state, j)
        multiply(free, unused[j], out=free)
    complete = multiply(forward[-1], state)
    total = _summed(complete, add)
    left = np.array([_summed(_without(complete, j), add) for j in range(n_slots)])
    matched = np.empty((n_items, n_slots, size))
    single = np.empty((n_items, size))
    for i in reversed(range(n_items)):
        after = state
        single[i] = multiply(_summed(multiply(forward[i], after), add), alone[i])
        state = multiply(after, alone[i])
        for j in range(n_slots):
            free, used = _without(state, j), _with(after, j)
            joined = multiply(used, pair[i, j])
            matched[i, j] = _summed(multiply(_without(forward[i], j), joined), add)
            add(free, joined, out=free)
    left = left.reshape(n_slots, size)
    matched, single, left = (arithmetic.divide(part, total) for part in (matched, single, left))
    return arithmetic.number(matched), arithmetic.number(single), arithmetic.number(left)


def _without(state: Array, slot: int) -> Array:
    """Return the view of the subsets without a slot."""
    return state.reshape(-1, 2, 1 << slot, state.shape[-1])[:, 0]


def _with(state: Array, slot: int) -> Array:
    """Return the view of the subsets with a slot."""
    return state.reshape(-1, 2, 1 << slot, state.shape[-1])[:, 1]


def _summed(state: Array, add: np.ufunc) -> Array:
    """Return the sum over subsets, half by half: its bits do not depend on the batch."""
    state = state.reshape(-1, state.shape[-1])
    while len(state) > 1:
        half = len(state) // 2
        state = add(state[:half], state[half:])
    total: Array = state[0]
    return total
