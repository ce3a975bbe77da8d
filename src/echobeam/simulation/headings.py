"""Headings of objects: the direction of travel, which one at rest has from its last motion."""

from __future__ import annotations

import numpy as np

from echobeam.simulation.movers import Ground
from echobeam.values import NOBODY, Array, IntArray

ALONG = np.array([1.0, 0.0, 0.0])
"""Heading of an object that has not moved yet: the road's direction."""


def headings(ground: Ground, identity: IntArray, before: Array | None) -> Array:
    """Return a vector along each object's heading, ``(T or 1, K, 3)``: its velocity, or the last.

    Parameters
    ----------
    ground
        The objects; the velocity itself is returned if all of them move.
    identity, before
        ``(K,)`` and ``(T or 1, K, 3)``: who was in each column in the slot before, and the
        headings then; None in the first slot.
    """
    moving = (ground.velocity != 0.0).any(axis=-1)  # NaN differs from zero
    if moving.all():
        return ground.velocity
    if before is None:
        last: Array = np.broadcast_to(ALONG, ground.velocity.shape)
    else:
        same = (ground.identity[:, None] == identity) & (ground.identity != NOBODY)[:, None]
        known = same.any(axis=-1)[:, None] & np.isfinite(before[:, np.argmax(same, axis=-1)])
        last = np.where(known, before[:, np.argmax(same, axis=-1)], ALONG)
    return np.where(moving[..., None], ground.velocity, last)
