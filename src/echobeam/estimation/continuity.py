"""Continuity of unlabelled tracks over a run: switches, delays, gaps, false and missing tracks.

All functions read the same record of N slots: which track each column holds and whether it is
confirmed, to which object it is matched, and which objects are present. Only confirmed tracks
count. Results are for each trial; delays and gaps are in slots.

Match the confirmed tracks alone, since a tentative one would take an object away from them, and by
`correspondence.correspond`: the best matching of each slot for itself (`set_distance.gospa`) swaps
tracks that stay on their objects wherever these are closer than the errors.

Switches are those of CLEAR MOT: Bernardin and Stiefelhagen, "Evaluating multiple object tracking
performance: the CLEAR MOT metrics", EURASIP J. Image Video Process. (2008).
"""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import quotient
from echobeam.estimation.matching import UNMATCHED
from echobeam.faults import InputError
from echobeam.values import NOBODY, Array, BoolArray, IntArray


def identity_switches(
    identity: IntArray, confirmed: BoolArray, matched: IntArray, present: BoolArray
) -> IntArray:
    """Return how often an object's track differs from the one it had last, ``(...)``.

    The last track is remembered over gaps, so a track that is lost and started anew under another
    identity counts once.

    Parameters
    ----------
    identity
        ``(..., N, T)``: identity of the track in each column; `NOBODY` where it is empty.
    confirmed
        ``(..., N, T)``: whether the column holds a confirmed track.
    matched
        ``(..., N, T)``: column of the object that the track is matched to, or -1. It may be
        anything where there is no confirmed track.
    present
        ``(..., N, O)``: whether the object is there. The leading axes of all arrays are
        broadcast.

    Raises
    ------
    InputError
        Shapes that do not fit, a confirmed track that is nobody's or is matched to an object that
        is not present, or an object with two confirmed tracks in one slot.
    """
    holder = _holders(identity, confirmed, matched, present)
    *batch, slots, objects = holder.shape
    last = np.full((*batch, objects), NOBODY)
    switches = np.zeros(batch, dtype=np.int64)
    for slot in range(slots):
        now = holder[..., slot, :]
        changed = (now != NOBODY) & (last != NOBODY) & (now != last)
        switches += np.count_nonzero(changed, axis=-1)
        last = np.where(now != NOBODY, now, last)
    return switches


def detection_delay(confirmed: BoolArray, matched: IntArray, present: BoolArray) -> Array:
    """Return the slots from an object's first presence to its first confirmed track, ``(..., O)``.

    It is 0 if the object is matched at once, NaN if it never is.

    Parameters
    ----------
    confirmed, matched, present
        As in `identity_switches`, with the same errors.
    """
    tracked = tracked_objects(confirmed, matched, present)
    here = np.broadcast_to(present, tracked.shape)
    if tracked.shape[-2] == 0:
        return np.full((*tracked.shape[:-2], tracked.shape[-1]), np.nan)
    delay = np.argmax(tracked, axis=-2) - np.argmax(here, axis=-2)
    return np.where(tracked.any(axis=-2), delay.astype(np.float64), np.nan)


def reacquisition(confirmed: BoolArray, matched: IntArray, present: BoolArray) -> Array:
    """Return the mean length of the gaps in the tracks of objects, in slots, ``(...)``.

    A gap begins when an object that was matched is present without a match, and ends when it is
    matched again. Slots in which it is absent do not count; a track that is lost for good leaves
    no gap. NaN without gaps.

    Parameters
    ----------
    confirmed, matched, present
        As in `identity_switches`, with the same errors.
    """
    tracked = tracked_objects(confirmed, matched, present)
    here = np.broadcast_to(present, tracked.shape)
    batch, objects = tracked.shape[:-2], tracked.shape[-1]
    seen = np.zeros((*batch, objects), dtype=bool)
    run = np.zeros((*batch, objects), dtype=np.int64)
    length, gaps = np.zeros(batch, dtype=np.int64), np.zeros(batch, dtype=np.int64)
    for slot in range(tracked.shape[-2]):
        now = tracked[..., slot, :]
        length += np.sum(run, axis=-1, where=now)
        gaps += np.count_nonzero(now & (run > 0), axis=-1)
        seen |= now
        run = np.where(now, 0, run + (seen & here[..., slot, :]))
    return quotient(length, gaps)


