"""The largest of many numbers, in order."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, IntArray


def largest(weight: Array, k: int) -> tuple[IntArray, Array]:
    """Return the indices and values of the K largest ``(..., K)`` of ``(..., E)``, descending.

    Where there are fewer than K the values are -inf and the indices 0.
    """
    order: IntArray
    if weight.shape[-1] > 4 * k:
        order = np.sort(np.argpartition(-weight, k - 1, axis=-1)[..., :k], axis=-1)
        among = np.take_along_axis(weight, order, axis=-1)
        inner = np.argsort(-among, axis=-1, kind="stable")
        order = np.take_along_axis(order, inner, axis=-1)
    else:
        order = np.argsort(-weight, axis=-1, kind="stable")[..., :k]
    found = np.take_along_axis(weight, order, axis=-1)
    missing = [(0, 0)] * (weight.ndim - 1) + [(0, k - order.shape[-1])]
    return np.pad(order, missing), np.pad(found, missing, constant_values=-np.inf)
