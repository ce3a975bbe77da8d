"""The uniform linear array: steering vectors and their derivatives, Eq. (4)."""

from __future__ import annotations

import math
from typing import assert_never

import numpy as np
import numpy.typing as npt

from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.values import Array, Axis, ComplexArray


def directional_sine(theta: npt.ArrayLike, axis: Axis = "vertical") -> Array:
    """Return what the array can tell of a direction: u in the phase 2 pi spacing m u of Eq. (4).

    A linear array sees u and not the angle. With the vertical axis ``theta`` and ``pi - theta``
    have the same u (an object ahead and its mirror image behind), with the horizontal one
    ``theta`` and ``-theta`` have (the ground and the sky).

    Parameters
    ----------
    theta
        ``(...)`` rad: depression angle from the road's direction.
    axis
        ``"vertical"``: u = sin(theta), as in the paper; ``"horizontal"``: u = cos(theta).

    Returns
    -------
    Array
        ``(...)``, -1 to 1; NaN where ``theta`` is.
    """
    angle = np.asarray(theta, dtype=np.float64)
    u: Array
    match axis:
        case "vertical":
            u = np.sin(angle)
        case "horizontal":
            u = np.cos(angle)
        case _:
            assert_never(axis)
    return u


def directional_slope(theta: npt.ArrayLike, axis: Axis = "vertical") -> Array:
    """Return du/dtheta of `directional_sine`: cos(theta) or -sin(theta).

    Exactly zero where the array is blind to small changes of the angle: 90 degrees for the
    vertical axis, 0 and 180 for the horizontal one.

    Parameters
    ----------
    theta
        ``(...)`` rad.
    axis
        As in `directional_sine`.
    """
    match axis:
        case "vertical":
            return exact_cosine(theta)
        case "horizontal":
            return -exact_sine(theta)
        case _:
            assert_never(axis)


def steering_vector(
    theta: npt.ArrayLike, n: int, spacing: float = 0.5, axis: Axis = "vertical"
) -> ComplexArray:
    """Return the steering vector a(theta) of Eq. (4): exp(j 2 pi spacing m u), m = 0 .. n - 1.

    Parameters
    ----------
    theta
        ``(...)`` rad.
    n
        Number of antennas.
    spacing
        Distance between neighbours in wavelengths, Delta d / lambda.
    axis
        As in `directional_sine`.

    Returns
    -------
    ComplexArray
        ``(..., n)``, each entry of modulus 1; NaN where ``theta`` is.
    """
    phase = _phase_rate(n, spacing) * directional_sine(theta, axis)[..., np.newaxis]
    vector = np.empty(phase.shape, dtype=np.complex128)
    np.cos(phase, out=vector.real)  # several times faster than the complex exponential
    np.sin(phase, out=vector.imag)
    return vector


def array_response(
    beams: ComplexArray, theta: npt.ArrayLike, spacing: float = 0.5, axis: Axis = "vertical"
) -> ComplexArray:
    """Return what beams send in many directions, a(theta)^H w with a of Eq. (4).

    The response is a polynomial in exp(-j 2 pi spacing u). It is evaluated in blocks of about
    sqrt(N) coefficients, so that few exponentials have to be taken.

    Parameters
    ----------
    beams
        ``(..., N)``, sqrt(power).
    theta
        ``(..., J)`` rad: the directions of each beam.
    spacing, axis
        As in `steering_vector`.

    Returns
    -------
    ComplexArray
        ``(..., J)``, sqrt(power); NaN where ``theta`` is.
    """
    n = beams.shape[-1]
    block = math.isqrt(n - 1) + 1
    blocks = -(-n // block)
    rate = -2.0 * np.pi * spacing * directional_sine(theta, axis)
    within = _powers(rate, block)
    across = _powers(block * rate, blocks)
    padded = np.zeros((*beams.shape[:-1], blocks * block), dtype=np.complex128)
    padded[..., :n] = beams
    coefficients = padded.reshape(*beams.shape[:-1], blocks, block)
    response: ComplexArray = np.einsum(
        "...jq,...jq->...j", within @ np.swapaxes(coefficients, -1, -2), across
    )
    return response


def _powers(phase: Array, count: int) -> ComplexArray:
    """Return exp(j phase)^m, m = 0 .. count - 1, on a new last axis."""
    turns = np.empty((*phase.shape, count), dtype=np.complex128)
    turns[..., 0] = 1.0
    turns[..., 1:] = np.exp(1j * phase)[..., np.newaxis]
    return np.cumprod(turns, axis=-1, out=turns)


def steering_derivative(
    theta: npt.ArrayLike, n: int, spacing: float = 0.5, axis: Axis = "vertical"
) -> ComplexArray:
    """Return da/dtheta of Eq. (4): j 2 pi spacing m (du/dtheta) a(theta).

    Parameters
    ----------
    theta, n, spacing, axis
        As in `steering_vector`.

    Returns
    -------
    ComplexArray
        ``(..., n)``, 1/rad.
    """
    phase_slope = _phase_rate(n, spacing) * directional_slope(theta, axis)[..., np.newaxis]
    derivative: ComplexArray = 1j * phase_slope * steering_vector(theta, n, spacing, axis)
    return derivative


def _phase_rate(n: int, spacing: float) -> Array:
    return 2.0 * np.pi * spacing * np.arange(n, dtype=np.float64)
