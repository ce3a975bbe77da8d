"""Association probabilities by belief propagation, where exact sums are out of reach.

Williams and Lau, Approximate evaluation of marginal association probabilities with belief
propagation, IEEE Trans. Aerospace and Electronic Systems 50(4), 2014: each track sends each of its
detections the odds that it has it, and each detection answers. The result is exact where the graph
of possible pairs has no cycle, and the iteration always converges (ibid., section IV).

It starts from prices of the best assignment, half-way between the least and the greatest. From
equal messages it creeps where nearly nothing is missed: messages then have to fall by the whole
range of the odds, one unit of their logarithm or less at a time.
"""

from __future__ import annotations

import numpy as np

from echobeam.tracking.association.arithmetic import LINEAR, LOGARITHMIC, Arithmetic, scaled
from echobeam.tracking.association.prices import price_range
from echobeam.values import Array

TOLERANCE = 1e-10
"""Largest change of a probability in `_BETWEEN_CHECKS` iterations at which a scan has converged."""

MOST_ITERATIONS = 5000
_BETWEEN_CHECKS = 10


def believed_probabilities(log_odds: Array, missed: Array) -> Array:
    """Return approximate probabilities of each track's partners, ``(B, C, D + 1)``.

    Each track's sum is one. Scans that have converged leave the iteration, so that no number
    depends on the others.

    In 99 % of random scans of six tracks and six detections the largest error of a probability is
    below 0.07 for log odds of standard deviation 1, and below 0.17 for 3; the largest in 80,000
    such scans each was 0.18 and 0.34. After `MOST_ITERATIONS` detections have 1e-4 of a track too
    much at most, for log odds of any standard deviation up to 170 and misses down to e^-300; only
    exact ties between odds of hundreds of nats stay unresolved.

    Parameters
    ----------
    log_odds, missed
        ``(B, C, D)`` and ``(B, C)``, as in `Pairs`.
    """
    size, n_tracks, n_detections = log_odds.shape
    log_odds, missed, _ = scaled(log_odds, missed)
    # A message is at most the ratio of two weights of one track: plain numbers hold it if each
    # track's own ratio is moderate.
    wide = -missed.min(axis=-1, initial=0.0) > 600.0
    result = np.empty((size, n_tracks, n_detections + 1))
    for arithmetic, rows in ((LINEAR, ~wide), (LOGARITHMIC, wide)):
        if rows.any():
            result[rows] = _iterated(log_odds[rows], missed[rows], arithmetic)
    return result


def _iterated(log_odds: Array, missed: Array, arithmetic: Arithmetic) -> Array:
    """Return the probabilities after the iteration."""
    pair, miss = arithmetic.of_log(log_odds), arithmetic.of_log(missed)[..., None]
    least, greatest = price_range(log_odds, missed)
    middle = 0.5 * (least + greatest)[:, None, :]
    answer = arithmetic.of_log(np.broadcast_to(-middle, pair.shape))
    result = _probabilities(pair, miss, answer, arithmetic)
    active = np.arange(len(pair))
    for _ in range(MOST_ITERATIONS // _BETWEEN_CHECKS):
        for _ in range(_BETWEEN_CHECKS):
            answer = _answers(pair, miss, answer, arithmetic)
        now = _probabilities(pair, miss, answer, arithmetic)
        change = np.abs(now - result[active]).max(axis=(1, 2), initial=0.0)
        result[active] = now
        left = change > TOLERANCE
        if not left.any():
            break
        active, pair, miss, answer = active[left], pair[left], miss[left], answer[left]
    return result


def _answers(pair: Array, miss: Array, answer: Array, arithmetic: Arithmetic) -> Array:
    """Return the detections' messages after one from each track, and back."""
    add, multiply, divide = arithmetic.add, arithmetic.multiply, arithmetic.divide
    others = add(miss, _but_one(multiply(pair, answer), 2, arithmetic))
    asked = divide(pair, others)
    rivals = _but_one(asked, 1, arithmetic)
    answered: Array = divide(arithmetic.one, add(arithmetic.one, rivals))
    return answered


def _but_one(weight: Array, axis: int, arithmetic: Arithmetic) -> Array:
    """Return the sum of all others along an axis, without a subtraction that cancels."""
    weight = np.moveaxis(weight, axis, 0)
    zero = np.full((1, *weight.shape[1:]), arithmetic.zero)
    below = arithmetic.add.accumulate(np.concatenate([zero, weight[:-1]]), axis=0)
    above = arithmetic.add.accumulate(np.concatenate([zero, weight[:0:-1]]), axis=0)[::-1]
    return np.moveaxis(arithmetic.add(below, above), 0, axis)


def _probabilities(pair: Array, miss: Array, answer: Array, arithmetic: Arithmetic) -> Array:
    """Return each track's belief."""
    weight = np.concatenate([miss, arithmetic.multiply(pair, answer)], axis=2)
    total = arithmetic.add.accumulate(weight, axis=2)[..., -1:]
    return arithmetic.number(arithmetic.divide(weight, total))
