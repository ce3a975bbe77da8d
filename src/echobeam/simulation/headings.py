"""Headings of objects: the direction of travel, or at rest that of the last or the next motion."""

from __future__ import annotations

import numpy as np

from echobeam.simulation.movers import Ground, Mover
from echobeam.values import NOBODY, Array, IntArray


def headings(
    ground: Ground, identity: IntArray, before: Array | None, mover: Mover, slot: int
) -> Array:
    """Return a vector along each object's heading, ``(T or 1, K, 3)``.

    It is the velocity; of an object at rest the heading of the slot before, and of one that has
    just come that of its mover: it stands as it will drive.

    Parameters
    ----------
    ground
        The objects; the velocity itself is returned if all of them move.
    identity, before
        ``(K,)`` and ``(T or 1, K, 3)``: who was in each column in the slot before, and the
        headings then; None in the first slot.
    mover, slot
        Of the objects, and the slot of ``ground``, counted from 0.
    """
    moving = (ground.velocity != 0.0).any(axis=-1)  # NaN differs from zero
    if moving.all():
        return ground.velocity
    last: Array = np.broadcast_to(mover.standing(slot), ground.velocity.shape)
    if before is not None:
        same = (ground.identity[:, None] == identity) & (ground.identity != NOBODY)[:, None]
        known = same.any(axis=-1)[:, None] & np.isfinite(before[:, np.argmax(same, axis=-1)])
        last = np.where(known, before[:, np.argmax(same, axis=-1)], last)
    return np.where(moving[..., None], ground.velocity, last)
