"""Assignment of tracks to objects at least total cost, for a batch of independent problems."""

from __future__ import annotations

import numpy as np

from echobeam.faults import InputError
from echobeam.values import Array, BoolArray, IntArray

UNMATCHED = -1
"""Partner of a track that is matched to no object."""


def match(cost: Array, tracks: BoolArray, objects: BoolArray, cutoff_cost: float) -> IntArray:
    """Return the object of each track, ``(..., T)``, or `UNMATCHED`.

    The sum of the costs of all pairs, plus half the cutoff for every track and every object
    without a partner, is as small as possible; of several such matchings one is returned. A pair
    whose cost reaches the cutoff is never made, since it is no better than two unmatched ones.

    Parameters
    ----------
    cost
        ``(..., T, O)``: cost of each pair, not negative; infinite where a pair is impossible. It
        may be anything, NaN too, where the track or the object does not exist.
    tracks, objects
        ``(..., T)`` and ``(..., O)``: which tracks and which objects exist. The leading axes of
        the three arrays are broadcast.
    cutoff_cost
        Positive and finite: cost of leaving both a track and an object unmatched.

    Raises
    ------
    InputError
        Shapes that do not fit, a cutoff that is not positive and finite, or a pair of an existing
        track and an existing object whose cost is negative or NaN.
    """
    if not 0.0 < cutoff_cost < np.inf:
        raise InputError(f"the cutoff must be positive and finite, not {cutoff_cost}")
    capped = capped_costs(cost, tracks, objects, cutoff_cost)
    if capped.size == 0:
        return np.full(capped.shape[:-1], UNMATCHED, dtype=np.int64)
    matched = _least_assignment(capped.reshape(-1, *capped.shape[-2:]), cutoff_cost)
    return matched.reshape(capped.shape[:-1])


def capped_costs(cost: Array, tracks: BoolArray, objects: BoolArray, cutoff: float) -> Array:
    """Return the costs ``(..., T, O)`` up to a cutoff; at the cutoff where a pair cannot be.

    Parameters
    ----------
    cost, tracks, objects
        As in `match`, with the same errors.
    cutoff
        Positive and finite.
    """
    cost = np.asarray(cost, dtype=np.float64)
    tracks, objects = np.asarray(tracks, dtype=bool), np.asarray(objects, dtype=bool)
    if cost.ndim < 2 or tracks.shape[-1:] != cost.shape[-2:-1]:
        raise InputError(f"costs {cost.shape} need tracks (..., T), not {tracks.shape}")
    if objects.shape[-1:] != cost.shape[-1:]:
        raise InputError(f"costs {cost.shape} need objects (..., O), not {objects.shape}")
    try:
        exists = np.broadcast_arrays(tracks[..., :, None] & objects[..., None, :], cost)[0]
    except ValueError as fault:
        shapes = f"{cost.shape}, {tracks.shape} and {objects.shape}"
        raise InputError(f"the leading axes of {shapes} cannot be broadcast") from fault
    if np.any(exists & ~(cost >= 0.0)):
        raise InputError("a pair of an existing track and object has a negative cost or NaN")
    capped: Array = np.where(exists & (cost < cutoff), cost, cutoff)
    return capped


def _least_assignment(capped: Array, cutoff: float) -> IntArray:
    """Return the objects ``(problem, T)`` that match costs ``(problem, T, O)`` best.

    With costs up to the cutoff every full assignment of the shorter side has the cost of a
    matching but for a constant: to be assigned at the cutoff is to be unmatched. No assignment
    costs less than every track at its cheapest object, so where these objects are distinct the
    problem is decided, and by symmetry with objects at their cheapest tracks. The others, in
    which several compete on both sides, are solved one by one (Crouse, "On implementing 2D
    rectangular assignment algorithms", IEEE Trans. Aerosp. Electron. Syst. 52 (2016)).
    """
    from scipy.optimize import linear_sum_assignment

    partner, decided = _cheapest(capped, cutoff)
    back, decided_back = _cheapest(np.swapaxes(capped, 1, 2), cutoff)
    found = ~decided[:, None] & decided_back[:, None] & (back != UNMATCHED)
    partner[~decided] = UNMATCHED
    problem, column = np.nonzero(found)
    partner[problem, back[problem, column]] = column
    for one in np.flatnonzero(~decided & ~decided_back):
        rows, columns = linear_sum_assignment(capped[one])
        partner[one, rows] = np.where(capped[one, rows, columns] < cutoff, columns, UNMATCHED)
    return partner


def _cheapest(capped: Array, cutoff: float) -> tuple[IntArray, BoolArray]:
    """Return the cheapest column of each row below the cutoff, and whether these are distinct."""
    column = np.argmin(capped, axis=-1)
    possible = np.take_along_axis(capped, column[..., None], axis=-1)[..., 0] < cutoff
    column = np.where(possible, column, UNMATCHED)
    ordered = np.sort(column, axis=-1)
    again = (ordered[:, 1:] == ordered[:, :-1]) & (ordered[:, 1:] != UNMATCHED)
    return column, ~again.any(axis=-1)
