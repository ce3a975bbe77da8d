"""End of a track: a belief that no object can have is given up."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray, GaussianState, StateSpace


def living(mean: Array, cov: Array, known: BoolArray, space: StateSpace) -> GaussianState:
    """Return the belief; objects without one, or with an impossible one, are unknown (NaN).

    Parameters
    ----------
    mean, cov
        ``(..., K, S)`` and ``(..., K, S, S)``; both are fresh arrays and may be overwritten.
    known
        ``(..., K)``: whether there was a belief before.
    space
        The state space, which says what is possible.
    """
    lives = np.asarray(known & space.valid(mean))
    total = np.zeros(lives.shape)
    for component in range(space.size):
        variance = cov[..., component, component]
        lives &= variance >= 0.0  # rounding may take more than is left of it
        total += variance
    lives &= np.isfinite(total)
    if not lives.all():
        mean[~lives] = np.nan
        cov[~lives] = np.nan
    return GaussianState(mean, cov, lives)
