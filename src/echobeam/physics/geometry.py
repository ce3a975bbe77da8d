"""Geometry between UAV and object: ground coordinates, and the paper's angle and distance."""

from __future__ import annotations

import numpy as np

from echobeam.values import Array, UavState

_ANGLE, _DISTANCE = 0, 1


def polar_state(position: Array, velocity: Array, uav: UavState) -> Array:
    """Return an object's angle, distance and velocity as seen from the UAV, Eqs. (25), (28).

    The angle is measured downwards from the road's direction, 0 to pi; the velocity is over
    ground along the road. The object lies in the road's vertical plane.

    Parameters
    ----------
    position, velocity
        ``(..., 3)`` m and m/s in ground coordinates; NaN for absent objects.
    uav
        The UAV in the slot.

    Returns
    -------
    Array
        ``(..., 3)`` rad, m, m/s.
    """
    x = position[..., 0] - uav.position[0]
    depth = np.maximum(uav.position[2] - position[..., 2], 0.0)
    return np.stack([np.arctan2(depth, x), np.hypot(depth, x), velocity[..., 0]], axis=-1)


def along_road(state: Array, noise: Array, stds: tuple[float, float]) -> Array:
    """Return the displacement along the road that noise on angle and distance leaves, ``(...)`` m.

    Noise on angle and distance displaces an object along the road by x = cos(theta) eta_d -
    d sin(theta) eta_theta and in height by z = -sin(theta) eta_d - d cos(theta) eta_theta. An
    object stays on the ground and the UAV's height is not touched, so nature has the conditional
    distribution given z = 0: the residual of x after regression on z, whose variance is that of
    `along_road_variance`. It never exceeds the variance of x itself, which a filter on angle and
    distance assumes.

    Parameters
    ----------
    state
        ``(..., 3)`` rad, m, m/s: where the object is; NaN for absent objects, who get NaN.
    noise
        ``(..., 2)`` rad, m: independent eta_theta and eta_d of Eq. (35).
    stds
        Their standard deviations.
    """
    theta, d = state[..., _ANGLE], state[..., _DISTANCE]
    sin, cos = np.sin(theta), np.cos(theta)
    tangential, radial = d * noise[..., 0], noise[..., 1]
    across, along = (d * stds[0]) ** 2, stds[1] ** 2
    height = along * sin**2 + across * cos**2
    # x - z cov(x, z) / var(z), written out so that nothing cancels
    shift: Array = across * cos * radial - along * sin * tangential
    return shift / np.where(height == 0.0, 1.0, height)


def along_road_variance(state: Array, stds: tuple[float, float]) -> Array:
    """Return the variance of `along_road`, ``(...)`` m^2; zero if either deviation is."""
    theta, d = state[..., _ANGLE], state[..., _DISTANCE]
    across, along = (d * stds[0]) ** 2, stds[1] ** 2
    height = along * np.sin(theta) ** 2 + across * np.cos(theta) ** 2
    variance: Array = across * along / np.where(height == 0.0, 1.0, height)
    return variance


def offset(state: Array) -> Array:
    """Return the position of a state ``(..., 3)`` relative to the UAV, ``(..., 2)`` m: x and z."""
    theta, d = state[..., _ANGLE], state[..., _DISTANCE]
    return np.stack([d * np.cos(theta), -d * np.sin(theta)], axis=-1)


def offset_cov(state: Array, cov: Array) -> Array:
    """Return the covariance ``(..., 2, 2)`` m^2 of `offset`, to first order.

    Parameters
    ----------
    state
        ``(..., 3)`` rad, m, m/s: mean.
    cov
        ``(..., 3, 3)``: its covariance.
    """
    theta, d = state[..., _ANGLE], state[..., _DISTANCE]
    sin, cos = np.sin(theta), np.cos(theta)
    jacobian = np.stack(
        [np.stack([-d * sin, cos], axis=-1), np.stack([-d * cos, -sin], axis=-1)], axis=-2
    )
    picked = cov[..., [[_ANGLE], [_DISTANCE]], [_ANGLE, _DISTANCE]]
    return np.asarray(np.einsum("...ij,...jk,...lk->...il", jacobian, picked, jacobian))
