"""The downlink: channel, SINR and rate of every object, Eq. (3) to Eq. (10)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.physics.array import steering_vector
from echobeam.values import Array, Axis, ComplexArray, Transmission


def channel(
    theta: npt.ArrayLike,
    d: npt.ArrayLike,
    n_tx: int,
    *,
    wavelength: float,
    alpha0: float = 1.0,
    spacing: float = 0.5,
    axis: Axis = "vertical",
) -> ComplexArray:
    """Return the line-of-sight channel h = (alpha0 / d) exp(j 2 pi d / lambda) a(theta), Eq. (3).

    Parameters
    ----------
    theta, d
        ``(...)`` rad and m.
    n_tx
        Number of transmit antennas.
    wavelength
        Carrier wavelength lambda, m.
    alpha0
        Amplitude of the channel at 1 m (the power falls as alpha0^2 / d^2).
    spacing, axis
        As in `echobeam.physics.array.steering_vector`.

    Returns
    -------
    ComplexArray
        ``(..., n_tx)``; the received signal is h^H x, Eq. (5) and Eq. (9).
    """
    distance = np.asarray(d, dtype=np.float64)
    gain = alpha0 / distance * np.exp(2j * np.pi * distance / wavelength)
    h: ComplexArray = gain[..., np.newaxis] * steering_vector(theta, n_tx, spacing, axis)
    return h


def stream_gains(
    transmission: Transmission,
    theta: npt.ArrayLike,
    *,
    spacing: float = 0.5,
    axis: Axis = "vertical",
) -> Array:
    """Return a(theta_k)^H W_i a(theta_k): the power of stream i towards object k, at 1 m.

    Antennas that send uncorrelated signals add their powers, whatever the direction.

    Parameters
    ----------
    transmission
        Of leading shape ``(...)``; streams of absent objects are zero.
    theta
        ``(..., K)`` rad; NaN for an absent object, whose row is then NaN.
    spacing, axis
        As in `echobeam.physics.array.steering_vector`.

    Returns
    -------
    Array
        ``(..., K, K)``, power: row k the object, column i the stream.
    """
    a = steering_vector(theta, transmission.beams.shape[-1], spacing, axis)
    amplitude = np.conj(a) @ np.swapaxes(transmission.beams, -1, -2)
    uncorrelated = np.sum(transmission.antenna_power, axis=-1)[..., np.newaxis, :]
    gains: Array = amplitude.real**2 + amplitude.imag**2 + uncorrelated
    return gains


def sinr(
    transmission: Transmission,
    theta: npt.ArrayLike,
    d: npt.ArrayLike,
    *,
    noise: float,
    alpha0: float = 1.0,
    spacing: float = 0.5,
    axis: Axis = "vertical",
) -> Array:
    """Return every object's SINR: Eq. (7) in omnidirectional slots, Eq. (10) in directional ones.

    Numerator and denominator are multiplied by d^2 / alpha0^2, which keeps the answer defined at
    d = 0. Objects of the same steering vector hear the same streams, so the product of their
    SINRs is at most 1: no beams separate them.

    Parameters
    ----------
    transmission
        As in `stream_gains`; what it sends without data is interference.
    theta, d
        ``(..., K)`` rad and m; NaN for absent objects, who get NaN.
    noise
        sigma_C^2.
    alpha0, spacing, axis
        As in `channel`.

    Returns
    -------
    Array
        ``(..., K)``; zero for an object without a stream.
    """
    gains = stream_gains(transmission, theta, spacing=spacing, axis=axis)
    own = np.eye(gains.shape[-1], dtype=np.bool_)
    signal = np.sum(gains, axis=-1, where=own)
    interference = np.sum(gains, axis=-1, where=~own)  # not sum - own: that would cancel
    unaddressed = np.sum(transmission.probing, axis=-1)[..., np.newaxis]
    noise_at_1m = noise * np.asarray(d, dtype=np.float64) ** 2 / alpha0**2
    with np.errstate(divide="ignore", invalid="ignore"):  # no noise, no interference: inf
        ratio: Array = signal / (interference + unaddressed + noise_at_1m)
    return ratio


def rate(sinr: npt.ArrayLike) -> Array:
    """Return the spectral efficiency log2(1 + sinr) of each object, bit/s/Hz, Eq. (8).

    Departs: the paper calls it the sum rate of object k; the sum rate is the sum over objects.
    At the paper's powers the SINR is about 1e-4, where ``log2(1 + x)`` would lose four digits.
    """
    efficiency: Array = np.log1p(np.asarray(sinr, dtype=np.float64)) / np.log(2.0)
    return efficiency