def false_tracks(identity: IntArray, confirmed: BoolArray, matched: IntArray) -> IntArray:
    """Return the number of identities that were confirmed for nobody, ``(...)``.

    A track is false if in more than half of the slots in which it is confirmed it is matched to no
    object.

    Parameters
    ----------
    identity, confirmed, matched
        As in `identity_switches`.

    Raises
    ------
    InputError
        Shapes that do not fit, a confirmed track without identity, or one matched below -1.
    """
    identity, confirmed, matched = _columns(identity, confirmed, matched)
    *batch, slots, columns = identity.shape
    trials = int(np.prod(batch))
    trial = np.flatnonzero(confirmed) // max(slots * columns, 1)
    owners = np.stack([trial, identity[confirmed]], axis=-1)
    tracks, of = np.unique(owners, axis=0, return_inverse=True)
    alone = np.bincount(of.ravel(), matched[confirmed] == UNMATCHED, minlength=len(tracks))
    all_slots = np.bincount(of.ravel(), minlength=len(tracks))
    false = tracks[2 * alone > all_slots, 0]
    return np.bincount(false, minlength=trials).reshape(batch)


def tracked_objects(confirmed: BoolArray, matched: IntArray, present: BoolArray) -> BoolArray:
    """Return whether each object has a confirmed track in each slot, ``(..., N, O)``.

    Parameters
    ----------
    confirmed, matched, present
        As in `identity_switches`, with the same errors.
    """
    tracked: BoolArray = _holders(np.zeros_like(matched), confirmed, matched, present) != NOBODY
    return tracked


def _holders(
    identity: IntArray, confirmed: BoolArray, matched: IntArray, present: BoolArray
) -> IntArray:
    """Return the identity of the confirmed track of each object, `NOBODY` without, (..., N, O)."""
    identity, confirmed, matched = _columns(identity, confirmed, matched)
    slots, columns = confirmed.shape[-2:]
    here = np.asarray(present, dtype=bool)
    if here.shape[-2:-1] != (slots,):
        raise InputError(f"present needs {slots} slots and the objects, not {here.shape}")
    objects = here.shape[-1]
    if np.any(confirmed & (matched >= objects)):
        raise InputError(f"a confirmed track is matched beyond the {objects} objects")
    try:
        batch = np.broadcast_shapes(confirmed.shape[:-2], here.shape[:-2])
    except ValueError as fault:
        raise InputError("the trials of present are not those of the tracks") from fault
    holder = np.full((*batch, slots, objects), NOBODY)
    for column in range(columns):
        partner = np.where(confirmed[..., column], matched[..., column], UNMATCHED)
        mine = partner[..., None] == np.arange(objects)
        if np.any(mine & ~here):
            raise InputError("a confirmed track is matched to an object that is not present")
        if np.any(mine & (holder != NOBODY)):
            raise InputError("an object is matched to two confirmed tracks in one slot")
        holder = np.where(mine, identity[..., column, None], holder)
    return holder


def _columns(
    identity: IntArray, confirmed: BoolArray, matched: IntArray
) -> tuple[IntArray, BoolArray, IntArray]:
    """Return the record of the columns, validated, with its leading axes broadcast."""
    shapes = [np.shape(one)[-2:] for one in (identity, confirmed, matched)]
    if len(set(shapes)) > 1 or len(shapes[0]) < 2:
        raise InputError(f"identity, confirmed, matched need axes (..., N, T), not {shapes}")
    try:
        given = np.broadcast_arrays(identity, np.asarray(confirmed, dtype=bool), matched)
    except ValueError as fault:
        raise InputError("the trials of identity, confirmed and matched differ") from fault
    if np.any(given[1] & (given[0] <= NOBODY)):
        raise InputError("a confirmed track has no identity")
    if np.any(given[1] & (given[2] < UNMATCHED)):
        raise InputError(f"a confirmed track is matched to an object below {UNMATCHED}")
    return given[0], given[1], given[2]
