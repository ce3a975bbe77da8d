"""When a track ends: a belief that no object on the ground can have is given up."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, BoolArray, GaussianState


def physical(mean: Array) -> BoolArray:
    """Return ``(..., K)``: the state is finite, 0 < theta < pi and d > 0.

    Parameters
    ----------
    mean
        ``(..., K, 3)`` rad, m, m/s.
    """
    theta, d, v = mean[..., 0], mean[..., 1], mean[..., 2]
    possible: BoolArray = (theta > 0.0) & (theta < np.pi) & (d > 0.0) & np.isfinite(d + v)
    return possible


def living(mean: Array, cov: Array, known: BoolArray) -> GaussianState:
    """Return the belief; objects without one, or with an impossible one, are unknown (NaN).

    Parameters
    ----------
    mean, cov
        ``(..., K, 3)`` and ``(..., K, 3, 3)``; both are fresh arrays and may be overwritten.
    known
        ``(..., K)``: whether there was a belief before.
    """
    variance = cov[..., 0, 0] + cov[..., 1, 1] + cov[..., 2, 2]
    lives = np.asarray(known & physical(mean) & np.isfinite(variance))
    if not lives.all():
        mean[~lives] = np.nan
        cov[~lives] = np.nan
    return GaussianState(mean, cov, lives)
