"""How well a state can be measured: Cramer-Rao bounds of angle, delay and Doppler.

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

from echobeam.physics.array import directional_slope, steering_derivative, steering_vector
from echobeam.values import Array, Axis, Transmission

Crb = Literal["paper", "exact"]


def measurement_variance(
    transmission: Transmission,
    theta: npt.ArrayLike,
    snr: npt.ArrayLike,
    *,
    crb: Crb,
    n_rx: int,
    bandwidth: float,
    pulse_length: float,
    spacing: float = 0.5,
    axis: Axis = "vertical",
) -> Array:
    """Return the Cramer-Rao bounds of angle, delay and Doppler, Eq. (20) to Eq. (23).

    Infinite where nothing is learnt: without an echo (SNR = 0), and for the angle with a single
    antenna or where the array is blind (90 degrees for the vertical axis).

    Departs: ``"paper"`` has the antenna spacing in Eq. (23) where the object's distance is
    printed. ``"exact"`` does not count the transmit array twice (the SNR holds its gain already)
    and has the factor 2 of a real parameter; bandwidth and pulse length are those of a flat
    spectrum and a rectangular pulse. See the ledger.

    Parameters
    ----------
    transmission
        What was sent; ``(..., K, N)`` inside.
    theta
        ``(..., K)`` rad.
    snr
        ``(..., K)``: echo SNR per receive antenna, Eq. (14) and Eq. (16).
    crb
        ``"paper"`` or ``"exact"``.
    n_rx
        Number of receive antennas N_r.
    bandwidth
        Hz. ``"paper"``: kappa, as it stands. ``"exact"``: the width of the flat spectrum.
    pulse_length
        s. ``"paper"``: iota, as it stands. ``"exact"``: the length of the rectangular pulse.
    spacing, axis
        As in `echobeam.physics.array.steering_vector`, for both arrays.

    Returns
    -------
    Array
        ``(..., K, 3)``: rad^2, s^2, Hz^2; NaN for absent objects.
    """
    n_tx = transmission.beams.shape[-1]
    match crb:
        case "paper":
            per_echo = float(n_tx * n_rx)
            aperture = square_aperture(theta, n_tx, spacing, axis)
            delay, doppler = bandwidth**2, pulse_length**2
        case "exact":
            per_echo = 2.0 * n_rx
            aperture = square_aperture(theta, n_rx, spacing, axis) + transmit_aperture(
                transmission, theta, spacing=spacing, axis=axis
            )
            delay, doppler = _mean_square_rate(bandwidth), _mean_square_rate(pulse_length)
        case _:
            assert_never(crb)
    effective_snr = per_echo * np.asarray(snr, dtype=np.float64)
    factors = np.broadcast_arrays(aperture, delay, doppler)
    return _inverse(effective_snr[..., np.newaxis], np.stack(factors, axis=-1))


def effective_variance(variance: Array, snr: npt.ArrayLike) -> Array:
    """Return the variances of the measurements, the bounds of Eq. (20) to Eq. (22).

    Where there is no echo (SNR zero, or NaN for an absent object) nothing is measured: infinite
    variances. Elsewhere the bound is taken at its word, as the paper does, though it grows without
    limit near 90 degrees and off a narrow beam, where no estimator is that bad; the filter gives
    such a measurement the weight that it deserves, next to none.

    Parameters
    ----------
    variance
        ``(..., K, 3)``: rad^2, s^2, Hz^2, of `measurement_variance`.
    snr
        ``(..., K)``: echo SNR.
    """
    heard = np.asarray(snr, dtype=np.float64)[..., np.newaxis] > 0.0
    return np.where(heard & np.isfinite(variance), variance, np.inf)


def square_aperture(
    theta: npt.ArrayLike, n: int, spacing: float = 0.5, axis: Axis = "vertical"
) -> Array:
    """Return xi^2 of Eq. (23): the variance of the phase slopes over ``n`` antennas.

    Departs: the antenna spacing takes the place of the printed distance d_k, xi^2 =
    (2 pi Delta d / lambda)^2 cos^2(theta) (n^2 - 1) / 12.

    Parameters
    ----------
    theta, n, spacing, axis
        As in `echobeam.physics.array.steering_vector`.

    Returns
    -------
    Array
        ``(...)``, 1/rad^2.
    """
    slope = 2.0 * np.pi * spacing * directional_slope(theta, axis)
    aperture: Array = slope**2 * ((n**2 - 1) / 12.0)
    return aperture


def transmit_aperture(
    transmission: Transmission,
    theta: npt.ArrayLike,
    *,
    spacing: float = 0.5,
    axis: Axis = "vertical",
) -> Array:
    """Return xi_t^2, what the transmitted covariance adds to the square aperture; see the module.

    With C = F F^H it is |f' - f (f^H f') / |f|^2|^2 / |f|^2 for f = F^H a, f' = F^H a': what a
    change of the angle changes in the mixture of streams that reaches the object, beyond its
    scale and phase. In this form a rank-one C gives zero without cancellation.

    Parameters
    ----------
    transmission, theta, spacing, axis
        As in `measurement_variance`.

    Returns
    -------
    Array
        ``(..., K)``, 1/rad^2; zero where no power goes (there is no echo to learn from).
    """
    n_tx = transmission.beams.shape[-1]
    a = steering_vector(theta, n_tx, spacing, axis)
    slope = steering_derivative(theta, n_tx, spacing, axis)
    correlated = np.conj(np.swapaxes(transmission.beams, -1, -2))
    single = np.sqrt(np.sum(transmission.antenna_power, axis=-2) + transmission.probing)
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
    """(2 pi)^2 times the variance of a uniform distribution of this width."""
    return (2.0 * np.pi * width) ** 2 / 12.0


def _inverse(snr: Array, factor: Array) -> Array:
    """1 / (snr factor), infinite if either is zero, even if the other is infinite."""
    nothing = (snr == 0.0) | (factor == 0.0)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # inf, by definition
        inverse = 1.0 / (snr * factor)
    return np.where(nothing, np.inf, inverse)
