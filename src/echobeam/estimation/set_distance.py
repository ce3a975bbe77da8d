"""Distances between a set of tracks and a set of objects: GOSPA and OSPA.

Both are metrics between finite sets. OSPA is a mean over the larger set: an error of cardinality
costs as much as a pair at the cutoff, and a missed object can hide a false track. GOSPA is a sum
that, with alpha = 2, falls into the errors of localised objects, missed objects and false tracks.

Rahmathullah, Garcia-Fernandez and Svensson, "Generalized optimal sub-pattern assignment metric",
Proc. Int. Conf. Information Fusion (2017); Schuhmacher, Vo and Vo, "A consistent metric for
performance evaluation of multi-object filters", IEEE Trans. Signal Process. 56 (2008).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.estimation.matching import UNMATCHED, capped_costs, match
from echobeam.faults import InputError
from echobeam.values import Array, BoolArray, IntArray


class SetDistance(NamedTuple):
    """GOSPA and its parts: ``total**order == localisation + missed + false``.

    Attributes
    ----------
    total
        ``(...)``: GOSPA, in the unit of the distances.
    localisation
        ``(...)``: sum over the matched pairs of their distance to the power of the order.
    missed, false
        ``(...)``: half the cutoff to the power of the order, for each unmatched object and for
        each unmatched track.
    matched
        ``(..., T)``: object of each track, or -1.
    """

    total: Array
    localisation: Array
    missed: Array
    false: Array
    matched: IntArray


def gospa(
    distance: Array,
    tracks: BoolArray,
    objects: BoolArray,
    cutoff: float,
    order: float = 2.0,
    alpha: float = 2.0,
) -> SetDistance:
    """Return the generalised optimal sub-pattern assignment metric of each pair of sets.

    GOSPA^p is the minimum over all matchings of the sum of d^p over the pairs, plus c^p / 2 for
    every track and every object without a partner: Proposition 1 of Rahmathullah et al.

    Parameters
    ----------
    distance
        ``(..., T, O)``: d, from a metric, of each track to each object. It may be anything, NaN
        too, where the track or the object does not exist.
    tracks, objects
        ``(..., T)`` and ``(..., O)``: which tracks and which objects exist.
    cutoff
        c, positive and finite, in the unit of the distances: a pair that far apart is a missed
        object and a false track.
    order
        p, at least 1 and finite; larger orders weigh large errors more.
    alpha
        2, the only value with which the metric falls into these parts.

    Raises
    ------
    InputError
        Another alpha, an order below 1, a cutoff that is not positive, shapes that do not fit, or
        a negative or undefined distance between an existing track and an existing object.
    """
    if alpha != 2.0:
        raise InputError(f"GOSPA falls into its parts for alpha = 2 only, not for {alpha}")
    localisation, found, matched = _matched_errors(distance, tracks, objects, cutoff, order)
    half = 0.5 * cutoff**order
    missed = half * (np.count_nonzero(objects, axis=-1) - found)
    false = half * (np.count_nonzero(tracks, axis=-1) - found)
    total = (localisation + missed + false) ** (1.0 / order)
    return SetDistance(total, localisation, missed, false, matched)


def ospa(
    distance: Array, tracks: BoolArray, objects: BoolArray, cutoff: float, order: float = 2.0
) -> Array:
    """Return the optimal sub-pattern assignment metric of each pair of sets, ``(...)``.

    With n elements in the larger set, OSPA^p is 1 / n times the least sum of min(d, c)^p over an
    assignment of the whole smaller set, plus c^p for each element that is left: Schuhmacher, Vo
    and Vo, Section III. It is at most c, and 0 between empty sets.

    Parameters
    ----------
    distance, tracks, objects, cutoff, order
        As in `gospa`, with the same errors.
    """
    error, found, _ = _matched_errors(distance, tracks, objects, cutoff, order)
    larger = np.maximum(np.count_nonzero(tracks, axis=-1), np.count_nonzero(objects, axis=-1))
    mean = (error + cutoff**order * (larger - found)) / np.maximum(larger, 1)
    result: Array = mean ** (1.0 / order)
    return result


def _matched_errors(
    distance: Array, tracks: BoolArray, objects: BoolArray, cutoff: float, order: float
) -> tuple[Array, IntArray, IntArray]:
    """Return the sum of d^p over the pairs of the best matching, their number, and the matching.

    Both metrics have the same best matching: to be assigned at the cutoff is to be unmatched.
    """
    if not 1.0 <= order < np.inf:
        raise InputError(f"the order must be at least 1 and finite, not {order}")
    if not 0.0 < cutoff < np.inf:
        raise InputError(f"the cutoff must be positive and finite, not {cutoff}")
    capped = capped_costs(distance, tracks, objects, cutoff)
    # in units of the cutoff: its power is exactly 1, so that a pair at the cutoff is never made
    matched = match((capped / cutoff) ** order, tracks, objects, 1.0)
    paired = matched != UNMATCHED
    errors = np.zeros(paired.shape)
    if capped.size > 0:
        partner = np.where(paired, matched, 0)
        errors = np.take_along_axis(capped, partner[..., None], axis=-1)[..., 0] ** order
    total: Array = np.sum(errors, axis=-1, where=paired)
    return total, np.count_nonzero(paired, axis=-1), matched
