"""Correspondence of tracks and objects over a run, which lasts as long as it is valid.

The best matching of each slot for itself changes its mind whenever two objects are closer to each
other than the errors of their tracks, though every track stays on its object. Switches of identity
are therefore counted on correspondences that persist: Bernardin and Stiefelhagen, "Evaluating
multiple object tracking performance: the CLEAR MOT metrics", EURASIP J. Image Video Process.
(2008), Section 2.1.
"""

from __future__ import annotations

import numpy as np

from echobeam.estimation.matching import UNMATCHED, capped_costs, match
from echobeam.faults import InputError
from echobeam.values import NOBODY, Array, BoolArray, IntArray


def correspond(
    distance: Array, identity: IntArray, tracks: BoolArray, objects: BoolArray, cutoff: float
) -> IntArray:
    """Return the object of each track in each slot, ``(..., N, T)``, or -1.

    A track keeps the object that it had last, also over a gap, if both exist, the distance is
    below the cutoff and neither had another partner since. All others are matched by `match` at
    the sum of their distances.

    Parameters
    ----------
    distance
        ``(..., N, T, O)``: distance of each track to each object. It may be anything, NaN too,
        where the track or the object does not exist.
    identity
        ``(..., N, T)``: identity of the track in each column, different in all columns of a slot.
    tracks, objects
        ``(..., N, T)`` and ``(..., N, O)``: which tracks, such as the confirmed ones, and which
        objects exist. The leading axes of all arrays are broadcast.
    cutoff
        Positive and finite, in the unit of the distances.

    Raises
    ------
    InputError
        Shapes that do not fit, a cutoff that is not positive and finite, a track without identity
        or in two columns of one slot, or a negative or undefined distance between an existing
        track and an existing object.
    """
    if not 0.0 < cutoff < np.inf:
        raise InputError(f"the cutoff must be positive and finite, not {cutoff}")
    capped = capped_costs(distance, tracks, objects, cutoff)
    if capped.ndim < 3:
        raise InputError(f"the distances need the axes (..., N, T, O), not {capped.shape}")
    try:
        name = np.where(tracks, identity, NOBODY)
        name = np.broadcast_to(name, capped.shape[:-1])
        there = np.broadcast_to(tracks, name.shape)
        here = np.broadcast_to(objects, (*capped.shape[:-2], capped.shape[-1]))
    except ValueError as fault:
        raise InputError("the shape of identity is not that of tracks") from fault
    _check_identities(name, there)
    matched = np.full(name.shape, UNMATCHED, dtype=np.int64)
    holder = np.full((*here.shape[:-2], here.shape[-1]), NOBODY)
    for slot in range(name.shape[-2]):
        now, cost = name[..., slot, :], capped[..., slot, :, :]
        same = now[..., :, None] == holder[..., None, :]
        lasting = same & (cost < cutoff)  # empty columns are at the cutoff
        partner = match(
            cost,
            there[..., slot, :] & ~lasting.any(axis=-1),
            here[..., slot, :] & ~lasting.any(axis=-2),
            cutoff,
        )
        pairs = lasting | (partner[..., None] == np.arange(cost.shape[-1]))
        column = np.sum(pairs * np.arange(cost.shape[-1]), axis=-1)
        matched[..., slot, :] = np.where(pairs.any(axis=-1), column, UNMATCHED)
        holder = _next_holders(holder, now, pairs)
    return matched


def _next_holders(holder: IntArray, now: IntArray, pairs: BoolArray) -> IntArray:
    """Return each object's last track, ``(..., O)``, unless that has another object now."""
    taken = (now[..., :, None] == holder[..., None, :]) & pairs.any(axis=-1, keepdims=True)
    left = np.where(taken.any(axis=-2), NOBODY, holder)
    held: IntArray = np.max(np.where(pairs, now[..., None], NOBODY), axis=-2, initial=NOBODY)
    return np.where(held != NOBODY, held, left)


def _check_identities(name: IntArray, there: BoolArray) -> None:
    """Raise if a track has no identity, or one that another column of the slot has too."""
    if np.any(there & (name <= NOBODY)):
        raise InputError("a track that exists has no identity")
    ordered = np.sort(name, axis=-1)
    if np.any((ordered[..., 1:] == ordered[..., :-1]) & (ordered[..., 1:] != NOBODY)):
        raise InputError("a track is in two columns of one slot")
