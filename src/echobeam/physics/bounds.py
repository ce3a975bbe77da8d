"""Cramer-Rao bounds of angle, delay and Doppler.

Two versions. ``"paper"``: Eq. (20) to Eq. (23) as printed, but with the antenna spacing in (23).
``"exact"``: the Fisher information of a monostatic MIMO radar that does not know the complex
reflection coefficient, for any transmit covariance C. With A = b a^H and its derivative
A' = b' a^H + b a'^H the information on the angle is

    J = (2 G_m |beta|^2 / sigma^2) [tr(A' C A'^H) - |tr(A C A'^H)|^2 / tr(A C A^H)].

Written out, the products of receive and transmit terms cancel, and with
SNR = G_m |beta|^2 a^H C a / sigma^2, Eq. (14) and Eq. (16), two apertures are left that add up:

    J = 2 SNR N_r (xi_r^2 + xi_t^2),
    xi_r^2 = |b'|^2 / N_r - |b^H b'|^2 / N_r^2,
    xi_t^2 = a'^H C a' / a^H C a - |a^H C a'|^2 / (a^H C a)^2.

xi_r^2 is the variance of the phase slopes over the receive antennas. xi_t^2 is the same over the
transmit antennas, weighted by what they send: equal to xi_r^2 of an array of N_t for
C = (P_T / N_t) I, Eq. (6), and zero for rank one, where the echo's amplitude tells the
direction of departure no better than an unknown beta does. Both are variances: moving the phase
centre of either array (a -> a exp(j phi(theta))) adds a constant to its slopes and changes
nothing, so the result does not depend on where the phase is counted from.

Delay and Doppler do not couple with the angle or each other for waveforms of the same spectrum
and of an envelope symmetric in the middle of the pulse.
"""

from __future__ import annotations

from typing import Literal, assert_never

import numpy as np
import numpy.typing as npt

from echobeam.physics.array import LinearArray
from echobeam.physics.planar import AntennaArray
from echobeam.physics.planar_bounds import (
    cosine_information,
    marginal_variance,
    printed_information,
)
from echobeam.values import Array, Transmission

Crb = Literal["paper", "exact"]


def measurement_variance(
    sent: Transmission,
    theta: npt.ArrayLike,
    snr: npt.ArrayLike,
    transmitter: AntennaArray,
    receiver: AntennaArray,
    *,
    crb: Crb,
    bandwidth: float,
    pulse_length: float,
) -> Array:
    """Return the Cramer-Rao bounds of direction, delay and Doppler, Eq. (20) to Eq. (23).

    Infinite where nothing is learnt: without an echo (SNR = 0), and for the angle with a single
    antenna or where the array is blind (90 degrees for the vertical axis).

    Departs: ``"paper"`` has the antenna spacing in Eq. (23) where the object's distance is
    printed. ``"exact"`` does not count the transmit array twice (the SNR holds its gain already)
    and has the factor 2 of a real parameter; bandwidth and pulse length are those of a flat
    spectrum and a rectangular pulse. See the ledger.

    Parameters
    ----------
    sent
        What was sent; ``(..., C, N)`` inside.
    theta
        ``(..., K)`` rad, or ``(..., K, 2)`` direction cosines of planar arrays.
    snr
        ``(..., K)``: echo SNR per receive antenna, Eq. (14) and Eq. (16).
    transmitter, receiver
        The two arrays, of N_t and N_r antennas.
    crb
        ``"paper"`` or ``"exact"``.
    bandwidth
        Hz. ``"paper"``: kappa, as it stands. ``"exact"``: the width of the flat spectrum.
    pulse_length
        s. ``"paper"``: iota, as it stands. ``"exact"``: the length of the rectangular pulse.

    Returns
    -------
    Array
        ``(..., K, 3)``: rad^2, s^2, Hz^2; NaN for absent objects. Of planar arrays
        ``(..., K, 4)``: the marginal variances of u and v, the diagonal of the inverse of their
        information, first.
    """
    match crb:
        case "paper":
            per_echo = float(transmitter.elements * receiver.elements)
            delay, doppler = bandwidth * bandwidth, pulse_length * pulse_length
        case "exact":
            per_echo = 2.0 * receiver.elements
            delay, doppler = _mean_square_rate(bandwidth), _mean_square_rate(pulse_length)
        case _:
            assert_never(crb)
    effective_snr = per_echo * np.asarray(snr, dtype=np.float64)
    if isinstance(transmitter, LinearArray):
        assert isinstance(receiver, LinearArray)
        if crb == "paper":
            aperture = square_aperture(theta, transmitter)
        else:
            aperture = square_aperture(theta, receiver) + transmit_aperture(
                sent, theta, transmitter
            )
        factors = np.broadcast_arrays(aperture, delay, doppler)
        return _inverse(effective_snr[..., np.newaxis], np.stack(factors, axis=-1))
    assert not isinstance(receiver, LinearArray)
    if crb == "paper":
        apertures = printed_information(transmitter)
    else:
        apertures = cosine_information(sent, theta, transmitter, receiver)
    cosines = marginal_variance(effective_snr, apertures)
    factors = np.broadcast_arrays(delay, doppler)
    others = _inverse(effective_snr[..., np.newaxis], np.stack(factors, axis=-1))
    return np.concatenate([cosines, np.broadcast_to(others, (*cosines.shape[:-1], 2))], axis=-1)


