"""Prices of detections: the dual variables of the best assignment of a scan.

At these prices, which are never negative and zero for detections that nobody has, each track's
detection in the best joint event is worth the most to it (linear programming duality of the
assignment problem; Bertsekas, Network Optimization, 1998, chapter 7).
"""

from __future__ import annotations

import numpy as np

from echobeam.tracking.association.nearest import nearest
from echobeam.tracking.association.pairs import Pairs
from echobeam.values import Array, IntArray


def price_range(log_odds: Array, missed: Array) -> tuple[Array, Array]:
    """Return logarithms of the least and of the greatest prices, ``(B, D)`` each.

    Prices between them, on the straight line, are prices as well.

    Parameters
    ----------
    log_odds, missed
        ``(B, C, D)`` and ``(B, C)``, as in `Pairs`.
    """
    gain = log_odds - missed[..., None]
    size, n_tracks, n_detections = gain.shape
    detection = nearest(Pairs(log_odds, missed))
    taken = detection >= 0
    own = np.where(taken, detection, n_detections)
    # A column more for a miss, and a row more for nobody: both are worth nothing.
    padded = np.pad(gain, ((0, 0), (0, 0), (0, 1)))
    worth = np.take_along_axis(padded, own[..., None], axis=2)[..., 0]
    owner = np.full((size, n_detections + 1), n_tracks)
    np.put_along_axis(owner, own, np.broadcast_to(np.arange(n_tracks), own.shape), axis=1)
    owner = owner[:, :n_detections]
    sold = np.pad(worth, ((0, 0), (0, 1)))
    least = _least(gain, worth, own)
    profit = _least(gain.swapaxes(1, 2), np.take_along_axis(sold, owner, axis=1), owner)
    greatest = np.take_along_axis(sold - np.pad(profit, ((0, 0), (0, 1))), owner, axis=1)
    return least, greatest


def _least(gain: Array, worth: Array, own: IntArray) -> Array:
    """Return the least prices ``(B, D)`` at which each bidder is content with its own.

    They are longest paths in the graph of exchanges, found as by Bellman and Ford: a round per
    bidder is enough.

    Parameters
    ----------
    gain
        ``(B, C, D)``: worth of each offer to each bidder, against nothing.
    worth, own
        ``(B, C)``: of its own offer, and which that is; D for nothing.
    """
    price = np.zeros((len(gain), gain.shape[2] + 1))
    for _ in range(gain.shape[1] + 1):
        profit = worth - np.take_along_axis(price, own, axis=1)
        bid = (gain - profit[..., None]).max(axis=1, initial=0.0)
        raised = np.maximum(price[:, :-1], bid)
        if np.array_equal(raised, price[:, :-1]):
            break
        price[:, :-1] = raised
    least: Array = price[:, :-1]
    return least
