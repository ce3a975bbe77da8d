"""Where a state lies in the vertical plane above the road, as seen from the UAV."""

from __future__ import annotations

import numpy as np

from echobeam.values import STATE, Array

_ANGLE, _DISTANCE = STATE.index("angle"), STATE.index("distance")


def offset(state: Array) -> Array:
    """Return where a state ``(..., S)`` lies as seen from the UAV, ``(..., 2)`` m: x and height."""
    theta, d = state[..., _ANGLE], state[..., _DISTANCE]
    return np.stack([d * np.cos(theta), -d * np.sin(theta)], axis=-1)


def offset_cov(state: Array, cov: Array) -> Array:
    """Return the covariance ``(..., 2, 2)`` m^2 of `offset`, to first order.

    Parameters
    ----------
    state
        ``(..., S)`` rad, m, m/s: mean.
    cov
        ``(..., S, S)``: its covariance.
    """
    theta, d = state[..., _ANGLE], state[..., _DISTANCE]
    sin, cos = np.sin(theta), np.cos(theta)
    jacobian = np.stack(
        [np.stack([-d * sin, cos], axis=-1), np.stack([-d * cos, -sin], axis=-1)], axis=-2
    )
    picked = cov[..., [[_ANGLE], [_DISTANCE]], [_ANGLE, _DISTANCE]]
    return np.asarray(np.einsum("...ij,...jk,...lk->...il", jacobian, picked, jacobian))
