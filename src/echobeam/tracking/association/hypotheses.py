"""Multiple hypotheses about which detections belonged to which tracks, over a window of scans.

Reid, An algorithm for tracking multiple targets, IEEE Trans. Automatic Control 24(6), 1979, with
the K best children of each hypothesis (Cox and Hingorani, An efficient implementation of Reid's
multiple hypothesis tracking algorithm, IEEE Trans. PAMI 18(2), 1996) and N-scan pruning (Blackman,
Multiple hypothesis tracking for multiple target tracking, IEEE AES Magazine 19(1), 2004). Here is
the bookkeeping alone: the caller has a filter for each hypothesis, takes for each child that of
its `Growth.parent`, and updates it with the detections of its `Growth.assignment`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import NamedTuple

import numpy as np

from echobeam.brief import Brief
from echobeam.faults import InputError
from echobeam.tracking.association.best import k_best
from echobeam.tracking.association.order import largest
from echobeam.tracking.association.pairs import Pairs
from echobeam.values import NOBODY, Array, BoolArray, IntArray


@dataclass(frozen=True, slots=True, repr=False)
class Hypotheses(Brief):
    """Hypotheses in descending order of their weights.

    Attributes
    ----------
    log_weight
        ``(..., H)``: logarithm of the probability; -inf where there is no hypothesis.
    history
        ``(..., H, W, C)``: the detection of each track in the last W scans, the latest last;
        `NOBODY` for a miss, and before the first scan.
    """

    log_weight: Array
    history: IntArray

    @property
    def alive(self) -> BoolArray:
        """``(..., H)``: whether there is a hypothesis."""
        alive: BoolArray = self.log_weight > -np.inf
        return alive


class Growth(NamedTuple):
    """Hypotheses after a scan, and where each came from.

    Attributes
    ----------
    hypotheses
        After the scan.
    parent
        ``(..., H)``: index of the hypothesis before the scan; 0 where there is none.
    assignment
        ``(..., H, C)``: the detection of each track in the scan, or `NOBODY`.
    """

    hypotheses: Hypotheses
    parent: IntArray
    assignment: IntArray


def first_hypotheses(lead: tuple[int, ...], columns: int, keep: int, window: int) -> Hypotheses:
    """Return the one certain hypothesis before the first scan.

    Parameters
    ----------
    lead
        Leading shape, as of trials.
    columns, keep, window
        Number of tracks C, of hypotheses H, and of scans W.
    """
    if min(keep, window) < 1:
        raise InputError(f"keep and window must be at least 1, not {keep} and {window}")
    log_weight = np.full((*lead, keep), -np.inf)
    log_weight[..., 0] = 0.0
    return Hypotheses(log_weight, np.full((*lead, keep, window, columns), NOBODY))


def grow(hypotheses: Hypotheses, pairs: Pairs, keep: int, window: int) -> Growth:
    """Return the hypotheses after a scan: the best children, merged, pruned and normalised.

    Each hypothesis has a child for each of its `keep` best joint events, so that the best of all
    children are exact. Children with the same assignments in the last `window` scans become one,
    the heaviest, with the sum of their weights. Children that differ from the best one in the scan
    `window` scans before this one are dropped. The rest has weights of sum one.

    Parameters
    ----------
    hypotheses
        Before the scan; a history shorter than the window is as if nothing had been detected.
    pairs
        ``(..., H, C, D)`` and ``(..., H, C)``: of the scan, under each hypothesis. Those of no
        hypothesis are not read.
    keep
        Number of hypotheses after the scan, H.
    window
        Number of scans for which decisions stay open, N.
    """
    if min(keep, window) < 1:
        raise InputError(f"keep and window must be at least 1, not {keep} and {window}")
    lead = hypotheses.log_weight.shape[:-1]
    n_before = hypotheses.log_weight.shape[-1]
    n_tracks = hypotheses.history.shape[-1]
    if pairs.missed.shape != (*lead, n_before, n_tracks):
        raise InputError(
            f"misses of shape {pairs.missed.shape} do not fit hypotheses: "
            f"{(*lead, n_before, n_tracks)} is needed"
        )
    if not hypotheses.alive.any(axis=-1).all():
        raise InputError("each batch needs a hypothesis of finite weight")
    size = prod(lead)
    before = hypotheses.log_weight.reshape(size, n_before)
    history = hypotheses.history.reshape(size, n_before, -1, n_tracks)
    event, log_weight = _children(before, pairs, keep)
    index, log_weight = largest(log_weight.reshape(size, -1), keep)
    parent, child = np.divmod(index, keep)
    row = np.arange(size)[:, None]
    assignment = event[row, parent, child]
    history = _extended(history[row, parent], assignment, window)

    log_weight = _merged(log_weight, history[:, :, 1:])
    order = np.argsort(-log_weight, axis=-1, kind="stable")
    log_weight = _pruned(log_weight[row, order], history[row, order, 0])
    # Stable sorting twice: the dropped ones go behind, the order of the others stays.
    again = np.argsort(-log_weight, axis=-1, kind="stable")
    log_weight, order = log_weight[row, again], order[row, again]
    alive = log_weight > -np.inf
    parent = np.where(alive, parent[row, order], 0)
    assignment = np.where(alive[..., None], assignment[row, order], NOBODY)
    history = np.where(alive[..., None, None], history[row, order, 1:], NOBODY)
    return Growth(
        Hypotheses(log_weight.reshape(*lead, keep), history.reshape(*lead, keep, window, n_tracks)),
        parent.reshape(*lead, keep),
        assignment.reshape(*lead, keep, n_tracks),
    )


def marginal(hypotheses: Hypotheses, n_detections: int) -> Array:
    """Return the association probabilities of the latest scan, ``(..., C, D + 1)``.

    Parameters
    ----------
    hypotheses
        After the scan.
    n_detections
        Number of columns of the scan, D.

    Returns
    -------
    Array
        As of `association_probabilities`: [..., 0] is a miss.
    """
    weight = np.exp(hypotheses.log_weight)[..., None, None]
    latest = hypotheses.history[..., -1, :, None]
    chosen = latest == np.arange(NOBODY, n_detections)
    total: Array = np.where(chosen, weight, 0.0).sum(axis=-3)
    return total


def _children(before: Array, pairs: Pairs, keep: int) -> tuple[IntArray, Array]:
    """Return the events ``(B, H, K, C)`` and log weights ``(B, H, K)`` of all children."""
    size, n_before = before.shape
    n_tracks, n_detections = pairs.log_odds.shape[-2:]
    event = np.full((size, n_before, keep, n_tracks), NOBODY)
    log_weight = np.full((size, n_before, keep), -np.inf)
    alive = before > -np.inf
    log_odds = pairs.log_odds.reshape(size, n_before, n_tracks, n_detections)
    missed = pairs.missed.reshape(size, n_before, n_tracks)
    event[alive], found = k_best(Pairs(log_odds[alive], missed[alive]), keep)
    log_weight[alive] = before[alive][:, None] + found
    return event, log_weight


def _extended(history: IntArray, assignment: IntArray, window: int) -> IntArray:
    """Return histories ``(B, H, N + 1, C)`` that end with the scan's assignments."""
    size, keep, length, n_tracks = history.shape
    unknown = np.full((size, keep, max(0, window - length), n_tracks), NOBODY)
    recent = history[:, :, max(0, length - window) :]
    return np.concatenate([unknown, recent, assignment[:, :, None]], axis=2)


