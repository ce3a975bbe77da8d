"""Expected measurement of a state and its Jacobian, Eqs. (17)-(19), (24), (43)."""

from __future__ import annotations

import numpy as np

from echobeam.physics.measurement import measure
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array


def predict_measurement(
    mean: Array, uav_speed: Array | float, uav_heading: Array | float, carrier: float
) -> Array:
    """Return h(e) of Eq. (24): angle, delay and Doppler of a state, without noise.

    Parameters
    ----------
    mean
        ``(..., K, 3)`` rad, m, m/s; NaN gives NaN.
    uav_speed, uav_heading
        v^u, m/s, and theta^u, rad above the horizontal; scalars or of a shape that broadcasts
        against ``(..., K)``.
    carrier
        f_c, Hz.

    Returns
    -------
    Array
        ``(..., K, 3)`` rad, s, Hz.
    """
    return measure(mean[..., 0], mean[..., 1], mean[..., 2], uav_speed, uav_heading, carrier)


def measurement_jacobian(
    mean: Array, uav_speed: Array | float, uav_heading: Array | float, carrier: float
) -> Array:
    """Return H = dh/de at a state, ``(..., K, 3, 3)``, Eq. (43).

    Departs: the printed sin theta + theta^u is read as sin(theta + theta^u) (ledger).

    Parameters
    ----------
    mean, uav_speed, uav_heading, carrier
        As in `predict_measurement`.
    """
    theta, v = mean[..., 0], mean[..., 2]
    doppler_per_speed = 2.0 * carrier / SPEED_OF_LIGHT
    across = v * np.sin(theta) - uav_speed * np.sin(theta + uav_heading)
    H = np.zeros((3, 3, *theta.shape))
    H[0, 0] = 1.0
    H[1, 1] = 2.0 / SPEED_OF_LIGHT
    H[2, 0] = doppler_per_speed * across
    H[2, 2] = -doppler_per_speed * np.cos(theta)
    return np.moveaxis(H, (0, 1), (-2, -1))