def effective_variance(variance: Array, snr: npt.ArrayLike) -> Array:
    """Return the variances of the measurements, the bounds of Eq. (20) to Eq. (22).

    Where there is no echo (SNR zero, or NaN for an absent object) nothing is measured: infinite
    variances. Elsewhere the bound is taken at its word, as the paper does, though it grows without
    limit near 90 degrees and off a narrow beam, where no estimator is that bad; the filter gives
    such a measurement the weight that it deserves, next to none.

    Parameters
    ----------
    variance
        ``(..., K, A + 2)`` of `measurement_variance`.
    snr
        ``(..., K)``: echo SNR.
    """
    echo = np.asarray(snr, dtype=np.float64)[..., np.newaxis] > 0.0
    return np.where(echo & np.isfinite(variance), variance, np.inf)


def square_aperture(theta: npt.ArrayLike, array: LinearArray) -> Array:
    """Return xi^2 of Eq. (23): the variance of the phase slopes over an array's antennas.

    Departs: the antenna spacing takes the place of the printed distance d_k, xi^2 =
    (2 pi Delta d / lambda)^2 cos^2(theta) (n^2 - 1) / 12.

    Parameters
    ----------
    theta
        ``(...)`` rad.
    array
        Of n antennas.

    Returns
    -------
    Array
        ``(...)``, 1/rad^2.
    """
    slope = 2.0 * np.pi * array.spacing * array.slope(theta)
    aperture: Array = slope**2 * ((array.n**2 - 1) / 12.0)
    return aperture


def transmit_aperture(sent: Transmission, theta: npt.ArrayLike, array: LinearArray) -> Array:
    """Return xi_t^2, the transmitted covariance's part of the square aperture; see the module.

    With C = F F^H it is |f' - f (f^H f') / |f|^2|^2 / |f|^2 for f = F^H a, f' = F^H a': what a
    change of the angle changes in the mixture of streams that reaches the object, beyond its
    scale and phase. In this form a rank-one C gives zero without cancellation.

    Parameters
    ----------
    sent, theta
        As in `measurement_variance`.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., K)``, 1/rad^2; zero where no power goes (there is no echo to learn from).
    """
    a, slope = array.steering(theta), array.derivative(theta)
    correlated = np.conj(np.swapaxes(sent.beams, -1, -2))
    single = np.sqrt(np.sum(sent.antenna_power, axis=-2) + sent.probing)
    single = single[..., np.newaxis, :]
    f = np.concatenate([a @ correlated, a * single], axis=-1)
    df = np.concatenate([slope @ correlated, slope * single], axis=-1)
    power = np.sum(np.abs(f) ** 2, axis=-1, keepdims=True)
    share = np.sum(np.conj(f) * df, axis=-1, keepdims=True)
    dark = power < np.finfo(np.float64).tiny
    per_power = 1.0 / np.where(dark, 1.0, power)  # real: a complex quotient warns of every NaN
    residual = df - f * (share * per_power)
    aperture = np.sum(np.abs(residual) ** 2, axis=-1) * per_power[..., 0]
    return np.where(dark[..., 0], 0.0, aperture)


def _mean_square_rate(width: float) -> float:
    """Return (2 pi)^2 times the variance of a uniform distribution of this width."""
    rate = 2.0 * np.pi * width
    return rate * rate / 12.0  # a product overflows to infinity, a power of floats raises


def _inverse(snr: Array, factor: Array) -> Array:
    """Return 1 / (snr factor), infinite if either is zero, even if the other is infinite."""
    nothing = (snr == 0.0) | (factor == 0.0)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # inf, by definition
        inverse = 1.0 / (snr * factor)
    return np.where(nothing, np.inf, inverse)
