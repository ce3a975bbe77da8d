"""Tracks of an unknown number of objects: their columns, their identities and their life.

A track is tentative from its first detection. It is confirmed once M of its first N lit slots gave
a detection, and deleted as soon as they cannot. A confirmed track is coasting while it is lit and
not detected, and deleted after some such slots in a row. Columns of deleted tracks are used again;
identities are not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echobeam.brief import Brief
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    GaussianState,
    IntArray,
    ModeArray,
    Status,
    Tracks,
    aligned,
)


@dataclass(frozen=True, slots=True)
class LifeRules:
    """Rules of a track's life.

    Attributes
    ----------
    confirm, window
        M and N: detections that confirm a track, of its first N slots in which it was lit.
    coast
        Slots in a row without a detection, though lit, after which a track is deleted.
    """

    confirm: int
    window: int
    coast: int


@dataclass(frozen=True, slots=True, repr=False)
class Bank(Brief):
    """Tracks of a block of trials, in ``C`` columns; ``H`` hypotheses, the likeliest first.

    Attributes
    ----------
    state
        ``(T, H, C)`` tracks: the belief of each hypothesis about each of them.
    id
        ``(T, C)``: identity, counted from 0 in each trial; `NOBODY` in an empty column.
    status
        ``(T, C)`` `Status`.
    hits, tried
        ``(T, C)``: detections, and slots in which it was lit, the first detection included.
    missed
        ``(T, C)``: lit slots in a row without a detection.
    spread
        ``(T, C)`` rad: standard deviation of the last measured angle, or ``(T, C, 2)`` of two
        direction cosines.
    next_id
        ``(T, C)``: identity of the next track in each column.
    """

    state: GaussianState
    id: IntArray
    status: ModeArray
    hits: IntArray
    tried: IntArray
    missed: IntArray
    spread: Array
    next_id: IntArray

    @property
    def roster(self) -> IntArray:
        """``(T, C)``: identities, in an empty column that of the next track."""
        return np.where(self.id == NOBODY, self.next_id, self.id)

    @property
    def tracks(self) -> Tracks:
        """The tracks of the likeliest hypothesis."""
        mean, cov = self.state.mean[:, 0], self.state.cov[:, 0]
        known = self.state.known[:, 0]
        status = np.where(known, self.status, Status.NONE).astype(np.int8)
        return Tracks(mean, cov, status, np.where(known, self.id, NOBODY))


def empty(
    trials: int, columns: int, size: int, hypotheses: int = 1, spread: tuple[int, ...] = ()
) -> Bank:
    """Return a bank without tracks.

    ``size`` is the number of components of a state, ``spread`` the shape of a direction's.
    """
    shape = (trials, columns)
    return Bank(
        state=GaussianState(
            mean=np.full((trials, hypotheses, columns, size), np.nan),
            cov=np.full((trials, hypotheses, columns, size, size), np.nan),
            known=np.zeros((trials, hypotheses, columns), dtype=bool),
        ),
        id=np.full(shape, NOBODY),
        status=np.zeros(shape, dtype=np.int8),
        hits=np.zeros(shape, dtype=np.int64),
        tried=np.zeros(shape, dtype=np.int64),
        missed=np.zeros(shape, dtype=np.int64),
        spread=np.full((*shape, *spread), np.nan),
        next_id=np.tile(np.arange(columns), (trials, 1)),
    )


def pruned(bank: Bank) -> Bank:
    """Return the bank without the tracks that the likeliest hypothesis has given up."""
    return _without(bank, (bank.id != NOBODY) & ~bank.state.known[:, 0])


def aged(bank: Bank, detected: BoolArray, lit: BoolArray, rules: LifeRules) -> Bank:
    """Return the bank one slot older.

    Parameters
    ----------
    bank
        The tracks.
    detected
        ``(T, C)``: whether a detection is taken to be the track's.
    lit
        ``(T, C)``: whether one was to be expected; a slot in which a track is not lit says
        nothing about it.
    rules
        Rules of life.
    """
    there = bank.id != NOBODY
    detected = detected & there
    counted = there & (lit | detected)
    missed = np.where(detected, 0, bank.missed + counted)
    hits, tried = bank.hits + detected, bank.tried + counted
    confirmed = (bank.status >= Status.CONFIRMED) | (hits >= rules.confirm)
    alive = np.where(missed > 0, Status.COASTING, Status.CONFIRMED)
    status = np.where(there, np.where(confirmed, alive, Status.TENTATIVE), Status.NONE)
    hopeless = ~confirmed & (hits + rules.window - tried < rules.confirm)
    older = replace(bank, status=status.astype(np.int8), hits=hits, tried=tried, missed=missed)
    return _without(older, there & (hopeless | (confirmed & (missed >= rules.coast))))


def with_births(
    bank: Bank,
    free: BoolArray,
    first: GaussianState,
    new: BoolArray,
    spread: Array,
    rules: LifeRules,
) -> tuple[Bank, IntArray]:
    """Return the bank with new tracks in free columns, as many as there are.

    Parameters
    ----------
    bank
        The tracks.
    free
        ``(T, C)``: columns that a track may begin in.
    first
        ``(T, D)`` first states.
    new
        ``(T, D)``: which of them begin a track; where columns are short, the first ones do.
    spread
        ``(T, D)`` rad: standard deviation of the measured angle, or ``(T, D, 2)`` of two cosines.
    rules
        Rules of life: one detection may be enough.

    Returns
    -------
    bank, source
        ``source`` ``(T, C)``: the detection that began a track in each column; -1 none.
    """
    source = np.full(free.shape, -1)
    new = new & first.known
    order = np.cumsum(new, axis=-1) - 1
    new = new & (order < free.sum(axis=-1)[:, None])
    if not new.any():
        return bank, source
    trial, detection = np.nonzero(new)
    place = np.argsort(~free, axis=-1, kind="stable")  # free columns first, in their order
    source[trial, place[trial, order[trial, detection]]] = detection
    begins = source >= 0
    index = np.maximum(source, 0)
    mean = np.take_along_axis(first.mean, index[..., None], axis=1)[:, None]
    cov = np.take_along_axis(first.cov, index[..., None, None], axis=1)[:, None]
    here, state = begins[:, None], bank.state
    once = Status.CONFIRMED if rules.confirm == 1 else Status.TENTATIVE
    highest = bank.next_id.max(axis=-1, keepdims=True)
    begun = Bank(
        state=GaussianState(
            mean=np.where(here[..., None], mean, state.mean),
            cov=np.where(here[..., None, None], cov, state.cov),
            known=state.known | here,
        ),
        id=np.where(begins, bank.next_id, bank.id),
        status=np.where(begins, once, bank.status).astype(np.int8),
        hits=np.where(begins, 1, bank.hits),
        tried=np.where(begins, 1, bank.tried),
        missed=np.where(begins, 0, bank.missed),
        spread=np.where(
            aligned(begins, bank.spread),
            np.take_along_axis(spread, index.reshape(aligned(begins, spread).shape), axis=1),
            bank.spread,
        ),
        next_id=np.where(begins, highest + np.cumsum(begins, axis=-1), bank.next_id),
    )
    return begun, source


def _without(bank: Bank, gone: BoolArray) -> Bank:
    if not gone.any():
        return bank
    state, everywhere = bank.state, gone[:, None]
    return replace(
        bank,
        state=GaussianState(
            mean=np.where(everywhere[..., None], np.nan, state.mean),
            cov=np.where(everywhere[..., None, None], np.nan, state.cov),
            known=state.known & ~everywhere,
        ),
        id=np.where(gone, NOBODY, bank.id),
        status=np.where(gone, Status.NONE, bank.status).astype(np.int8),
        hits=np.where(gone, 0, bank.hits),
        tried=np.where(gone, 0, bank.tried),
        missed=np.where(gone, 0, bank.missed),
        spread=np.where(aligned(gone, bank.spread), np.nan, bank.spread),
    )
