"""Objective of problem (38): gains, SINR and rates at the predicted channel.

Everything follows from K x K gains ``gains[k, i] = |a^H(theta_k) w_i|^2`` and one number per
object, the loss ``noise d_k^2 / alpha0^2`` (`echobeam.physics.link.channel_loss`).
"""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.problem import BeamProblem
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, ComplexArray


def beam_gains(beams: ComplexArray, angles: Array, array: AntennaArray) -> Array:
    """Return the power of every beam towards each object, |a^H(theta_k) w_i|^2.

    Parameters
    ----------
    beams
        ``(..., K, n)``, sqrt(power); of two polarisations the powers add up.
    angles
        ``(..., J)`` rad, or ``(..., J, 2)`` direction cosines.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., J, K)``, power: row by angle, column by beam.
    """
    many, polarisations = beams.shape[-2], array.polarisations
    columns = beams.reshape(*beams.shape[:-2], many * polarisations, array.elements)
    response = np.conj(array.steering(angles)) @ np.swapaxes(columns, -1, -2)
    power = np.abs(response) ** 2
    if polarisations == 1:
        return power
    split = power.reshape(*power.shape[:-1], many, polarisations)
    total: Array = split.sum(axis=-1)
    return total


def sinr(gains: Array, loss: Array) -> Array:
    """Return the SINR of the directional phase, Eq. (10), from gains and losses.

    Parameters
    ----------
    gains
        ``(..., K, K)``, power: row by object, column by beam.
    loss
        ``(..., K)``, power: noise over path gain.

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
        ``(K, n)``, sqrt(power).

    Returns
    -------
    Array
        ``(K,)``, bit/s/Hz.
    """
    return rates_from_gains(beam_gains(beams, problem.angles, problem.array), problem.loss)
