"""Echoes as signals at the receive array, Eq. (11) on the grid of a waveform.

    Y = sum_k alpha_k b(theta_k) (a(theta_k)^H F S) o phi(tau_k, mu_k) + Z,

over all scatterers k: the objects, patches of ground, and what the receiver hears of its own
transmitter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.physics.planar import AntennaArray
from echobeam.physics.waveform import Waveform
from echobeam.values import Array, ComplexArray, aligned


class Scatterers(NamedTuple):
    """Point targets as the radar sees them, ``(..., K)`` each; an amplitude of zero is none.

    ``angle`` rad (seen by planar arrays ``(..., K, 2)`` direction cosines), ``delay`` s,
    ``doppler`` Hz; ``amplitude`` is complex, of one antenna's echo per
    root of the power that illuminates the target.
    """

    angle: Array
    delay: Array
    doppler: Array
    amplitude: ComplexArray


def echo_signal(
    scatterers: Scatterers,
    streams: ComplexArray,
    precoder: ComplexArray,
    waveform: Waveform,
    arrays: tuple[AntennaArray, AntennaArray],
) -> ComplexArray:
    """Return the noiseless signal at the receive array, ``(..., N_r, N, M)``.

    Parameters
    ----------
    scatterers
        ``(..., K)``.
    streams
        ``(..., L, N, M)``: S.
    precoder
        ``(..., N_t, L)``: F.
    waveform
        The grid.
    arrays
        Transmitter and receiver.
    """
    transmitter, receiver = arrays
    there = scatterers.amplitude != 0.0
    angle = np.where(aligned(there, scatterers.angle), scatterers.angle, 0.0)
    a, b = transmitter.steering(angle), receiver.steering(angle)
    mixture = np.conj(a) @ precoder  # (..., K, L): a^H F
    shape = streams.shape
    lit = (mixture @ streams.reshape(*shape[:-2], -1)).reshape(*mixture.shape[:-1], *shape[-2:])
    delay, doppler = (np.where(there, one, 0.0) for one in (scatterers.delay, scatterers.doppler))
    lit = lit * waveform.phases(delay, doppler)
    lit = lit * scatterers.amplitude[..., None, None]
    cells = shape[-2] * shape[-1]  # not -1: without scatterers there is nothing to infer it from
    received = np.swapaxes(b, -1, -2) @ lit.reshape(*lit.shape[:-2], cells)
    signal: ComplexArray = received.reshape(*received.shape[:-1], *shape[-2:])
    return signal


def noise_of(normals: Array, variance: float) -> ComplexArray:
    """Return circular noise of a variance from standard normals ``(..., 2)``."""
    noise: ComplexArray = (normals[..., 0] + 1j * normals[..., 1]) * np.sqrt(0.5 * variance)
    return noise
