"""Measurement of a state without noise, h(e) of Eq. (17) to Eq. (19)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.physics.angles import exact_cosine
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array


def closing_speed(
    theta: npt.ArrayLike, v: Array | float, uav_speed: Array | float, uav_heading: Array | float
) -> Array:
    """Return the closing speed of an object, -dd/dt = v^u cos(theta + theta^u) - v cos(theta).

    Parameters
    ----------
    theta
        ``(...)`` rad.
    v
        ``(...)`` m/s: the object's velocity over ground along the road.
    uav_speed, uav_heading
        v^u, m/s, and theta^u, rad, the angle of the UAV's velocity above the horizontal; scalars
        or of a shape that broadcasts.

    Returns
    -------
    Array
        ``(...)`` m/s, positive when approaching.
    """
    angle = np.asarray(theta, dtype=np.float64)
    speed: Array = uav_speed * np.cos(angle + uav_heading) - v * np.cos(angle)
    return speed


def measure(
    theta: npt.ArrayLike,
    d: npt.ArrayLike,
    v: Array | float,
    uav_speed: Array | float,
    uav_heading: Array | float,
    carrier: float,
) -> Array:
    """Return angle, delay tau = 2 d / c and Doppler mu = -(2 f_c / c) dd/dt, Eq. (17) to Eq. (19).

    Parameters
    ----------
    theta, d, v
        ``(...)`` rad, m, m/s; NaN for absent objects, who get NaN.
    uav_speed, uav_heading
        As in `closing_speed`.
    carrier
        f_c, Hz.

    Returns
    -------
    Array
        ``(..., 3)``: rad, s, Hz; the Doppler is positive when approaching.
    """
    tau = 2.0 * np.asarray(d, dtype=np.float64) / SPEED_OF_LIGHT
    mu = 2.0 * carrier / SPEED_OF_LIGHT * closing_speed(theta, v, uav_speed, uav_heading)
    angle = np.asarray(theta, dtype=np.float64)
    return np.stack(np.broadcast_arrays(angle, tau, mu), axis=-1)


def measured_place(value: Array) -> Array:
    """Return the states ``(..., 3)`` that measurements ``(..., 3)`` are of, with no velocity.

    An angle that was not measured is taken to be 90 degrees, where an upright array measures none;
    a single antenna's bounds do not depend on it.
    """
    angle, distance = value[..., 0], 0.5 * SPEED_OF_LIGHT * value[..., 1]
    angle = np.where(np.isfinite(angle), angle, 0.5 * np.pi)
    return np.stack([angle, distance, np.zeros_like(angle)], axis=-1)


def velocity_from_doppler(
    mu: npt.ArrayLike,
    theta: npt.ArrayLike,
    uav_speed: Array | float,
    uav_heading: Array | float,
    carrier: float,
) -> Array:
    """Return v = (v^u cos(theta + theta^u) - v^R) / cos(theta), the paper's text to Eq. (18).

    v^R = c mu / (2 f_c) is the closing speed: the paper's "radial velocity" with its sign made
    explicit. Straight under the UAV (90 degrees) v is not observable: the result is
    infinite there, or NaN where the numerator is zero as well, and near it noise is multiplied
    by 1 / cos(theta).

    Parameters
    ----------
    mu
        ``(...)`` Hz.
    theta
        ``(...)`` rad.
    uav_speed, uav_heading, carrier
        As in `measure`.

    Returns
    -------
    Array
        ``(...)`` m/s: the object's velocity over ground.
    """
    angle = np.asarray(theta, dtype=np.float64)
    approach = SPEED_OF_LIGHT * np.asarray(mu, dtype=np.float64) / (2.0 * carrier)
    own = uav_speed * np.cos(angle + uav_heading)
    with np.errstate(divide="ignore", invalid="ignore"):  # 90 degrees: inf or NaN, by definition
        velocity: Array = (own - approach) / exact_cosine(angle)
    return velocity
