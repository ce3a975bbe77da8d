"""What problem (38) maximises: gains, SINR and rates at the predicted channel.

Everything follows from K x K gains ``gains[k, i] = |a^H(theta_k) w_i|^2`` and one number per
object, the loss ``noise d_k^2 / alpha0^2``.
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.problem import BeamProblem
from echobeam.physics.array import steering_vector
from echobeam.values import Array, Axis, ComplexArray


def channel_loss(distances: Array, noise: float, alpha0: float = 1.0) -> Array:
    """Return sigma_C^2 d_k^2 / alpha0^2: the noise referred to the array, Eqs. (3), (36).

    Parameters
    ----------
    distances
        ``(..., K)`` m.
    noise
        sigma_C^2, power.
    alpha0
        Amplitude of the channel at 1 m.

    Returns
    -------
    Array
        ``(..., K)``, power.
    """
    return noise * (np.asarray(distances) / alpha0) ** 2


def beam_gains(
    beams: ComplexArray, angles: Array, spacing: float = 0.5, axis: Axis = "vertical"
) -> Array:
    """Return how much of every beam each object gets, |a^H(theta_k) w_i|^2.

    Parameters
    ----------
    beams
        ``(..., K, N)``, sqrt(power).
    angles
        ``(..., J)`` rad.

    Returns
    -------
    Array
        ``(..., J, K)``, power: row by angle, column by beam.
    """
    steering = steering_vector(angles, beams.shape[-1], spacing, axis)
    response = np.conj(steering) @ np.swapaxes(beams, -1, -2)
    return np.abs(response) ** 2


def sinr(gains: Array, loss: Array) -> Array:
    """Return the SINR of the directional phase, Eq. (10), from gains and losses.

    Parameters
    ----------
    gains
        ``(..., K, K)``, power: row by object, column by beam.
    loss
        ``(..., K)``, power: `channel_loss`.

    Returns
    -------
    Array
        ``(..., K)``.
    """
    own = np.diagonal(gains, axis1=-2, axis2=-1)
    foreign = gains * ~np.eye(gains.shape[-1], dtype=bool)
    ratio: Array = own / (foreign.sum(axis=-1) + loss)
    return ratio


def rates_from_gains(gains: Array, loss: Array) -> Array:
    """Return log2(1 + SINR), bit/s/Hz, Eqs. (8), (50); shapes as in `sinr`."""
    achieved: Array = np.log1p(sinr(gains, loss)) / np.log(2.0)
    return achieved


def rates(problem: BeamProblem, beams: ComplexArray) -> Array:
    """Return the rates that beams achieve at the predicted channel, Eqs. (37), (38a).

    Parameters
    ----------
    problem
        The problem with K objects.
    beams
        ``(K, N)``, sqrt(power).

    Returns
    -------
    Array
        ``(K,)``, bit/s/Hz.
    """
    gains = beam_gains(beams, problem.angles, problem.spacing, problem.axis)
    return rates_from_gains(gains, channel_loss(problem.distances, problem.noise, problem.alpha0))
