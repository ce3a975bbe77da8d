"""Fisher information of a planar array on both direction cosines, and its marginal variances.

The matrix version of `echobeam.physics.bounds`. For the echo b(u, v) a^H(u, v) of unknown complex
amplitude and any transmit covariance

    J = 2 SNR N_r (Xi_r + Xi_t),

where Xi_r is the covariance of the phase slopes (2 pi spacing) (i, j) over the receive elements,
diagonal for a rectangle with (2 pi spacing)^2 (n^2 - 1) / 12 for n rows or columns, and

    Xi_t = Re[D^H D] / |f|^2 - Re[(D^H f)(f^H D)] / |f|^4,  f = F^H a,  D = F^H [da/du, da/dv],

is the same of the transmit elements weighted by what they send, C = F F^H: diagonal for
uncorrelated antennas, zero for a single beam, and of any correlation for several beams. Both
polarisations of an element carry the same amplitude; their streams are entries of f.

Variances are the marginal ones, the diagonal of the inverse of J. Their covariance is zero but for
slots with several beams; it is not passed on.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.physics.planar import PlanarArray, by_polarisation
from echobeam.values import Array, Transmission


def square_apertures(array: PlanarArray) -> Array:
    """Return the variance of the phase slopes along rows and columns, ``(2,)``: xi^2 of Eq. (23).

    Departs: direction cosines take the place of the angle, so that no cosine is left.
    """
    counts = np.array(array.shape, dtype=np.float64)
    apertures: Array = (2.0 * np.pi * array.spacing) ** 2 * (counts**2 - 1.0) / 12.0
    return apertures


def printed_information(transmitter: PlanarArray) -> Array:
    """Return the apertures of the printed bound, ``(2, 2)``: those of the transmit array."""
    return np.diag(square_apertures(transmitter))


def cosine_information(
    sent: Transmission, direction: npt.ArrayLike, transmitter: PlanarArray, receiver: PlanarArray
) -> Array:
    """Return Xi_r + Xi_t, ``(..., K, 2, 2)``; see the module.

    Parameters
    ----------
    sent
        What was sent; ``(..., C, n)`` inside.
    direction
        ``(..., K, 2)`` direction cosines.
    transmitter, receiver
        The two arrays.
    """
    return np.diag(square_apertures(receiver)) + transmit_apertures(sent, direction, transmitter)


def transmit_apertures(sent: Transmission, direction: npt.ArrayLike, array: PlanarArray) -> Array:
    """Return Xi_t, ``(..., K, 2, 2)``; zero where no power goes.

    In terms of residuals R = D - f (f^H D) / |f|^2 it is Re[R^H R] / |f|^2: a single beam gives
    zero without cancellation.

    Parameters
    ----------
    sent, direction, array
        As in `cosine_information`, the transmit array.
    """
    a, slopes = array.steering(direction), array.derivative(direction)
    correlated = np.conj(np.swapaxes(by_polarisation(sent.beams, array), -1, -2))
    single = np.sqrt(np.sum(sent.antenna_power, axis=-2) + sent.probing)[..., np.newaxis, :]
    single = by_polarisation(single, array)  # (..., P, N)
    f = np.concatenate(
        [a @ correlated, _flat(a[..., np.newaxis, :] * single[..., np.newaxis, :, :])], axis=-1
    )
    D = np.concatenate(
        [
            slopes @ correlated[..., np.newaxis, :, :],
            _flat(slopes[..., np.newaxis, :] * single[..., np.newaxis, np.newaxis, :, :]),
        ],
        axis=-1,
    )
    power = np.sum(np.abs(f) ** 2, axis=-1)[..., np.newaxis, np.newaxis]
    dark = power < np.finfo(np.float64).tiny
    per_power = 1.0 / np.where(dark, 1.0, power)
    share = np.sum(np.conj(f)[..., np.newaxis, :] * D, axis=-1, keepdims=True)
    residual = D - f[..., np.newaxis, :] * (share * per_power)
    gram = np.real(np.conj(residual) @ np.swapaxes(residual, -1, -2))
    return np.where(dark, 0.0, gram * per_power)


def marginal_variance(snr: Array, information: Array) -> Array:
    """Return the diagonal of the inverse of SNR times a matrix, ``(..., K, 2)``.

    Infinite without an echo, and for the axis along which an array has a single element.

    Parameters
    ----------
    snr
        ``(..., K)``: SNR times the factor of the bound.
    information
        ``(..., K, 2, 2)`` or ``(2, 2)``: positive semidefinite.
    """
    first, second = information[..., 0, 0], information[..., 1, 1]
    cross = information[..., 0, 1] ** 2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        alone = np.stack(
            [
                first - np.where(second > 0.0, cross / second, 0.0),
                second - np.where(first > 0.0, cross / first, 0.0),
            ],
            axis=-1,
        )
        factor = snr[..., np.newaxis] * alone
        variance = 1.0 / factor
    return np.where(np.isnan(factor), np.nan, np.where(factor > 0.0, variance, np.inf))


def _flat(values: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
    """Return values ``(..., P, N)`` with both axes in one."""
    *batch, polarisations, elements = values.shape
    return values.reshape(*batch, polarisations * elements)  # -1 has no meaning of an empty batch