def _merged(log_weight: Array, history: IntArray) -> Array:
    """Return weights ``(B, H)``, descending: the first of equal histories has the sum of them."""
    alive = log_weight > -np.inf
    same = alive[:, :, None] & alive[:, None, :]
    flat = history.reshape(*history.shape[:2], -1)
    for entry in range(flat.shape[2]):
        same &= flat[:, :, None, entry] == flat[:, None, :, entry]
    leads = same.argmax(axis=2) == np.arange(log_weight.shape[1])
    relative = np.exp(log_weight - log_weight[:, :1])
    total = np.where(same, relative[:, None, :], 0.0).sum(axis=2)
    with np.errstate(divide="ignore"):  # no hypothesis: -inf
        together = np.log(total) + log_weight[:, :1]
    return np.where(leads & alive, together, -np.inf)


def _pruned(log_weight: Array, oldest: IntArray) -> Array:
    """Return normalised weights of the hypotheses that agree with the first one's oldest scan."""
    agrees = (oldest == oldest[:, :1]).all(axis=-1)
    log_weight = np.where(agrees, log_weight, -np.inf)
    highest = log_weight[:, :1]
    total = np.exp(log_weight - highest).sum(axis=-1, keepdims=True)
    normal: Array = log_weight - highest - np.log(total)
    return normal
