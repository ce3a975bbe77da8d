"""The downlink: channel, SINR and rate of every object, Eq. (3) to Eq. (10)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.physics.planar import AntennaArray, absent, by_polarisation
from echobeam.values import Array, BoolArray, ComplexArray, Transmission


def channel_loss(distance: npt.ArrayLike, noise: float, alpha0: float = 1.0) -> Array:
    """Return sigma_C^2 d^2 / alpha0^2: noise over path gain, Eqs. (3), (36).

    It is the noise referred to a transmitter at 1 m without path loss; it keeps the SINR defined
    at d = 0.

    Parameters
    ----------
    distance
        ``(...)`` m.
    noise
        sigma_C^2.
    alpha0
        Amplitude of the channel at 1 m (the power falls as alpha0^2 / d^2).
    """
    loss: Array = noise * (np.asarray(distance, dtype=np.float64) / alpha0) ** 2
    return loss


def channel(
    theta: npt.ArrayLike,
    d: npt.ArrayLike,
    array: AntennaArray,
    *,
    wavelength: float,
    alpha0: float = 1.0,
) -> ComplexArray:
    """Return the line-of-sight channel h = (alpha0 / d) exp(j 2 pi d / lambda) a(theta), Eq. (3).

    Parameters
    ----------
    theta, d
        ``(...)`` rad and m.
    array
        The transmit array.
    wavelength
        Carrier wavelength lambda, m.
    alpha0
        Amplitude of the channel at 1 m.

    Returns
    -------
    ComplexArray
        ``(..., N)``; the received signal is h^H x, Eq. (5) and Eq. (9).
    """
    distance = np.asarray(d, dtype=np.float64)
    gain = alpha0 / distance * np.exp(2j * np.pi * distance / wavelength)
    h: ComplexArray = gain[..., np.newaxis] * array.steering(theta)
    return h


def stream_gains(sent: Transmission, theta: npt.ArrayLike, array: AntennaArray) -> Array:
    """Return a(theta_k)^H W_c a(theta_k): the power of stream c towards object k, at 1 m.

    Antennas that send uncorrelated signals add their powers, whatever the direction, and so do two
    polarisations: a receiver takes the power of both.

    Parameters
    ----------
    sent
        Of leading shape ``(...)``, C streams.
    theta
        ``(..., K)`` rad, or ``(..., K, 2)`` direction cosines of a planar array; NaN for an absent
        object, whose row is then NaN.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., K, C)``, power: row k the object, column c the stream.
    """
    beams = by_polarisation(sent.beams, array)
    amplitude = np.conj(array.steering(theta)) @ np.swapaxes(beams, -1, -2)
    uncorrelated = np.sum(sent.antenna_power, axis=-1)[..., np.newaxis, :]
    power = amplitude.real**2 + amplitude.imag**2
    if array.polarisations > 1:
        streams = sent.beams.shape[-2]  # not -1: without streams there is nothing to infer it from
        power = power.reshape(*power.shape[:-1], streams, array.polarisations).sum(axis=-1)
    gains: Array = power + uncorrelated
    return gains


def sinr(
    sent: Transmission,
    own: BoolArray,
    theta: npt.ArrayLike,
    loss: npt.ArrayLike,
    array: AntennaArray,
) -> Array:
    """Return every object's SINR: Eq. (7) in omnidirectional slots, Eq. (10) in directional ones.

    Objects of the same steering vector receive the same streams, so the product of their SINRs is
    at most 1: no beams separate them.

    Parameters
    ----------
    sent
        As in `stream_gains`; what it sends without data is interference.
    own
        ``(..., K, C)``: whether stream c is addressed to object k; the others are interference.
    theta
        ``(..., K)`` rad or ``(..., K, 2)``; NaN for absent objects, who get NaN.
    loss
        ``(..., K)``: noise over path gain, see `channel_loss`; infinite for an object that the
        array does not see, whose SINR is zero.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., K)``; zero for an object without a stream.
    """
    gains = stream_gains(sent, theta, array)
    own = np.broadcast_to(own, gains.shape)
    signal = np.sum(gains, axis=-1, where=own)
    interference = np.sum(gains, axis=-1, where=~own)  # not sum - own: that would cancel
    unaddressed = np.sum(sent.probing, axis=-1)[..., np.newaxis]
    with np.errstate(divide="ignore", invalid="ignore"):  # no noise, no interference: inf
        ratio: Array = signal / (interference + unaddressed + np.asarray(loss))
    # Without streams the sums are zero even for an absent object.
    return np.where(absent(theta, array), np.nan, ratio)


def rate(sinr: npt.ArrayLike) -> Array:
    """Return the spectral efficiency log2(1 + sinr) of each object, bit/s/Hz, Eq. (8).

    Departs: the paper calls it the sum rate of object k; the sum rate is the sum over objects.
    At the paper's powers the SINR is about 1e-4, where ``log2(1 + x)`` would lose four digits.
    """
    efficiency: Array = np.log1p(np.asarray(sinr, dtype=np.float64)) / np.log(2.0)
    return efficiency
