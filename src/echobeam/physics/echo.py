"""The radar echo's strength: reflection coefficient and SNR, Eq. (11) to Eq. (16)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.physics.link import stream_gains
from echobeam.physics.planar import AntennaArray, absent
from echobeam.values import Array, ComplexArray, Transmission


def reflection_coefficient(rcs: complex, d: npt.ArrayLike) -> ComplexArray:
    """Return beta = epsilon / d^2 of Eq. (12); the echo's power falls as d^-4.

    Departs: the paper calls its constant cross-section a Swerling I target, which would
    fluctuate from scan to scan; constant it is Swerling 0. The magnitude is infinite at d = 0.

    Parameters
    ----------
    rcs
        epsilon: the complex radar cross-section.
    d
        ``(...)`` m.
    """
    square = np.asarray(d, dtype=np.float64) ** 2
    beta = np.empty(square.shape, dtype=np.complex128)
    with np.errstate(divide="ignore", invalid="ignore"):  # d = 0: inf, by definition
        beta.real = rcs.real / square  # a complex quotient would warn of every NaN
        beta.imag = rcs.imag / square
    return beta


def illumination(sent: Transmission, theta: npt.ArrayLike, array: AntennaArray) -> Array:
    """Return a(theta)^H C a(theta), C all that is sent: the power towards each object, at 1 m.

    It is P_T in every direction in omnidirectional slots, Eq. (6) and Eq. (14), and the sum over
    beams of |a^H w_c|^2 in directional ones, Eq. (16), at most N_t P_T.

    Parameters
    ----------
    sent, theta, array
        As in `echobeam.physics.link.stream_gains`.

    Returns
    -------
    Array
        ``(..., K)``, power; NaN for absent objects.
    """
    gains = stream_gains(sent, theta, array)
    total: Array = np.sum(gains, axis=-1) + np.sum(sent.probing, axis=-1)[..., np.newaxis]
    # Without streams the sum is zero even for an absent object.
    return np.where(absent(theta, array), np.nan, total)


def illumination_along(sent: Transmission, theta: npt.ArrayLike, array: AntennaArray) -> Array:
    """Return `illumination` in many directions at once, equal to it but for rounding.

    An omnidirectional transmission is the same everywhere, and a beam's pattern is a polynomial of
    which few powers have to be taken: several times faster for tens of directions.

    Parameters
    ----------
    sent, theta, array
        As for `illumination`.
    """
    angle = np.asarray(theta, dtype=np.float64)
    missing = absent(angle, array)
    everywhere = np.sum(sent.antenna_power, axis=(-2, -1)) + np.sum(sent.probing, axis=-1)
    total = np.broadcast_to(everywhere[..., np.newaxis], missing.shape)
    if sent.beams.any():
        streams = np.expand_dims(angle, axis=-1 - array.axes)  # an axis for the beams
        pattern = array.pattern(sent.beams, streams)
        total = total + np.sum(pattern, axis=-2)
    return np.where(missing, np.nan, total)


def echo_snr(
    sent: Transmission,
    theta: npt.ArrayLike,
    d: npt.ArrayLike,
    array: AntennaArray,
    *,
    rcs: complex,
    gain: float,
    noise: float,
    along: bool = False,
) -> Array:
    """Return the echo's SNR G_m |beta|^2 a^H C a / sigma^2 of one receive antenna.

    Eq. (14) and Eq. (16): the transmit array's gain is in it, the receive array's is not. The
    echoes of different objects are taken as separated, as the paper does.

    Parameters
    ----------
    sent, theta, array
        As in `illumination`.
    d
        ``(..., K)`` m.
    rcs
        epsilon: the complex radar cross-section.
    gain
        G_m: the processing gain of the matched filter.
    noise
        sigma^2 at the radar receiver.
    along
        Whether there are many directions, see `illumination_along`.

    Returns
    -------
    Array
        ``(..., K)``; NaN for absent objects, infinite at d = 0 if any power goes there.
    """
    beta = reflection_coefficient(rcs, d)
    power = (illumination_along if along else illumination)(sent, theta, array)
    with np.errstate(invalid="ignore"):  # no power on an object at d = 0: NaN
        snr: Array = gain * np.abs(beta) ** 2 * power / noise
    return snr
