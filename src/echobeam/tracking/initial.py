"""The first state of an object, from its first measurement alone (the paper's Notes 1 and 2)."""

from __future__ import annotations

import numpy as np

from echobeam.estimation import gaussian
from echobeam.physics.measurement import velocity_from_doppler
from echobeam.physics.polar import POLAR
from echobeam.tracking.life import living
from echobeam.tracking.polar import PolarMeasurement
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, GaussianState, UavState

VELOCITY_STD_BOUND = 1e4
"""Largest standard deviation, m/s, at which a velocity inverted from a Doppler is believed."""


def initial_state(
    value: Array,
    variance: Array,
    model: PolarMeasurement,
    uav: UavState,
    velocity_std: float | None = None,
) -> GaussianState:
    """Return the belief after a first measurement, the paper's Note 2, with its own covariance.

    Without a prior the measured values are the estimate: theta, d = c tau / 2 and the velocity
    behind the Doppler. Their covariance is MSE_0 = H^-1 Q_m H^-T, the propagated errors of the
    measurement. If the velocity's standard deviation would exceed `VELOCITY_STD_BOUND` (the
    object is nearly under the UAV, where v is not observable) or no Doppler was
    measured, the velocity is 0 with that standard deviation and no correlation.

    With a weak prior v ~ N(0, velocity_std^2) the Doppler updates that prior, linearised at
    v = 0. This is the fusion of both, defined under the UAV too.

    Departs: Note 1 leaves MSE_0 to experiment; a zero one makes the filter diverge (ledger).

    Parameters
    ----------
    value, variance
        ``(..., K, 3)``: measurement of every object, known or not. One whose angle or delay was
        not measured, or is not physical (angle outside (0, pi), delay not positive), is unknown.
    model
        The measurement model.
    uav
        The UAV in the slot of the measurement.
    velocity_std
        m/s, positive, or None for no prior.
    """
    distance_per_delay = 0.5 * SPEED_OF_LIGHT
    mean = np.zeros(value.shape)
    cov = np.zeros((*mean.shape, 3))
    mean[..., :2] = value[..., :2] * np.array([1.0, distance_per_delay])
    cov[..., 0, 0] = variance[..., 0]
    cov[..., 1, 1] = variance[..., 1] * distance_per_delay**2
    cov[..., 2, 2] = VELOCITY_STD_BOUND**2 if velocity_std is None else velocity_std**2
    with np.errstate(all="ignore"):  # objects that were not measured, or under the UAV
        if velocity_std is None:
            _invert_doppler(mean, cov, value, variance, model, uav)
        else:
            mean, cov = _use_doppler(mean, cov, value, variance, model, uav)
    return living(mean, cov, np.ones(mean.shape[:-1], dtype=bool), POLAR)


def _invert_doppler(
    mean: Array,
    cov: Array,
    value: Array,
    variance: Array,
    model: PolarMeasurement,
    uav: UavState,
) -> None:
    """Write the inverted velocity and its row of H^-1 Q_m H^-T where they can be believed.

    The last row of H is (a, 0, b), so that of H^-1 is (-a / b, 0, 1 / b).
    """
    v = velocity_from_doppler(value[..., 2], mean[..., 0], uav.speed, uav.heading, model.carrier)
    H = model.jacobian(np.stack([mean[..., 0], mean[..., 1], v], axis=-1), uav)
    per_angle = -H[..., 2, 0] / H[..., 2, 2]
    angle_var, doppler_var = variance[..., 0], variance[..., 2]
    velocity_var = per_angle**2 * angle_var + doppler_var / H[..., 2, 2] ** 2
    believed = velocity_var <= VELOCITY_STD_BOUND**2  # not where it is NaN, as is v then
    mean[..., 2] = np.where(believed, v, mean[..., 2])
    cov[..., 2, 2] = np.where(believed, velocity_var, cov[..., 2, 2])
    cov[..., 0, 2] = cov[..., 2, 0] = np.where(believed, per_angle * angle_var, 0.0)


def _use_doppler(
    mean: Array,
    cov: Array,
    value: Array,
    variance: Array,
    model: PolarMeasurement,
    uav: UavState,
) -> tuple[Array, Array]:
    """Update angle, distance and the prior of the velocity by the Doppler alone."""
    doppler = slice(2, 3)
    innovation = model.residual(value, model.expected(mean, uav))
    H = model.jacobian(mean, uav)
    return gaussian.update(
        mean, cov, innovation[..., doppler], H[..., doppler, :], variance[..., doppler]
    )
